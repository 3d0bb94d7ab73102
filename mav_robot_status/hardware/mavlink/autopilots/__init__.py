"""The known autopilots: one row and one file for each. `profile.py` defines the contents of a file."""

from __future__ import annotations

from typing import Final

from .ardupilot import ARDUPILOT
from .generic import GENERIC
from .inav import INAV
from .paparazzi import PAPARAZZI
from .profile import Autopilot
from .px4 import PX4

__all__ = ["ARDUPILOT", "AUTOPILOTS", "GENERIC", "INAV", "PX4", "Autopilot", "announced_as", "shown_by"]

AUTOPILOTS: Final[tuple[Autopilot, ...]] = (
    ARDUPILOT,
    PX4,
    INAV,
    PAPARAZZI,
    GENERIC,
)

_ANNOUNCED: Final = {
    number: autopilot
    for autopilot in AUTOPILOTS
    if autopilot.recognition.lacks is None
    for number in autopilot.recognition.autopilots
}
_POSING: Final[dict[int, tuple[int, Autopilot | None]]] = {
    number: (autopilot.recognition.lacks, autopilot)
    for autopilot in AUTOPILOTS
    if autopilot.recognition.lacks is not None
    for number in autopilot.recognition.autopilots
}


def announced_as(number: int) -> Autopilot:
    """The software that announces itself by this MAV_AUTOPILOT."""
    return _ANNOUNCED.get(number, GENERIC)


def shown_by(number: int, sensors_present: int) -> Autopilot | None:
    """The software that SYS_STATUS reveals if the autopilot announces another; None: the announced one is right."""
    lacks, autopilot = _POSING.get(number, (0, None))
    return None if sensors_present & lacks else autopilot
