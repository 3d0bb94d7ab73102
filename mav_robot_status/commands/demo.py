"""A fake autopilot and the gateway, in one process."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from ..publishers.web.options import HttpOptions
from .options import publisher, verbosity
from .overrides import with_publisher

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Repetition and the web page."""
    parser.add_argument("--loop", action="store_true", help="begin again when it ends")
    publisher(parser, HttpOptions)
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Run until the end of the scenario."""
    from ..demo import DEMO_CONTROLLER, run_demo

    run_demo(sys.stdout, loop=options.loop, controllers=with_publisher("http", (DEMO_CONTROLLER,), options))
    return 0
