"""Arguments that several commands share, and their number types.

The arguments of our publishers are not written here: the dataclass of a publisher's options declares them.
"""

from __future__ import annotations

import argparse
import contextlib
import re
from collections.abc import Container
from typing import Any, Final

from ..config.model import LONGEST_NAME, is_vehicle_name
from ..interface import Options
from ..links.url import help_text
from ..publishers.mqtt.options import MqttOptions
from ..publishers.ros.options import Ros2Options
from ..publishers.simple_message.options import SimpleMessageOptions
from ..publishers.web.options import HttpOptions

_NAMED: Final = re.compile(r"([0-9]{1,3})(?:\.([0-9]{1,3}))?=(.*)", re.ASCII | re.DOTALL)

WITH_ARGUMENTS: Final[dict[str, type[Options]]] = {
    "http": HttpOptions,
    "mqtt": MqttOptions,
    "simple_message": SimpleMessageOptions,
    "ros2": Ros2Options,
}
"""The publishers that the command line can add, by type: the first option of each has the flag that enables it."""

FORMS = "forms"
"""A placeholder in a parser for the connection forms: finding every kind of link scans the installed packages."""


class ConnectionHelp(argparse.RawDescriptionHelpFormatter):
    """Writes the forms of a connection at the end of the help."""

    def add_text(self, text: str | None) -> None:
        """Add the forms in place of FORMS."""
        super().add_text(help_text() if text == FORMS else text)


def connections(parser: argparse.ArgumentParser, what: str = "source of MAVLink") -> None:
    """The connections. The end of the help lists their forms."""
    parser.epilog, parser.formatter_class = FORMS, ConnectionHelp
    parser.add_argument("connections", nargs="*", metavar="CONNECTION", help=f"{what}; see below")


def looking(parser: argparse.ArgumentParser, passive: str = "never send on the vehicle links") -> None:
    """The other arguments of a command that reads vehicles and publishes nothing."""
    parser.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    parser.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    names(parser)
    parser.add_argument("--baud", type=baud, metavar="N", help="baud rate of serial connections (57600)")
    parser.add_argument("--signing-key", metavar="FILE", help="accept only frames signed with this key")
    px4_events(parser)
    parser.add_argument("--passive", action="store_true", help=passive)
    arms(parser)
    verbosity(parser)


def names(parser: argparse.ArgumentParser) -> None:
    """The names of vehicles."""
    words = "name a vehicle, for people: 1=Rover-A, or 1.2=Arm for one component; repeatable"
    parser.add_argument("--name", action="append", type=named, metavar="SYSTEM=NAME", help=words)


def px4_events(parser: argparse.ArgumentParser) -> None:
    """The words for the events of PX4."""
    parser.add_argument("--px4-events", metavar="FILE", help="PX4's table of events, all_events.json or .json.xz")


def arms(parser: argparse.ArgumentParser) -> None:
    """The arms beside the vehicles."""
    words = "an arm beside the vehicle: ur:HOST[:PORT] or simple_message:HOST[:PORT]; repeatable"
    parser.add_argument("--arm", action="append", metavar="TYPE:HOST", help=words)


def publisher(parser: argparse.ArgumentParser, options: type[Options], without: Container[str] = ()) -> None:
    """The arguments of a publisher: one for each option with a flag, except those in `without`."""
    for name, kind, _, option in options.declared():
        if option.flag is None or name in without:
            continue
        if kind is bool:
            parser.add_argument(option.flag, action="store_true", help=option.help)
        else:
            convert = float if kind is float else str
            choices = option.choices or None
            parser.add_argument(option.flag, type=convert, metavar=option.metavar, choices=choices, help=option.help)


def publishers(parser: argparse.ArgumentParser) -> None:
    """The arguments of all publishers that the command line can add. The first flag of each enables it."""
    for options in WITH_ARGUMENTS.values():
        publisher(parser, options)


def given(options: argparse.Namespace, declared: type[Options]) -> dict[str, object]:
    """The options of a publisher that the command line gives, as a configuration writes them."""
    values = {one.name: value_of(options, one.option.flag) for one in declared.declared() if one.option.flag}
    return {name: value for name, value in values.items() if value is not None and value is not False}


def value_of(options: argparse.Namespace, flag: str) -> Any:
    """The value of `--a-flag` on the command line; None if the command lacks it."""
    return getattr(options, flag.strip("-").replace("-", "_"), None)


def verbosity(parser: argparse.ArgumentParser) -> None:
    """How much is logged. A command without these arguments logs nothing."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("-v", "--verbose", action="store_true", help="log more")
    group.add_argument("-q", "--quiet", action="store_true", help="log warnings only")


def rate(text: str) -> float:
    """Hz; 0 for none. Raises ArgumentTypeError, like the functions below."""
    with contextlib.suppress(ValueError):
        if 0 <= (hertz := float(text)) <= 1000:
            return hertz
    raise argparse.ArgumentTypeError(f"{text!r} is not a rate; write a number of Hz up to 1000, 0 for none")


def seconds(text: str) -> float:
    """Seconds to listen, at most an hour."""
    with contextlib.suppress(ValueError):
        if 0 < (duration := float(text)) <= 3600:
            return duration
    raise argparse.ArgumentTypeError(f"{text!r} is not a duration; write a number of seconds up to 3600")


def gap(text: str) -> float:
    """Seconds of silence in a log."""
    with contextlib.suppress(ValueError):
        if 0 <= (silence := float(text)) <= 86400:
            return silence
    raise argparse.ArgumentTypeError(f"{text!r} is not a duration; write a number of seconds up to 86400")


def system(text: str) -> int:
    """A MAVLink system id, 1 to 255."""
    return _number(text, "a system id", 255)


def named(text: str) -> tuple[tuple[int, int | None], str]:
    """The ids and the name of a vehicle. None: each autopilot of the system."""
    found = _NAMED.fullmatch(text)
    if found is None or not all(1 <= int(one) <= 255 for one in found.groups()[:2] if one is not None):
        raise argparse.ArgumentTypeError(f"{text!r} is not SYSTEM=NAME; write for example 1=Rover-A, or 1.2=Arm")
    if not is_vehicle_name(found[3]):
        raise argparse.ArgumentTypeError(f"{text!r}: a name has 1 to {LONGEST_NAME} printable characters")
    return (int(found[1]), None if found[2] is None else int(found[2])), found[3]


def baud(text: str) -> int:
    """Bits per second."""
    return _number(text, "a baud rate", 99_999_999)


def _number(text: str, what: str, most: int) -> int:
    with contextlib.suppress(ValueError):
        if 1 <= (number := int(text)) <= most:
            return number
    raise argparse.ArgumentTypeError(f"{text!r} is not {what}; write a number from 1 to {most}")
