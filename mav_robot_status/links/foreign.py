"""Texts that people know from elsewhere and that are not connections: what each is, and what to write instead."""

from __future__ import annotations

import re
from typing import Final

_BEHIND: Final = re.compile(r"[A-Za-z][\w+-]*:(?://)?(.*?)/?", re.ASCII | re.DOTALL)
_PLACE: Final = re.compile(r"(?:\[[0-9A-Fa-f:.]+\]|[\w.-]*):[0-9]+", re.ASCII)

_MAVROS: Final = "is MAVROS's form"
_BROKER: Final = "is an MQTT broker, which is an output; write --mqtt {text}"
_WEB: Final = "is a web address, not a source of MAVLink; to serve a web page write --http 127.0.0.1:8765"
_ROS2: Final = "is an output for ROS 2; write --ros2 {text}"
_ARM: Final = "is an arm, not a source of MAVLink; write --arm {text}"
_FILE: Final = "is a file; write its path alone: {rest}"

WORDS: Final = {
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
"""By scheme. `place` is the HOST:PORT after the scheme, or an example; `rest` is everything after the scheme."""


def what_it_is(text: str, scheme: str) -> str:
    """What a text with a scheme of the table is, and what to write."""
    found = _BEHIND.fullmatch(text)
    rest = found[1] if found else ""
    place = rest if _PLACE.fullmatch(rest) else "0.0.0.0:5760"
    return f"{text!r} {WORDS[scheme].format(text=text, rest=rest, place=place)}"
