"""Show why each field has its value, now or at a time in a log."""

from __future__ import annotations

import argparse
import sys

from ..errors import NothingHeardError, UsageError
from ..links.url import parse
from ..streams import say
from .options import connections, looking
from .overrides import configured


def arguments(parser: argparse.ArgumentParser) -> None:
    """The connections and the time."""
    connections(parser)
    parser.add_argument("--at", metavar="TIME", help="moment of a log: 2026-11-20T18:49:07Z, +44 (seconds), boot:93")
    parser.add_argument("--as-json", action="store_true", help="as JSON, one object for each vehicle")
    looking(parser)


def run(options: argparse.Namespace) -> int:
    """Print a table or JSON."""
    from ..diagnosis.explain import as_json, as_table, explain_live, explain_log

    config = configured(options)
    urls = [parse(link.url) for link in config.links]
    if len(urls) == 1 and urls[0].kind.is_log:
        if options.arm:
            raise UsageError(f"{urls[0].text}: a recorded log has no arm: explain it without --arm")
        found = explain_log(config, urls[0].device, options.at)
    elif options.at is not None:
        raise UsageError("--at is a moment of a recorded log; a live connection is explained now")
    else:
        found = explain_live(config, sys.stdout)
    if not found:
        who = "no robot" if config.interfaces else "no autopilot"
        raise NothingHeardError(f"{who} was heard, so there is nothing to explain")
    say(*(as_json(found) if options.as_json else as_table(found)))
    return 0
