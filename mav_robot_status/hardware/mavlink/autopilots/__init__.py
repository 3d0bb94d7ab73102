"""The known autopilots: one row and one file for each. `profile.py` defines the contents of a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from . import ardupilot, px4
from .ardupilot import ARDUPILOT
from .generic import GENERIC
from .inav import INAV
from .paparazzi import PAPARAZZI
from .profile import Autopilot
from .px4 import PX4

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["ARDUPILOT", "AUTOPILOTS", "GENERIC", "INAV", "PX4", "Autopilot", "announced_as", "mode_numbers", "shown_by"]

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


def mode_numbers(key: str) -> Mapping[str, int]:
    """The custom_mode of each mode name, for a key of `mode_overrides`; empty if that key has no table of modes.

    The names are those of `vehicle.flight_mode`. Where a table gives two numbers one name, the lower number has it.
    """
    if key == "px4":
        main = {name: number << 16 for number, (name, _) in px4.MAIN.items()}
        return main | {name: number << 16 | sub << 24 for (number, sub), (name, _) in px4.SUB.items()}
    table = next((table for family, table in ardupilot.MODES.items() if family.value == key), {})
    return {name: number for number, (name, _) in sorted(table.items(), reverse=True)}
