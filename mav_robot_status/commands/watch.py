"""A live table of the vehicles, until the person ends it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import UsageError
from ..link.url import parse
from . import PROGRAM
from .options import connections, looking
from .overrides import configured

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Which vehicles."""
    connections(parser)
    looking(parser)


def run(options: argparse.Namespace) -> int:
    """The terminal is as before when it ends."""
    from ..gateway.watched import Watched
    from ..views.terminal import show

    config = configured(options)
    for url in (parse(link.url) for link in config.links):
        if url.kind == "log":
            raise UsageError(f"{url.text} is a recorded log; see it as a picture: {PROGRAM} report {url.text}")
    with Watched(config) as source:
        show(source)
    return 0
