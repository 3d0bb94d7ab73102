"""The options of the publisher `mcap`, and when a file ends."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final, NamedTuple

from ...errors import UsageError
from ...interface.options import Option, Options, short

NAME: Final = "mcap"
FORMATS: Final = ("json", "ros2")
UNITS: Final = {
    "s": (1e6, 0),
    "min": (6e7, 0),
    "h": (3.6e9, 0),
    "d": (8.64e10, 0),
    "kB": (0, 1e3),
    "MB": (0, 1e6),
    "GB": (0, 1e9),
}
"""What ends a file: microseconds and bytes of one unit."""
_SPLIT: Final = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)\s*([A-Za-z]+)", re.ASCII)


@dataclass(frozen=True)
class McapOptions(Options):
    """The options of the publisher `mcap`."""

    path: Annotated[str, Option("write statuses to an MCAP file, for Foxglove and rosbag tools", "--mcap", "FILE")]
    format: Annotated[str, Option("messages in the MCAP file (json)", "--mcap-format", choices=FORMATS)] = "json"
    split: Annotated[
        str | None, Option("begin another MCAP file after this much time or size", "--mcap-split", "1h|100MB")
    ] = None


class Limits(NamedTuple):
    """When a file ends; inf: never."""

    us: float = math.inf
    size: float = math.inf


def limits_of(text: str | None) -> Limits:
    """The limits that `1h` or `100MB` means. Raises UsageError for another text."""
    if text is None:
        return Limits()
    found = _SPLIT.fullmatch(text.strip())
    us, size = (float(found[1]) * one for one in UNITS.get(found[2], (0, 0))) if found else (0.0, 0.0)
    if not (us or size):
        units = ", ".join(UNITS)
        raise UsageError(f"{NAME}: split: {short(text)} is no time or size; write 1h or 100MB (units: {units})")
    return Limits(us or math.inf, size or math.inf)


def read(given: Mapping[str, object]) -> tuple[McapOptions, Limits]:
    """The options of a publisher's mapping. Raises UsageError for a wrong option."""
    options = McapOptions.read(NAME, given)
    return options, limits_of(options.split)
