"""Arguments that several commands share, and their number types.

The arguments of our publishers are not written here: the dataclass of a publisher's options declares them.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import re
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from ..config.model import LONGEST_NAME, is_vehicle_name
from ..links.url import help_text

if TYPE_CHECKING:
    from collections.abc import Container, Iterable

    from ..interface import Options

_NAMED: Final = re.compile(r"([0-9]{1,3})(?:\.([0-9]{1,3}))?=(.*)", re.ASCII | re.DOTALL)

WITH_ARGUMENTS: Final = {
    "http": (("--http", "--alarm"), "publishers.web.settings", "HttpOptions"),
    "mqtt": (("--mqtt",), "publishers.mqtt.settings", "MqttOptions"),
    "simple_message": (("--simple-message",), "publishers.simple_message.options", "SimpleMessageOptions"),
    "ros2": (("--ros2",), "publishers.ros.settings", "Ros2Options"),
}
"""The publishers that the command line can add. For each: the beginnings of its flags, first that of the flag that
enables it; and the class that declares its options."""

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
    """The arguments of the publishers in WITH_ARGUMENTS that the given ones may name: the first flag enables each.

    To declare the arguments of one publisher takes 1 % of the time in which a gateway starts.
    """
    words = getattr(parser, "words", None)
    for kind, (flags, _, _) in WITH_ARGUMENTS.items():
        if words is None or any(may_name(flag, words) for flag in flags):
            publisher(parser, options_of(kind))


def options_of(kind: str) -> type[Options]:
    """The options of a publisher in WITH_ARGUMENTS."""
    _, module, name = WITH_ARGUMENTS[kind]
    found: type[Options] = getattr(import_module(f"...{module}", __name__), name)
    return found


def may_name(flag: str, words: Iterable[str]) -> bool:
    """Whether one of these arguments may be a flag that begins with `flag`, abbreviated or not, or asks for help."""
    for word in words:
        name = word.partition("=")[0]
        if name[:1] != "-":
            continue
        if name.startswith(flag) or flag.startswith(name) or "--help".startswith(name):
            return True
        if name[:2] != "--" and "h" in name:  # -qh
            return True
    return False


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
    """Hz; 0 or less for none. Raises ArgumentTypeError, like the functions below."""
    with contextlib.suppress(ValueError):
        if -math.inf < (hertz := float(text)) <= 1000:
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
