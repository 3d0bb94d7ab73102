"""What a scenario is: data that says what a vehicle does when. See `scenarios` for those that come along."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from .firmware import Firmware

PREARM_CHECK = 1 << 28
MOTOR_OUTPUTS = 1 << 15
RC_RECEIVER = 1 << 16
AHRS = 1 << 21
GPS = 1 << 5


class VehicleState(NamedTuple):
    """What is the case inside the vehicle. `firmware` turns it into what that firmware says on the wire."""

    custom_mode: int = 0
    armed: bool = False
    prearm: str = ""
    """Why the vehicle cannot be armed, in the firmware's words without prefix; empty if it can."""
    failsafe: bool = False
    """Any failsafe is active: HEARTBEAT.system_status becomes CRITICAL."""
    emergency_stop: bool = False
    """The motors are held at their stop value. ArduPilot: RC or aux e-stop, no bit shows it; PX4: kill, state 8."""
    safety_switch: bool = False
    """ArduPilot's hardware safety switch is on: MOTOR_OUTPUTS is present but not enabled."""
    initialised: bool = True
    """ArduPilot sends no SYS_STATUS before."""
    sensors_present: int = 0
    sensors_enabled: int = 0
    sensors_health: int = 0
    """SYS_STATUS masks. PREARM_CHECK and MOTOR_OUTPUTS follow from the fields above."""
    errors_count1: int = 0
    landed_state: int = 0
    """MAV_LANDED_STATE: 0 undefined, 1 on the ground, 2 in the air, 3 taking off, 4 landing."""
    vtol_state: int | None = None
    """MAV_VTOL_STATE: 1 and 2 in transition, 3 hovering, 4 on its wings; None: as the firmware says it."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """North, east, down in m/s."""
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw rate in rad/s."""
    throttle: int = 0
    """VFR_HUD.throttle in percent; the motor outputs follow it."""
    servos: tuple[int, ...] | None = None
    """SERVO_OUTPUT_RAW in microseconds; None: as the firmware makes them of throttle, armed and emergency_stop."""
    position: bool = True
    """False: no GPS fix yet, so that latitude and longitude are 0."""
    base_mode: int | None = None
    system_status: int | None = None
    """HEARTBEAT fields; None: as the firmware derives them."""


class Text(NamedTuple):
    """One STATUSTEXT; longer than 50 characters goes out in chunks."""

    severity: int
    text: str


class Action(Enum):
    """What happens to the link or to the autopilot as a whole."""

    SILENCE = "silence"
    """The link is cut: nothing is sent or heard any more, while the vehicle goes on."""
    RESUME = "resume"
    """The link is back."""
    REBOOT = "reboot"
    """The autopilot starts again: a gap of 1.2 s, time_boot_ms and sequence from 0, requested streams forgotten."""
    END = "end"
    """The scenario is over: nothing is sent any more."""


class Step(NamedTuple):
    """What changes at one moment."""

    at: float
    """Seconds since the start of the scenario."""
    note: str
    """One line for a person who watches: what happens and why."""
    changes: Mapping[str, Any]
    """Fields of `VehicleState` and their new values."""
    texts: tuple[Text, ...] = ()
    action: Action | None = None


class Scenario(NamedTuple):
    """A vehicle and its story."""

    title: str
    firmware: Firmware
    start: VehicleState
    steps: tuple[Step, ...] = ()
    streams: Mapping[int, float] | None = None
    """Message id to Hz: what flows without being asked for; None: the firmware's own defaults."""

    @property
    def duration(self) -> float:
        """Seconds until the last step."""
        return max((step.at for step in self.steps), default=0.0)


def step(at: float, note: str, *texts: tuple[int, str], action: Action | None = None, **changes: Any) -> Step:
    """A `Step` in short: texts as (severity, text), changes as keywords.

    Raises ValueError (TypeError from Python 3.13) for an unknown field.
    """
    VehicleState()._replace(**changes)
    return Step(at, note, changes, tuple(Text(*text) for text in texts), action)


def shifted(seconds: float, steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The same steps, `seconds` later."""
    return tuple(s._replace(at=s.at + seconds) for s in steps)
