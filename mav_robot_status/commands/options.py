"""Arguments that several commands share, and their number types.

The arguments of our publishers are not written here: the dataclass of a publisher's options declares them.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
from collections.abc import Callable, Container
from typing import Any, Final, TypeVar

from ..config.model import LONGEST_NAME, is_vehicle_name
from ..interface import Options
from ..links.url import help_text
from ..publishers.mcap.settings import McapOptions
from ..publishers.mqtt.settings import MqttOptions
from ..publishers.ros.settings import Ros2Options
from ..publishers.simple_message.options import SimpleMessageOptions
from ..publishers.web.settings import HttpOptions

N = TypeVar("N", int, float)

_NAMED: Final = re.compile(r"([0-9]{1,3})(?:\.([0-9]{1,3}))?=(.*)", re.ASCII | re.DOTALL)

WITH_ARGUMENTS: Final[dict[str, type[Options]]] = {
    "http": HttpOptions,
    "mcap": McapOptions,
    "mqtt": MqttOptions,
    "simple_message": SimpleMessageOptions,
    "ros2": Ros2Options,
}
"""The publishers that the command line can add, by type: the first option of each has the flag that enables it."""

FORMS = "forms"
"""A placeholder in a parser for the connection forms: finding every kind of link scans the installed packages."""


class Help(argparse.HelpFormatter):
    """As wide as the terminal. argparse makes one for each argument, and imports all compressors to find the width."""

    def __init__(self, prog: str, **options: Any) -> None:
        options.setdefault("width", _columns() - 2)
        super().__init__(prog, **options)


def _columns() -> int:
    """The width of the terminal, as `shutil` has it."""
    with contextlib.suppress(KeyError, ValueError):
        if (columns := int(os.environ["COLUMNS"])) > 0:
            return columns
    with contextlib.suppress(AttributeError, ValueError, OSError):
        return os.get_terminal_size(sys.__stdout__.fileno()).columns or 80  # type: ignore[union-attr]
    return 80


class ConnectionHelp(Help, argparse.RawDescriptionHelpFormatter):
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


def number(kind: Callable[[str], N], low: float, high: float, what: str) -> Callable[[str], N]:
    """The type of an argument: a number from `low` to `high`. It raises ArgumentTypeError for another text."""

    def read(text: str) -> N:
        with contextlib.suppress(ValueError):
            if low <= (found := kind(text)) <= high:
                return found
        raise argparse.ArgumentTypeError(f"{text!r} is not {what}")

    return read


rate: Final = number(float, -sys.float_info.max, 1000, "a rate; write a number of Hz up to 1000, 0 for none")
seconds: Final = number(float, 1e-9, 3600, "a duration; write a number of seconds up to 3600")
gap: Final = number(float, 0, 86400, "a duration; write a number of seconds up to 86400")
system: Final = number(int, 1, 255, "a system id; write a number from 1 to 255")
baud: Final = number(int, 1, 99_999_999, "a baud rate; write a number from 1 to 99999999")


def named(text: str) -> tuple[tuple[int, int | None], str]:
    """The ids and the name of a vehicle. None: each autopilot of the system."""
    found = _NAMED.fullmatch(text)
    if found is None or not all(1 <= int(one) <= 255 for one in found.groups()[:2] if one is not None):
        raise argparse.ArgumentTypeError(f"{text!r} is not SYSTEM=NAME; write for example 1=Rover-A, or 1.2=Arm")
    if not is_vehicle_name(found[3]):
        raise argparse.ArgumentTypeError(f"{text!r}: a name has 1 to {LONGEST_NAME} printable characters")
    return (int(found[1]), None if found[2] is None else int(found[2])), found[3]
