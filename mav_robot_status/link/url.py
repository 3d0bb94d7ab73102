"""Connection strings: every form that people know from pymavlink, MAVSDK and mavlink-router, as one table.

`KINDS` is the parser's scheme table, the help text, and what `open_link` opens.
"""

from __future__ import annotations

import difflib
import os
import re
import stat
from typing import NamedTuple, NoReturn

from mav_robot_status.errors import UsageError

DEFAULT_BAUD = 57600
"""Bits per second where neither the text nor the caller names a rate: what telemetry radios are set to."""


class Kind(NamedTuple):
    """One kind of connection: a row of the table."""

    name: str
    schemes: tuple[str, ...]
    """What may stand before the first colon, with or without `//` behind it."""
    forms: str
    words: str
    """What is done, for the log; filled with `where` (HOST:PORT), `device` and `baud`."""
    example: str
    description: str
    opener: str
    """`module:callable` in this package, from a `Url` to a `Link` (log: from a path to a reader)."""


KINDS = (
    Kind("udpin", ("udp", "udpin"), "udp:H:P  udpin:H:P  udp://[H]:P  udpin://H:P", "listening on {where}/udp",
         "udp:127.0.0.1:14550", "listen on a UDP port", "udp:UdpListener"),
    Kind("udpout", ("udpout",), "H:P  udpout:H:P  udpout://H:P", "sending to {where}/udp",
         "udpout:192.168.1.20:14550", "send to a UDP port", "udp:UdpSender"),
    Kind("udpbcast", ("udpbcast",), "udpbcast:H:P", "broadcasting to {where}/udp",
         "udpbcast:192.168.1.255:14550", "broadcast on UDP until a peer answers", "udp:UdpBroadcaster"),
    Kind("tcp", ("tcp", "tcpout"), "tcp:H:P  tcpout://H:P", "connecting to {where}/tcp",
         "tcp:127.0.0.1:5760", "connect to a TCP server", "tcp:TcpLink"),
    Kind("tcpin", ("tcpin",), "tcpin:H:P  tcpin://H:P", "listening on {where}/tcp",
         "tcpin:0.0.0.0:5760", "be a TCP server", "tcp_server:TcpServerLink"),
    Kind("serial", ("serial",), "/dev/ttyX[,BAUD]  /dev/ttyX:BAUD  serial:///dev/ttyX:BAUD",
         "serial {device} at {baud} baud", "/dev/ttyACM0,57600",
         f"a serial device; {DEFAULT_BAUD} baud unless told", "serial:SerialLink"),
    Kind("log", (), "FILE", "recorded log {device}",
         "flight.tlog", "replay a recorded log", "log:LogReader"),
)  # fmt: skip
"""Every kind, in the order in which the help shows them."""

LISTENERS = ("udpin", "tcpin")
BY_NAME = {kind.name: kind for kind in KINDS}
_BY_SCHEME = {scheme: kind for kind in KINDS for scheme in kind.schemes}
_SOME = ", ".join(BY_NAME[name].example for name in ("udpin", "serial", "log"))

_SCHEME = re.compile(r"([A-Za-z][\w+-]*):(?://)?(.*)", re.ASCII | re.DOTALL)
_HOST_PORT = re.compile(r"(?:\[([0-9A-Fa-f:.]+(?:%[\w.-]+)?)\]|([\w.-]*)):([0-9]*)", re.ASCII)
_BARE_HOST_PORT = re.compile(r"(?:\[[^\]]*\]|[\w.-]+):[0-9]+", re.ASCII)
_ADDRESS = re.compile(r"[0-9]+(?:\.[0-9]+){3}|\[[0-9A-Fa-f:.%]+\]|localhost")
_MAVROS = re.compile(r"[^@]*?(?::([0-9]+))?@(.*)", re.DOTALL)
# By-id and by-path names hold colons and small numbers (usb-0:1:1.0), a baud rate has four digits at least.
_DEVICE_BAUD = re.compile(r"(.*?)(?:,(.*)|:([0-9]{4,}))?", re.DOTALL)


class Url(NamedTuple):
    """What a connection string was taken to mean."""

    kind: str
    """The name of a row of `KINDS`."""
    host: str
    """Without brackets; empty for serial and log."""
    port: int
    device: str
    """The serial device's or the log's path."""
    baud: int
    """Bits per second; 0 unless serial."""
    text: str
    """As the person wrote it."""

    def words(self) -> str:
        """What will be done, in words: `listening on 127.0.0.1:14550/udp`."""
        return BY_NAME[self.kind].words.format(where=self.where(), device=self.device, baud=self.baud)

    def where(self) -> str:
        """HOST:PORT, as `host_port` writes it."""
        return host_port(self.host, self.port)


def host_port(host: str, port: int) -> str:
    """`127.0.0.1:14550`, `[::1]:14550`."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def help_text() -> str:
    """The forms that a CONNECTION takes, one kind a line and its forms below it."""
    return "\n".join(f"  {kind.example:<30}{kind.description}\n  {'':<30}{kind.forms}" for kind in KINDS)


def parse(text: str, baud: int | None = None) -> Url:
    """What `text` means; `baud` (bits per second) is for serial devices that name none.

    Raises UsageError, one line that says what is wrong and what to write instead.
    """
    scheme = _SCHEME.fullmatch(text)
    kind = _BY_SCHEME.get(scheme[1].lower()) if scheme else None
    if scheme and kind:
        return _serial(text, scheme[2], baud) if kind.name == "serial" else _network(text, kind, scheme[2])
    if os.path.isfile(text) or text.lower().endswith(".tlog"):
        return Url("log", "", 0, text, 0, text)
    if text.startswith("/dev/") or _is_device(text):
        return _serial(text, text, baud)
    if _BARE_HOST_PORT.fullmatch(text):
        return _network(text, BY_NAME["udpout"], text)
    return _explain(text, scheme[1] if scheme else None)


def _explain(text: str, scheme: str | None) -> NoReturn:
    """The one line about a text that fits no row of the table."""
    if scheme and (near := difflib.get_close_matches(scheme.lower(), _BY_SCHEME, 1)):
        raise UsageError(f"{text!r}: there is no {scheme}: connection; did you mean {near[0]}: ?")
    if _ADDRESS.fullmatch(text):
        raise UsageError(f"{text!r} has no port; write {text}:14550 to send there, or udp:{text}:14550 to listen")
    if os.path.isdir(text):
        raise UsageError(f"{text!r} is a folder; write the path of a recorded .tlog or of a serial device")
    if "/" in text and not scheme:
        raise UsageError(f"{text!r}: there is no such file; write the path of a recorded .tlog or of a serial device")
    raise UsageError(f"{text!r} is neither a connection nor a file that exists; write for example {_SOME}")


def _network(text: str, kind: Kind, rest: str) -> Url:
    """HOST:PORT, of which a listener may leave the host away (every address of this machine)."""
    if "@" in rest:
        _explain_mavros(text, kind, rest)
    found = _HOST_PORT.fullmatch(rest.rstrip("/"))
    if found is None:
        if rest.count(":") > 1 and "[" not in rest:
            raise UsageError(f"{text!r}: write an IPv6 address in brackets, {kind.schemes[0]}:[::1]:14550")
        problem = "has no port" if _ADDRESS.fullmatch(rest) or not rest else "is not HOST:PORT"
        raise UsageError(f"{text!r} {problem}; write for example {_with_port(kind, rest)}")
    host, port = found[1] or found[2], found[3]
    if not host and kind.name not in LISTENERS:
        raise UsageError(f"{text!r} has no host; write for example {kind.example}")
    if not port:
        raise UsageError(f"{text!r} has no port; write for example {_with_port(kind, host)}")
    return Url(kind.name, host or "0.0.0.0", _port(text, kind, port), "", 0, text)


def _with_port(kind: Kind, host: str) -> str:
    """What to write where the port is missing: the person's own address if it is one, else the example."""
    port = kind.example.rpartition(":")[2]
    return f"{kind.schemes[0]}:{host}:{port}" if _ADDRESS.fullmatch(host) else kind.example


def _port(text: str, kind: Kind, digits: str) -> int:
    """1-65535. Port 0 (whatever is free) is for listeners only, and for tests: nobody could know where to send."""
    port = int(digits[:6])
    if not (0 < port <= 65535 or (port == 0 and kind.name in LISTENERS)):
        raise UsageError(f"{text!r}: a port is 1 to 65535, not {digits[:12]}; write for example {kind.example}")
    return port


def _explain_mavros(text: str, kind: Kind, rest: str) -> NoReturn:
    """MAVROS names both ends in one string; here it is one end a connection."""
    found = _MAVROS.fullmatch(rest)
    port, remote = (found[1] or "14550", found[2]) if found else ("14550", "")
    remote = remote if _BARE_HOST_PORT.fullmatch(remote) else "192.168.1.20:14550"
    advice = f"udp:0.0.0.0:{port} to listen, or udpout:{remote} to send" if kind.name == "udpin" else kind.example
    raise UsageError(f"{text!r} is MAVROS's form, with '@'; write {advice}")


def _serial(text: str, rest: str, baud: int | None) -> Url:
    """DEVICE, DEVICE,BAUD or DEVICE:BAUD; if the whole text is a device that exists, it is that one."""
    found = None if os.path.exists(rest) else _DEVICE_BAUD.fullmatch(rest)
    device, digits = (found[1], found[2] if found[2] is not None else found[3]) if found else (rest, None)
    if not device.startswith(("/", ".")):
        raise UsageError(f"{text!r} names no device; write for example {BY_NAME['serial'].example}")
    if digits is None:
        return Url("serial", "", 0, device, baud or DEFAULT_BAUD, text)
    if not re.fullmatch(r"[0-9]{1,8}", digits) or int(digits) == 0:
        raise UsageError(f"{text!r}: the baud rate must be a number; write for example {BY_NAME['serial'].example}")
    return Url("serial", "", 0, device, int(digits), text)


def _is_device(text: str) -> bool:
    """Whether a path outside /dev (a link to a terminal, as socat makes them) leads to a character device."""
    try:
        return stat.S_ISCHR(os.stat(_DEVICE_BAUD.fullmatch(text)[1]).st_mode)  # type: ignore[index]  # matches any text
    except (OSError, ValueError):
        return False
