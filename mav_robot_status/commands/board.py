"""All robots of an MQTT broker on one page, until it is ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import UsageError
from .options import broker, verbosity, web
from .overrides import OF_BROKER, mqtt_options, page_options

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Which broker, and where the page is."""
    parser.add_argument("broker", metavar="URL", help="what the gateways were given, e.g. mqtts://broker/robots")
    web(parser)
    parser.set_defaults(http="127.0.0.1:8765")
    broker(parser)
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Raises UsageError if the extras are not installed."""
    from ..publishers.mqtt.options import read_broker
    from ..publishers.web.options import read as read_web

    source = read_broker(mqtt_options(options, options.broker, OF_BROKER))
    page = read_web(page_options(options))
    try:
        from ..gateway.board import FleetBoard
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("mav_robot_status"):
            raise
        raise UsageError("the board needs extras: pip install 'mav-robot-status[mqtt,web]'") from None
    fleet = FleetBoard(source, page)
    fleet.stop_on_signals()
    fleet.run()
    return 0
