"""Show a live table of the vehicles, until the user quits."""

from __future__ import annotations

import argparse

from ..errors import UsageError
from ..links.url import parse
from . import PROGRAM
from .options import connections, looking
from .overrides import configured


def arguments(parser: argparse.ArgumentParser) -> None:
    """The connections and the vehicles."""
    connections(parser)
    looking(parser)


def run(options: argparse.Namespace) -> int:
    """Restore the terminal at the end."""
    from ..gateway.background import BackgroundGateway
    from ..views.terminal import show

    config = configured(options)
    for url in (parse(link.url) for link in config.links):
        if url.kind.is_log:
            raise UsageError(f"{url.text} is a recorded log; see it as a picture: {PROGRAM} report {url.text}")
    with BackgroundGateway(config) as source:
        return show(source)
