"""The connection strings of our kinds of links: HOST:PORT, and a serial device with its baud rate."""

from __future__ import annotations

import os
import re
from typing import NoReturn

from mav_robot_status.errors import UsageError
from mav_robot_status.links.kind import LinkKind, Url
from mav_robot_status.links.senders import FORM, family, sender

DEFAULT_BAUD = 57600
"""Bits per second if neither the connection string nor the command line has a rate: what telemetry radios use."""

BARE_HOST_PORT = re.compile(r"(?:\[[^\]]*\]|[\w.-]+):[0-9]+", re.ASCII)
ADDRESS = re.compile(r"[0-9]+(?:\.[0-9]+){3}|\[[0-9A-Fa-f:.%]+\]|localhost")
# By-id and by-path names contain colons and small numbers (usb-0:1:1.0); a baud rate has at least four digits.
DEVICE_BAUD = re.compile(
    r"(.*?)(?:,(.*?)|:([0-9]{4,})|\?baudrate=([0-9]+))?(?:[:,]([5-8][NEOMS](?:1|1\.5|2)))?", re.DOTALL | re.IGNORECASE
)
"""The device, its baud rate in one of three forms, and its frame format."""
FRAME_FORMAT = "8N1"
"""8 data bits, no parity, 1 stop bit: what MAVLink uses on serial lines."""
_HOST_PORT = re.compile(r"(?:\[([0-9A-Fa-f:.]+(?:%[\w.-]+)?)\]|([\w.-]*)):([0-9]*)", re.ASCII)
FROM = "?from="
"""Separates the addresses that a listening link hears from the connection string."""
_MAVROS = re.compile(r"[^@]*?(?::([0-9]+))?@(.*)", re.DOTALL)


def network(kind: LinkKind, text: str, rest: str, baud: int | None = None) -> Url:
    """HOST:PORT. A listener may omit the host, and the colon: it then listens on every address of this machine.

    `?from=` behind it names the addresses that a listener hears.
    """
    if "@" in rest:
        _explain_mavros(text, kind, rest)
    rest, question, option = rest.partition("?")
    rest = rest.rstrip("/")
    senders = _senders(text, kind, rest, option) if question else ()
    if kind.listens and rest.isascii() and rest.isdigit():
        rest = f":{rest}"
    found = _HOST_PORT.fullmatch(rest)
    if found is None:
        if rest.count(":") > 1 and "[" not in rest:
            raise UsageError(f"{text!r}: write an IPv6 address in brackets, {kind.schemes[0]}:[::1]:14550")
        problem = "has no port" if ADDRESS.fullmatch(rest) or not rest else "is not HOST:PORT"
        raise UsageError(f"{text!r} {problem}; write for example {_with_port(kind, rest)}")
    host, port = found[1] or found[2], found[3]
    if not host and not kind.listens:
        raise UsageError(f"{text!r} has no host; write for example {kind.example}")
    if not port:
        raise UsageError(f"{text!r} has no port; write for example {_with_port(kind, host)}")
    host = host or "0.0.0.0"
    _check_families(text, host, senders)
    return Url(kind, host, _port(text, kind, port), "", 0, text, senders)


def _senders(text: str, kind: LinkKind, place: str, option: str) -> tuple[str, ...]:
    """The addresses of `from=10.0.0.5,10.0.0.0/24`."""
    key, equals, value = option.partition("=")
    right = f"{kind.schemes[0]}:{place}"
    if key == "from":
        refuse_from(text, right, kind)
        if not equals or not all(entries := value.split(",")):
            raise UsageError(f"{text!r}: from= names nobody; write {FORM}")
        try:
            return tuple(dict.fromkeys(map(sender, entries)))
        except UsageError as error:
            raise UsageError(f"{text!r}: {error}") from None
    if kind.listens and sorted(key.lower()) == sorted("from"):
        raise UsageError(f"{text!r}: did you mean {right}?from={value} ?")
    raise UsageError(f"{text!r}: options after '?' belong to another program; write {right}")


def refuse_from(text: str, right: str, kind: LinkKind) -> None:
    """Raise UsageError if only one peer speaks on this kind of link. `right`: the connection string without `from=`."""
    if not kind.listens:
        raise UsageError(f"{text!r}: from= is for links on which anybody can speak, udp: and tcpin:; write {right}")


def _check_families(text: str, host: str, senders: tuple[str, ...]) -> None:
    """Raise UsageError for an address that can never speak there. `::` hears IPv4, too."""
    ours = family(host) if senders and host != "::" else 0
    for one in senders:
        if ours and family(one) != ours:
            raise UsageError(f"{text!r}: {one} is IPv{family(one)}, and {host} hears only IPv{ours}; listen on [::]")


def _with_port(kind: LinkKind, host: str) -> str:
    """What to write if the port is missing: the address in the connection string if it has one, else the example."""
    port = kind.example.rpartition(":")[2]
    return f"{kind.schemes[0]}:{host}:{port}" if ADDRESS.fullmatch(host) else kind.example


def _port(text: str, kind: LinkKind, digits: str) -> int:
    """A number from 1 to 65535. A listener may have port 0: the system picks a free one. Tests use it."""
    port = int(digits[:6])
    if not (0 < port <= 65535 or (port == 0 and kind.listens)):
        raise UsageError(f"{text!r}: a port is 1 to 65535, not {digits[:12]}; write for example {kind.example}")
    return port


def _explain_mavros(text: str, kind: LinkKind, rest: str) -> NoReturn:
    """A connection string of MAVROS names both ends; ours names one."""
    found = _MAVROS.fullmatch(rest)
    port, remote = (found[1] or "14550", found[2]) if found else ("14550", "")
    remote = remote if BARE_HOST_PORT.fullmatch(remote) else "192.168.1.20:14550"
    both = kind.transport == "udp" and kind.listens
    advice = f"udp:0.0.0.0:{port} to listen, or udpout:{remote} to send" if both else kind.example
    raise UsageError(f"{text!r} is MAVROS's form, with '@'; write {advice}")


def serial(kind: LinkKind, text: str, rest: str, baud: int | None = None) -> Url:
    """DEVICE, DEVICE,BAUD or DEVICE:BAUD, and `:8N1` behind it. A device that exists under the whole text wins."""
    if FROM in rest and not os.path.exists(rest):
        refuse_from(text, text.partition(FROM)[0], kind)
    found = None if os.path.exists(rest) else DEVICE_BAUD.fullmatch(rest)
    device, *rates, frame = found.groups() if found else (rest, None)
    digits = next((rate for rate in rates if rate is not None), None)
    if not device or not device.startswith(("/", ".")):
        raise UsageError(f"{text!r} names no device; write for example {kind.example}")
    if frame is not None and frame.upper() != FRAME_FORMAT:
        where = device if digits is None else f"{device}:{digits}"
        raise UsageError(f"{text!r}: the frame format is {FRAME_FORMAT}, as MAVLink has it, not {frame}; write {where}")
    if digits is None:
        return Url(kind, "", 0, device, baud or DEFAULT_BAUD, text)
    if not re.fullmatch(r"[0-9]{1,8}", digits) or int(digits) == 0:
        raise UsageError(f"{text!r}: the baud rate must be a number; write for example {kind.example}")
    return Url(kind, "", 0, device, int(digits), text)
