"""Connection strings: the forms of pymavlink, MAVSDK and mavlink-router, and those of kinds from other packages."""

from __future__ import annotations

import os
import re
import stat
from typing import Final, NoReturn

from mav_robot_status.errors import UsageError
from mav_robot_status.links import kinds
from mav_robot_status.links.forms import ADDRESS, BARE_HOST_PORT, DEVICE_BAUD, FROM, refuse_from
from mav_robot_status.links.kind import Url, host_port
from mav_robot_status.links.kinds import BY_SCHEME, KINDS, LOG, SERIAL, UDP_LISTENER, UDP_SENDER

__all__ = ["KINDS", "Url", "help_text", "host_port", "parse"]

_SCHEME = re.compile(r"([A-Za-z][\w+-]*):(?://)?(.*)", re.ASCII | re.DOTALL)
_PORT_ALONE = re.compile(r":[0-9]+", re.ASCII)
_GLUED = re.compile(r"([A-Za-z]+)([0-9]+(?:\.[0-9]+){3})", re.ASCII)
LOG_NAMES = tuple(name + packed for name in (".tlog", ".bin", ".ulg", ".log") for packed in ("", ".gz", ".xz"))
"""A connection that ends so is a recorded log, even if the file is missing."""
NEARLY = 0.86
"""A host that is more similar to a scheme than this (1: equal) is taken for a misspelt scheme."""
_BEHIND: Final = re.compile(r"[A-Za-z][\w+-]*:(?://)?(.*?)/?", re.ASCII | re.DOTALL)
_PLACE: Final = re.compile(r"(?:\[[0-9A-Fa-f:.]+\]|[\w.-]*):[0-9]+", re.ASCII)

_MAVROS: Final = "is MAVROS's form"
_BROKER: Final = "is an MQTT broker, which is an output; write --mqtt {text}"
_WEB: Final = "is a web address, not a source of MAVLink; to serve a web page write --http 127.0.0.1:8765"
_ROS2: Final = "is an output for ROS 2; write --ros2 {text}"
_ARM: Final = "is an arm, not a source of MAVLink; write --arm {text}"
_FILE: Final = "is a file; write its path alone: {rest}"

FOREIGN: Final = {
    "tcp-l": f"{_MAVROS}; write tcpin:{{place}}",
    "udp-b": f"{_MAVROS}; write udpbcast:192.168.1.255:14550",
    "udp-pb": f"{_MAVROS}; write udpbcast:192.168.1.255:14550",
    "serial-hwfc": f"{_MAVROS}, and flow control is not used; write serial:{{rest}}",
    "mqtt": _BROKER,
    "mqtts": _BROKER,
    "http": _WEB,
    "https": _WEB,
    "ws": _WEB,
    "wss": _WEB,
    "zenoh": _ROS2,
    "dds": _ROS2,
    "ur": _ARM,
    "simple_message": _ARM,
    "file": _FILE,
    "tlogreader": _FILE,
}
"""Texts that people know from elsewhere and that are not connections, by scheme: what each is, and what to write.
`place` is the HOST:PORT after the scheme, or an example; `rest` is everything after the scheme."""
_EXAMPLES = ", ".join(kind.example for kind in (UDP_LISTENER, SERIAL, LOG))


def help_text() -> str:
    """The forms of a CONNECTION: one line for each kind, and its forms below it."""
    rows = kinds.every_kind()
    return "\n".join(f"  {kind.example:<30}{kind.description}\n  {'':<30}{kind.forms}" for kind in rows)


def parse(text: str, baud: int | None = None) -> Url:
    """What `text` means; `baud` (bits per second) applies to a serial device whose text has no rate.

    Raises UsageError, one line that says what is wrong and what to write instead.
    """
    found = _SCHEME.fullmatch(text)
    scheme, rest = (found[1].lower(), found[2]) if found else ("", text)
    kind = BY_SCHEME.get(scheme)
    if kind is None and scheme in FOREIGN and not (os.path.exists(text) or BARE_HOST_PORT.fullmatch(text)):
        kind = kinds.installed(scheme)
        if kind is None:
            raise UsageError(_what_it_is(text, scheme))
    if kind is None:
        if os.path.isfile(text) or text.lower().endswith(LOG_NAMES):
            return LOG.url(text, text, baud)
        if text.startswith("/dev/") or _is_device(text):
            return SERIAL.url(text, text, baud)
        kind = kinds.installed(scheme) if scheme else None
    if kind is not None:
        return kind.url(text, rest, baud)
    place = text.partition("?")[0]
    if _PORT_ALONE.fullmatch(place):
        return UDP_LISTENER.url(text, text, baud)
    if BARE_HOST_PORT.fullmatch(place):
        _doubt_host(place)
        return UDP_SENDER.url(text, text, baud)
    return _refuse(text, scheme)


def _doubt_host(text: str) -> None:
    """Raise UsageError for a HOST:PORT whose host looks like a misspelt scheme: `upd:14550`, `udpin127.0.0.1:14550`."""
    host, _, port = text.rpartition(":")
    found = _GLUED.fullmatch(host)
    if found is not None and found[1].lower() in BY_SCHEME:
        raise UsageError(f"{text!r}: a colon is missing; write {found[1]}:{found[2]}:{port}")
    if host.isalpha() and (near := next((one for one in BY_SCHEME if _is_misspelt(host.lower(), one)), None)):
        raise UsageError(
            f"{text!r}: unknown connection type {host}:; did you mean {near}: ? For a host write udpout:{text}"
        )


def _is_misspelt(word: str, scheme: str) -> bool:
    """Whether letters are exchanged, or one letter is wrong at the end of a long word."""
    from difflib import SequenceMatcher  # only a form that is not taken needs it

    return sorted(word) == sorted(scheme) or SequenceMatcher(None, word, scheme).ratio() > NEARLY


def _refuse(text: str, scheme: str) -> NoReturn:
    """Raise UsageError for a text that is not a connection string."""
    import difflib  # only for this message

    if FROM in text and not scheme:
        refuse_from(text, text.partition(FROM)[0], LOG)
    if scheme and (near := difflib.get_close_matches(scheme, kinds.schemes(), 1)):
        written = text[: len(scheme)]
        raise UsageError(f"{text!r}: unknown connection type {written}:; did you mean {near[0]}: ?")
    if text.isascii() and text.isdigit():
        raise UsageError(f"{text!r} is a port; write udp:{text} to listen there, or HOST:{text} to send")
    if ADDRESS.fullmatch(text):
        raise UsageError(f"{text!r} has no port; write {text}:14550 to send there, or udp:{text}:14550 to listen")
    if os.path.isdir(text):
        raise UsageError(f"{text!r} is a folder; write the path of a recorded .tlog or of a serial device")
    if "/" in text and not scheme:
        raise UsageError(f"{text!r}: no such file; write the path of a recorded .tlog or of a serial device")
    raise UsageError(f"{text!r} is neither a connection nor a file that exists; write for example {_EXAMPLES}")


def _is_device(text: str) -> bool:
    """Whether a path outside /dev (a link to a terminal, as socat makes them) leads to a character device."""
    try:
        return stat.S_ISCHR(os.stat(DEVICE_BAUD.fullmatch(text)[1]).st_mode)  # type: ignore[index]  # matches any text
    except (OSError, ValueError):
        return False


def _what_it_is(text: str, scheme: str) -> str:
    """What a text with a scheme of the table is, and what to write."""
    found = _BEHIND.fullmatch(text)
    rest = found[1] if found else ""
    place = rest if _PLACE.fullmatch(rest) else "0.0.0.0:5760"
    return f"{text!r} {FOREIGN[scheme].format(text=text, rest=rest, place=place)}"
