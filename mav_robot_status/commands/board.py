"""All robots of an MQTT broker on one page."""

from __future__ import annotations

import argparse

from ..errors import UsageError
from ..extras import install
from ..publishers.mqtt.settings import BrokerOptions
from ..publishers.web.settings import DEFAULT_LISTEN, HttpOptions
from .options import given, publisher, verbosity


def arguments(parser: argparse.ArgumentParser) -> None:
    """The broker, and the address of the page."""
    parser.add_argument("mqtt", metavar="URL", help="the --mqtt of the gateways, for example mqtts://broker/robots")
    publisher(parser, HttpOptions)
    parser.set_defaults(http=DEFAULT_LISTEN)
    publisher(parser, BrokerOptions, without=("url",))
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Raises UsageError if the extras are not installed."""
    from ..publishers.mqtt.settings import read_broker
    from ..publishers.web.settings import read as read_web

    source = read_broker(given(options, BrokerOptions))
    page = read_web(given(options, HttpOptions))
    try:
        from ..gateway.board import FleetBoard
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("mav_robot_status"):
            raise
        raise UsageError(f"the board needs extras: {install('mqtt', 'web')}") from None
    fleet = FleetBoard(source, page)
    fleet.stop_on_signals()
    fleet.run()
    return 0
