"""The options of a site for its vehicles: the section `hardware` of the configuration, with its defaults.

The annotations are the schema from which the configuration is read and checked: a new option is one line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal, NamedTuple

from ...interface import RobotMode
from ...mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES


class Within(NamedTuple):
    """The range of a number, both ends included, and its unit. A number in `s` may also be written `10 ms`."""

    low: float
    high: float
    unit: str = ""


class OneOf(NamedTuple):
    """The allowed values of a text."""

    names: tuple[str, ...]


class Or(NamedTuple):
    """The word for None in a file."""

    word: str


Timeout = Annotated[float, Within(0.1, 3600.0, "s")]
Hold = Annotated[float, Within(0.0, 3600.0, "s")]
Speed = Annotated[float, Within(0.0, 100.0, "m/s")]
CustomMode = Annotated[int, Within(0, 2**32 - 1)]
ModeOverrides = Mapping[CustomMode, RobotMode]
"""A file may write the name of a mode instead of its number, see `autopilots.mode_numbers`."""
VehicleKey = Literal["copter", "plane", "rover", "sub", "tracker", "blimp", "px4", "other"]
Path = Annotated[str | None, Or("none")]
"""A file."""
Sensor = Annotated[str, OneOf((*SENSOR_NAMES.values(), *EXTENDED_SENSOR_NAMES.values()))]

BELOW: Final = {"v_off": "v_on", "v_off_disarmed": "v_on_disarmed"}
"""Options that must be smaller than another one: a hysteresis needs a width."""


@dataclass(frozen=True, slots=True)
class HardwareOptions:
    """How the messages of a vehicle become a status."""

    heartbeat_timeout: Timeout = 3.5
    """Seconds without news after which the link counts as lost, and age from which on a HEARTBEAT is late."""
    sys_status_timeout: Timeout = 5.0
    """Seconds for which a SYS_STATUS is valid."""
    hover_is_motion: bool = True
    """A hovering copter is in motion: it is a hazard although it does not change its position."""
    manual_blocks_motion: bool = False
    """Motion is not possible in a manual mode (Motoman's reading of the field)."""
    estop_unknown_as: Literal["unknown", "false"] = "unknown"
    """The value of e_stopped if the vehicle does not report it."""
    estop_assume_visible: bool = False
    """The only emergency stop of this site is announced by texts: no text since arming means not stopped."""
    watch_outputs: bool = True
    """Conclude from the motor outputs whether an armed vehicle is held by an emergency stop."""
    link_loss_is_error: bool = False
    """A lost link is an error (9001) instead of UNKNOWN."""
    treat_hil_as_live: bool = False
    """Treat a hardware-in-the-loop simulation as a real vehicle."""
    text_hold_s: Hold = 10.0
    """Seconds for which an error that only a text reported stays active."""
    v_on: Speed = 0.30
    """Armed: motion begins above this speed, m/s."""
    v_off: Speed = 0.15
    """Armed: motion ends below this speed, m/s."""
    v_on_disarmed: Speed = 0.50
    """Disarmed: motion begins above this speed, m/s; higher than when armed, because of GPS noise."""
    v_off_disarmed: Speed = 0.30
    """Disarmed: motion ends below this speed, m/s."""
    mode_overrides: Mapping[VehicleKey, ModeOverrides] = field(default_factory=dict)
    """By vehicle family and custom_mode: the mode to publish instead of the one in the tables."""
    ignore_sensors: frozenset[Sensor] = frozenset()
    """Sensors with known faults, which are not errors at this site."""
    request_events: bool = True
    """Request lost events from PX4 again."""
    px4_events: Path = None
    """The table of events of the PX4 firmware, all_events.json or all_events.json.xz. None: events without words."""
