"""A fake autopilot and the gateway, in one process."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from .options import verbosity, web
from .overrides import with_page

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """How often, and whether with a page."""
    parser.add_argument("--loop", action="store_true", help="begin again when it ends")
    web(parser)
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Until the story ends."""
    from ..demo import DEMO_CONTROLLER, run_demo

    run_demo(sys.stdout, loop=options.loop, controllers=with_page((DEMO_CONTROLLER,), options))
    return 0
