"""What several commands let a person say on the command line, and the numbers that make sense there."""

from __future__ import annotations

import argparse
import contextlib

from ..link.url import help_text


def connections(parser: argparse.ArgumentParser, what: str = "where MAVLink comes from") -> None:
    """The connections, whose forms stand at the end of the help."""
    parser.epilog, parser.formatter_class = help_text(), argparse.RawDescriptionHelpFormatter
    parser.add_argument("connections", nargs="*", metavar="CONNECTION", help=f"{what}; see below")


def looking(parser: argparse.ArgumentParser, passive: str = "never send anything on the vehicle links") -> None:
    """The rest for a command that looks at vehicles and does not pass on what it sees."""
    parser.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    parser.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    parser.add_argument("--baud", type=baud, metavar="N", help="baud rate of serial connections (57600)")
    parser.add_argument("--signing-key", metavar="FILE", help="believe only what is signed with this key")
    parser.add_argument("--passive", action="store_true", help=passive)
    verbosity(parser)


def web(parser: argparse.ArgumentParser) -> None:
    """The web page."""
    parser.add_argument("--http", metavar="HOST:PORT", help="the statuses as a live web page, e.g. on 127.0.0.1:8765")
    parser.add_argument("--http-token-file", metavar="FILE", help="show the page's data only to who has this token")
    parser.add_argument("--http-open", action="store_true", help="show them to everybody who can reach HOST:PORT")


def broker(parser: argparse.ArgumentParser) -> None:
    """How to come to an MQTT broker."""
    parser.add_argument("--mqtt-user", metavar="NAME", help="who we are to the broker")
    parser.add_argument(
        "--mqtt-password-file", metavar="FILE", help="the password, unless it is in MAV_ROBOT_STATUS_MQTT_PASSWORD"
    )
    parser.add_argument("--mqtt-ca", metavar="FILE", help="authority to believe (PEM), instead of the system's")
    parser.add_argument("--mqtt-cert", metavar="FILE", help="our own certificate (PEM)")
    parser.add_argument("--mqtt-key", metavar="FILE", help="its key, if it is not in the same file")
    parser.add_argument("--mqtt-version", choices=("5", "3.1.1"), help="of the protocol (5)")
    parser.add_argument(
        "--mqtt-keepalive", type=float, metavar="S", help="how soon a broken connection is noticed, in seconds (10)"
    )


def verbosity(parser: argparse.ArgumentParser) -> None:
    """How much is logged; a command without it logs nothing."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("-v", "--verbose", action="store_true", help="more in the log")
    group.add_argument("-q", "--quiet", action="store_true", help="only warnings in the log")


def rate(text: str) -> float:
    """Hz; 0 and below for none. Raises ArgumentTypeError, as the others do."""
    with contextlib.suppress(ValueError):
        if abs(hertz := float(text)) <= 1000:
            return hertz
    raise argparse.ArgumentTypeError(f"{text!r} is not a rate; write a number of Hz up to 1000, 0 for none")


def seconds(text: str) -> float:
    """How long to listen, up to an hour."""
    with contextlib.suppress(ValueError):
        if 0 < (duration := float(text)) <= 3600:
            return duration
    raise argparse.ArgumentTypeError(f"{text!r} is no time to listen; write a number of seconds up to 3600")


def system(text: str) -> int:
    """A MAVLink system id, 1 to 255."""
    return _number(text, "a system id", 255)


def baud(text: str) -> int:
    """Bits per second."""
    return _number(text, "a baud rate", 99_999_999)


def _number(text: str, what: str, most: int) -> int:
    with contextlib.suppress(ValueError):
        if 1 <= (number := int(text)) <= most:
            return number
    raise argparse.ArgumentTypeError(f"{text!r} is not {what}; write a number from 1 to {most}")
