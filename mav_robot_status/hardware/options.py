"""What a site can say about its vehicles: the section `hardware` of the configuration, with its defaults.

The annotations are the schema from which the configuration is read and checked: a new option is one line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal, NamedTuple

from ..interface import RobotMode
from ..mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES


class Within(NamedTuple):
    """The range of a number, both ends included, and its unit. A number in `s` may also be written `10 ms`."""

    low: float
    high: float
    unit: str = ""


class OneOf(NamedTuple):
    """The texts that a text may be."""

    names: tuple[str, ...]


Timeout = Annotated[float, Within(0.1, 3600.0, "s")]
Hold = Annotated[float, Within(0.0, 3600.0, "s")]
Speed = Annotated[float, Within(0.0, 100.0, "m/s")]
CustomMode = Annotated[int, Within(0, 2**32 - 1)]
Family = Literal["copter", "plane", "rover", "sub", "tracker", "blimp", "px4", "other"]
Sensor = Annotated[str, OneOf((*SENSOR_NAMES.values(), *EXTENDED_SENSOR_NAMES.values()))]

BELOW: Final = {"v_off": "v_on", "v_off_disarmed": "v_on_disarmed"}
"""Options that must be smaller than another one: a hysteresis without width would flicker."""


@dataclass(frozen=True, slots=True)
class HardwareOptions:
    """How what is heard from a vehicle becomes a status."""

    heartbeat_timeout: Timeout = 3.5
    """Seconds without a HEARTBEAT after which the link counts as lost."""
    sys_status_timeout: Timeout = 5.0
    """Seconds for which a SYS_STATUS is believed."""
    hover_is_motion: bool = True
    """A copter that keeps its place in the air is in motion: it is a hazard, though it goes nowhere."""
    manual_blocks_motion: bool = False
    """Motion is not possible in a manual mode (Motoman's reading of the field)."""
    estop_unknown_as: Literal["unknown", "false"] = "unknown"
    """What to say of e_stopped where the vehicle does not tell."""
    estop_assume_visible: bool = False
    """This site's only emergency stop announces itself by texts: no text since arming means not stopped."""
    watch_outputs: bool = True
    """Conclude from the motor outputs whether an armed vehicle is held by an emergency stop."""
    link_loss_is_error: bool = False
    """A lost link is an error (9001) instead of an unknown."""
    treat_hil_as_live: bool = False
    """Take a hardware-in-the-loop simulation for the real thing."""
    text_hold_s: Hold = 10.0
    """Seconds for which an error lasts that only a text told of."""
    v_on: Speed = 0.30
    """Armed: motion begins above this speed, m/s."""
    v_off: Speed = 0.15
    """Armed: motion ends below this speed, m/s."""
    v_on_disarmed: Speed = 0.50
    """Disarmed: motion begins above this speed, m/s; more than armed, because of the noise of GPS."""
    v_off_disarmed: Speed = 0.30
    """Disarmed: motion ends below this speed, m/s."""
    mode_overrides: Mapping[Family, Mapping[CustomMode, RobotMode]] = field(default_factory=dict)
    """By vehicle family and custom_mode: the mode to report instead of the one in the tables."""
    ignore_sensors: frozenset[Sensor] = frozenset()
    """Sensors whose faults are known here and are not errors."""
    request_events: bool = False
    """Ask PX4 again for events that were lost on the way."""
