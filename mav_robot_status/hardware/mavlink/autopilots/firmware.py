"""The version of the autopilot's firmware, as it reports it: in AUTOPILOT_VERSION, or in the text of its boot.

Sources: common.xml, AUTOPILOT_VERSION.flight_sw_version (major, minor, patch, type; one byte each) and
FIRMWARE_VERSION_TYPE; ArduPilot's `GCS_MAVLINK::send_banner`, the text `ArduCopter V4.5.6 (hash)`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..identity import Family

STAGES: Final = ((64, "dev"), (128, "alpha"), (192, "beta"), (255, "rc"))
"""FIRMWARE_VERSION_TYPE: the stage of each type below the number. 255 is a release."""
BANNER: Final = re.compile(r"(\w+) V(\d{1,3})\.(\d{1,3})(?:\.(\d{1,3}))?(?:-?(dev|alpha|beta|rc)\w*)?(?![\w.])")


class Firmware(NamedTuple):
    """A version. It compares with a tuple of numbers: `firmware >= (4, 4)`."""

    major: int
    minor: int
    patch: int = 0
    stage: str = ""
    """`dev`, `alpha`, `beta` or `rc`; empty for a release."""

    def __str__(self) -> str:
        numbers = f"{self.major}.{self.minor}.{self.patch}"
        return f"{numbers}-{self.stage}" if self.stage else numbers


def of_number(flight_sw_version: int) -> Firmware | None:
    """The version in AUTOPILOT_VERSION; None for a build without one."""
    if not flight_sw_version >> 16:
        return None
    kind = flight_sw_version & 0xFF
    stage = next((name for below, name in STAGES if kind < below), "")
    return Firmware(
        flight_sw_version >> 24 & 0xFF, flight_sw_version >> 16 & 0xFF, flight_sw_version >> 8 & 0xFF, stage
    )


def of_text(text: str, names: Mapping[str, Family], family: Family) -> Firmware | None:
    """The version in the text of a boot; None in any other text, and in one that names another kind of vehicle."""
    found = BANNER.match(text)
    if found is None or names.get(found[1]) is not family:
        return None
    return Firmware(int(found[2]), int(found[3]), int(found[4] or 0), found[5] or "")
