"""Find out why there is no status."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..links.url import parse
from ..streams import say
from .options import connections, looking, seconds
from .overrides import configured

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """The connections and the duration."""
    connections(parser, "what to listen to")
    parser.add_argument(
        "--seconds", type=seconds, metavar="S", default=5.0, help="listen so long, from the first heartbeat on (5)"
    )
    parser.add_argument("--as-json", action="store_true", help="as JSON, one object for each connection")
    looking(parser, "never send anything on the connections")


def run(options: argparse.Namespace) -> int:
    """0: every connection has a status; 1: one lacks it."""
    from ..diagnosis.doctor.listen import examine
    from ..diagnosis.doctor.rendering import as_json, as_text

    config = configured(options)
    for link in config.links:  # report an invalid connection before listening
        parse(link.url)
    ok = True
    for link in config.links:
        found, diagnosis = examine(config, link, options.seconds)
        ok = ok and diagnosis.ok
        say(*([as_json(found, diagnosis)] if options.as_json else as_text(found, diagnosis)))
    return 0 if ok else 1
