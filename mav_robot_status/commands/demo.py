"""Fake robots and the gateway, in one process."""

from __future__ import annotations

import argparse
import sys
from typing import Any, Final

from ..config import ControllerConfig
from ..errors import UsageError
from ..publishers.ros.settings import Ros2Options
from ..publishers.simple_message.options import SimpleMessageOptions
from ..publishers.web.settings import DEFAULT_LISTEN, HttpOptions
from .options import number, publisher, verbosity
from .overrides import with_publisher

MOST_VEHICLES: Final = 254
vehicles: Final = number(int, 1, MOST_VEHICLES, f"a number of vehicles; write 1 to {MOST_VEHICLES}")


def arguments(parser: argparse.ArgumentParser) -> None:
    """The story, its repetition, and the outputs that show it to others."""
    parser.add_argument("--json", action="store_true", help="JSON lines also on a terminal, not the live table")
    parser.add_argument("--loop", action="store_true", help="begin again when it ends")
    parser.add_argument(
        "--vehicles", type=vehicles, metavar="N", help=f"a fleet of 1 to {MOST_VEHICLES}: several types and states"
    )
    parser.add_argument("--mobile-manipulator", action="store_true", help="a rover with an arm on it, as one robot")
    parser.add_argument(
        "--out", action="append", metavar="URL", help="send the vehicles' MAVLink here too: udp:127.0.0.1:14550"
    )
    parser.add_argument(
        "--http", nargs="?", const=DEFAULT_LISTEN, metavar="HOST:PORT", help=f"serve a live web page ({DEFAULT_LISTEN})"
    )
    publisher(parser, HttpOptions, without=("listen",))
    publisher(parser, SimpleMessageOptions)
    publisher(parser, Ros2Options)
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Run until the scenario ends; endlessly with a table, a page, a fleet or another receiver."""
    from ..demo import DEMO_CONTROLLER, fleet, receiver, run_demo, run_mobile_manipulator
    from ..views.terminal import is_screen

    if options.mobile_manipulator and options.vehicles:
        raise UsageError("--vehicles and --mobile-manipulator are two demos; write one of them")
    controllers: tuple[ControllerConfig, ...] = (DEMO_CONTROLLER,)
    for kind in ("http", "simple_message", "ros2"):
        controllers = with_publisher(kind, controllers, options)
    live = is_screen() and not options.json
    endless = bool(live or options.loop or options.vehicles or options.out or options.http)
    shared: dict[str, Any] = {
        "controllers": controllers,
        "to": tuple(map(receiver, options.out or ())),
        "live": live,
        "loop": endless,
    }
    if options.mobile_manipulator:
        run_mobile_manipulator(sys.stdout, **shared)
    elif options.vehicles:
        run_demo(sys.stdout, scenarios=fleet(options.vehicles), **shared)
    else:
        run_demo(sys.stdout, **shared)
    return 0
