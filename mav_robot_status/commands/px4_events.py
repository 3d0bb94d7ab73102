"""Fetch the table of PX4's events from a vehicle, into a file for `--px4-events`."""

from __future__ import annotations

import argparse
import sys

from ..config import Config
from ..errors import LinkError, UsageError
from ..links.url import parse
from ..streams import say
from .options import FORMS, ConnectionHelp, baud, seconds, system, verbosity
from .overrides import configured


def arguments(parser: argparse.ArgumentParser) -> None:
    """The only action, the connection and the file."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    fetch = actions.add_parser(
        "fetch",
        help="read the table from a PX4 over MAVLink FTP, and write it to a file",
        description="Read the table of its events from a PX4 over MAVLink FTP, and write it to a file.",
        epilog=FORMS,
        formatter_class=ConnectionHelp,
    )
    fetch.add_argument("connections", nargs="*", metavar="CONNECTION", help="where the PX4 is; see below")
    fetch.add_argument(
        "-o", "--output", metavar="FILE", required=True, help="file to write: *.json is unpacked, others stay xz"
    )
    fetch.add_argument("--seconds", type=seconds, metavar="S", default=90.0, help="give up after this time (90)")
    fetch.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    fetch.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    fetch.add_argument("--baud", type=baud, metavar="N", help="baud rate of serial connections (57600)")
    fetch.add_argument("--signing-key", metavar="FILE", help="sign what is sent, accept only signed frames")
    fetch.set_defaults(passive=False)
    verbosity(fetch)


def run(options: argparse.Namespace) -> int:
    """Write the table. Raises UsageError, NothingHeardError, and LinkError if it cannot be had or written."""
    from ..diagnosis.event_table import fetch
    from ..views.progress import ProgressLine

    config = configured(options)
    _check(config)
    progress = ProgressLine(sys.stderr, "the table of events")
    try:
        data = fetch(config, options.seconds, progress)
    finally:
        progress.close()
    _write(options.output, data)
    say(options.output)
    return 0


def _check(config: Config) -> None:
    """Raises UsageError for a connection on which nothing can be asked."""
    for link in config.links:
        if parse(link.url).kind.is_log:
            raise UsageError(f"{link.url!r} is a log, and a table is read from a vehicle: write udp:127.0.0.1:14550")
    if all(link.passive for link in config.links):
        raise UsageError("every link is passive, and a table must be asked for: remove `passive` from one")


def _write(path: str, data: bytes) -> None:
    from ..diagnosis.event_table import as_json, as_xz

    try:
        with open(path, "wb") as file:
            file.write(as_json(data) if path.endswith(".json") else as_xz(data))
    except OSError as error:
        raise LinkError(f"cannot write {path}: {error.strerror}") from None
