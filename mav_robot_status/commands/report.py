"""Draw recorded logs as HTML, or sum them up as JSON."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import sys

from ..config import Config
from ..errors import NothingHeardError
from ..streams import say
from ..version import __version__
from ..views.timeline import Timeline
from . import PROGRAM
from .options import names, px4_events, system, verbosity
from .overrides import loaded, only


def arguments(parser: argparse.ArgumentParser) -> None:
    """The logs and the output file."""
    parser.add_argument("logs", nargs="+", metavar="LOG", help="a recorded log (.tlog, .bin, .ulg)")
    parser.add_argument("-o", "--output", metavar="FILE.html", help="where to write (the log's name with .html, here)")
    parser.add_argument("--as-json", action="store_true", help="totals and intervals as JSON, not HTML; with -o both")
    parser.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    px4_events(parser)
    parser.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    names(parser)
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Print the name of the written file, or JSON."""
    from ..views.html_report import as_html, as_json, save

    config = loaded(options)
    if options.system is not None:
        config = only(config, options.system)
    timelines = [_timeline(config, path) for path in options.logs]
    if not any(timeline.vehicles for timeline in timelines):
        raise NothingHeardError("no autopilot was heard, so there is nothing to show")
    if options.as_json:
        say(*as_json(timelines).split("\n"))
    if options.output or not options.as_json:
        output = options.output or f"{os.path.splitext(timelines[0].name)[0]}.html"
        save(as_html(timelines, f"{PROGRAM} {__version__}"), output)
        if not options.as_json:
            say(output)
    return 0


def _timeline(config: Config, path: str) -> Timeline:
    from ..diagnosis.log_report import watch
    from ..views.progress import ProgressLine
    from ..views.timeline import TimelineBuilder

    builder = TimelineBuilder(os.path.basename(path))
    with contextlib.closing(ProgressLine(sys.stderr, f"reading {builder.timeline.name}")) as progress:
        summary = watch(config, path, builder, progress)
    logging.getLogger(__name__).info("%s", summary)
    return builder.timeline
