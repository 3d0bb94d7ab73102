"""Scenarios as data: the actions of a vehicle and their times. See `scenarios` for the ready ones."""

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
HIGH_LATENCY2 = 235


class VehicleState(NamedTuple):
    """The state of a vehicle. `firmware` translates it to the messages of that firmware."""

    custom_mode: int = 0
    armed: bool = False
    prearm: str | tuple[str, ...] = ""
    """Why the vehicle cannot be armed: the firmware's text without prefix, or several texts; empty if it can."""
    failsafe: bool = False
    """Any failsafe is active: HEARTBEAT.system_status becomes CRITICAL."""
    emergency_stop: bool = False
    """The motors are held at their stop value. ArduPilot: RC or aux e-stop, not reported; PX4: kill, MAV_STATE 8."""
    safety_switch: bool = False
    """ArduPilot's hardware safety switch is on: MOTOR_OUTPUTS is present but not enabled."""
    initialised: bool = True
    """Before this, ArduPilot sends no SYS_STATUS."""
    sensors_present: int = 0
    sensors_enabled: int = 0
    sensors_health: int = 0
    """SYS_STATUS masks. PREARM_CHECK and MOTOR_OUTPUTS follow from the fields above."""
    errors_count1: int = 0
    landed_state: int = 0
    """MAV_LANDED_STATE: 0 undefined, 1 on the ground, 2 in the air, 3 taking off, 4 landing."""
    vtol_state: int | None = None
    """MAV_VTOL_STATE: 1 and 2 in transition, 3 hovering, 4 on its wings; None: the default of the firmware."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """North, east, down in m/s."""
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw rate in rad/s."""
    throttle: int = 0
    """VFR_HUD.throttle in percent; the motor outputs follow it."""
    servos: tuple[int, ...] | None = None
    """SERVO_OUTPUT_RAW in microseconds; None: computed from throttle, armed and emergency_stop."""
    position: bool = True
    """False: no GPS fix yet, so that latitude and longitude are 0."""
    applet: bool = False
    """ArduPilot's applet runs, which reports emergency_stop and safety_switch as NAMED_VALUE_FLOAT RS_STOP."""
    base_mode: int | None = None
    system_status: int | None = None
    """HEARTBEAT fields; None: computed by the firmware."""


class Text(NamedTuple):
    """One STATUSTEXT; more than 50 characters are sent in chunks."""

    severity: int
    text: str


class Action(Enum):
    """An event of the link or of the whole autopilot."""

    SILENCE = "silence"
    """The link is cut in both directions; the vehicle continues."""
    RESUME = "resume"
    """The link is back."""
    REBOOT = "reboot"
    """The autopilot restarts: silence for 1.2 s, then time_boot_ms and sequence from 0, and no requested streams."""
    END = "end"
    """The scenario ends: nothing more is sent."""


class Step(NamedTuple):
    """The changes at one time."""

    at: float
    """Seconds since the start of the scenario."""
    note: str
    """One line for the log: the event and its reason."""
    changes: Mapping[str, Any]
    """Fields of `VehicleState` and their new values."""
    texts: tuple[Text, ...] = ()
    action: Action | None = None


class Scenario(NamedTuple):
    """A vehicle and its steps."""

    title: str
    firmware: Firmware
    start: VehicleState
    steps: tuple[Step, ...] = ()
    streams: Mapping[int, float] | None = None
    """Message id to Hz: the streams that run without a request; None: the defaults of the firmware."""
    streams_after: float = 0.0
    """Seconds from the first heartbeat of a boot until these streams begin."""
    satellite: bool = False
    """The link is one for high latency: no HEARTBEAT, no texts, and HIGH_LATENCY2 among the streams."""
    repeats: float | None = None
    """Seconds after which the link sends each message once more; None: never."""

    @property
    def duration(self) -> float:
        """Seconds until the last step."""
        return max((step.at for step in self.steps), default=0.0)


def step(at: float, note: str, *texts: tuple[int, str], action: Action | None = None, **changes: Any) -> Step:
    """Build a `Step`, with texts as (severity, text) and changes as keywords.

    Raises ValueError (TypeError from Python 3.13) for an unknown field.
    """
    VehicleState()._replace(**changes)
    return Step(at, note, changes, tuple(Text(*text) for text in texts), action)


def with_applet(scenario: Scenario) -> Scenario:
    """The same scenario of an ArduPilot on which the applet runs."""
    return scenario._replace(title=f"with the applet: {scenario.title}", start=scenario.start._replace(applet=True))


def by_satellite(scenario: Scenario, hz: float) -> Scenario:
    """The same scenario of a vehicle that sends HIGH_LATENCY2 at this rate and nothing else."""
    streams = {HIGH_LATENCY2: hz}
    return scenario._replace(title=f"by satellite: {scenario.title}", streams=streams, satellite=True)


def shifted(seconds: float, steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The same steps, `seconds` later."""
    return tuple(s._replace(at=s.at + seconds) for s in steps)


def ending(scenario: Scenario, rest: float = 5.0) -> Scenario:
    """The same scenario with an end, `rest` seconds after its last step, so that it can be played in a loop."""
    if not scenario.steps or any(one.action is Action.END for one in scenario.steps):
        return scenario
    return scenario._replace(steps=(*scenario.steps, step(scenario.duration + rest, "the end", action=Action.END)))
