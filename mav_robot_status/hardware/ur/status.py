"""The values of a UR controller as a RobotStatus: one pure function for each field.

Sources: Universal Robots, "RTDE Guide" (bits of robot_status_bits and safety_status_bits, robot_mode); the fields as in
Universal Robots' ROS driver, which leaves in_motion unknown and error_code 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from ...interface import (
    Detail,
    ErrorCause,
    Evidence,
    Inhibit,
    RobotMode,
    RobotStatus,
    TriState,
    Vehicle,
)
from ..join import Logic, join
from ..tcp_arm import Values

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

NAMES: Final = ("robot_mode", "robot_status_bits", "safety_status_bits", "actual_qd", "safety_status")
"""The values that a status needs."""

POWER_ON, TEACH_BUTTON = 1 << 0, 1 << 2
"""robot_status_bits."""
NORMAL, REDUCED = 1 << 0, 1 << 1
PROTECTIVE, SAFEGUARD, SYSTEM_ESTOP, ROBOT_ESTOP, ESTOP, VIOLATION, FAULT, STOPPED = (
    1 << bit for bit in (2, 4, 5, 6, 7, 8, 9, 10)
)
"""safety_status_bits."""
EMERGENCY: Final = SYSTEM_ESTOP | ROBOT_ESTOP | ESTOP
NO_MOTION: Final = PROTECTIVE | SAFEGUARD | EMERGENCY | VIOLATION | FAULT | STOPPED
MEANINGFUL: Final = (1 << 12) - 1
"""The bits of safety_status_bits that have a meaning. If none is set, it says nothing."""

MAY_MOVE: Final = frozenset({1, 2})
"""safety_status: NORMAL, REDUCED."""
EMERGENCY_STOPS: Final = frozenset({6, 7})
"""safety_status: SYSTEM_EMERGENCY_STOP, ROBOT_EMERGENCY_STOP."""

MODES: Final = {
    -1: "NO_CONTROLLER",
    0: "DISCONNECTED",
    1: "CONFIRM_SAFETY",
    2: "BOOTING",
    3: "POWER_OFF",
    4: "POWER_ON",
    5: "IDLE",
    6: "BACKDRIVE",
    7: "RUNNING",
    8: "UPDATING_FIRMWARE",
}
"""robot_mode."""
BACKDRIVE, RUNNING = 6, 7
UNPOWERED: Final = range(4)


class Stop(NamedTuple):
    """One row of the table of stops."""

    bits: int
    """Of safety_status_bits."""
    name: str
    text: str
    code: int = 0
    """The error code; 0: not an error."""
    beside: int = 0
    """Bits that explain it: if one of them is set, this stop is not listed."""


STOPS: Final = (
    Stop(EMERGENCY, "E_STOPPED", "emergency stop"),
    Stop(FAULT, "SAFETY_FAULT", "fault of the safety system", 8003),
    Stop(VIOLATION, "SAFETY_VIOLATION", "violation of a safety limit", 8002),
    Stop(PROTECTIVE, "PROTECTIVE_STOP", "protective stop", 8001),
    Stop(SAFEGUARD, "SAFEGUARD_STOP", "safeguard stop: the protected area is open"),
    Stop(STOPPED, "SAFETY_STOP", "stopped due to safety", 8004, beside=NO_MOTION & ~STOPPED),
)
"""The stops, the most important first. Each is an inhibit, and those with a code are errors."""

NOT_RUNNING: Final = {
    -1: ("NO_CONTROLLER", "no controller"),
    0: ("DISCONNECTED", "the arm is not connected to its controller"),
    1: ("CONFIRM_SAFETY", "a person must confirm the safety configuration"),
    2: ("BOOTING", "the controller is booting"),
    3: ("POWER_OFF", "the arm is switched off"),
    4: ("BRAKES_ENGAGED", "powered, the brakes are engaged"),
    5: ("BRAKES_ENGAGED", "idle, the brakes are engaged"),
    6: ("BACKDRIVE", "a person moves it by hand"),
    8: ("UPDATING_FIRMWARE", "the firmware is being updated"),
}
"""The inhibit for each robot_mode but RUNNING."""

FAST, SLOW = 0.01, 0.005
"""Joint speeds in rad/s above which it moves, and below which it stands."""
SUSTAIN_ON, SUSTAIN_OFF = 0.1, 0.5
"""Seconds."""

OPERATIONAL: Final = {"MANUAL": RobotMode.MANUAL, "AUTOMATIC": RobotMode.AUTO}
"""The answers of the dashboard server."""


class Sample(NamedTuple):
    """The values of one data frame. None: the controller does not know the name."""

    robot_mode: int | None = None
    robot_bits: int | None = None
    safety_bits: int | None = None
    joint_speeds: tuple[float, ...] | None = None
    """rad/s."""
    safety_status: int | None = None


def sample_of(values: Mapping[str, Any]) -> Sample:
    """The values of a data frame by their names in RTDE."""
    return Sample(*(values.get(name) for name in NAMES))


@dataclass(slots=True)
class Joints:
    """Whether the joints move: a record that each sample changes in place."""

    value: TriState = UNKNOWN
    fast_since: float | None = None
    slow_since: float | None = None

    def heard(self, speeds: tuple[float, ...] | None, now: float) -> TriState:
        """Process the joint speeds of one sample, rad/s."""
        if speeds is None or not all(map(math.isfinite, speeds)):
            self.value, self.fast_since, self.slow_since = UNKNOWN, None, None
            return self.value
        fastest = max(map(abs, speeds))
        self.fast_since = None if fastest <= FAST else now if self.fast_since is None else self.fast_since
        self.slow_since = None if fastest >= SLOW else now if self.slow_since is None else self.slow_since
        if self.fast_since is not None and now >= self.fast_since + SUSTAIN_ON:
            self.value = TRUE
        elif self.slow_since is not None and now >= self.slow_since + SUSTAIN_OFF:
            self.value = FALSE
        return self.value


class Context(NamedTuple):
    """What else a status depends on."""

    moving: TriState
    operational: str | None
    """The latest answer of the dashboard server; None: none, or too old."""
    assumed: RobotMode
    """The mode where the operational mode is not known."""
    firmware: str | None


def values_of(sample: Sample, context: Context, before: Detail, unix_us: int, at: float) -> Values:
    """The status of an arm. `before` is the previous detail; `at`: when the sample arrived, monotonic seconds."""
    mode, bits, safety = sample[:3]
    stops = [] if safety is None else [row for row in STOPS if safety & row.bits and not safety & row.beside]
    errors = tuple(
        ErrorCause(row.code, row.name, row.text, _since(row.name, before, unix_us)) for row in stops if row.code
    )
    possible = _motion_possible(sample)
    inhibits = () if possible is TRUE else tuple(_inhibits(sample, stops, before, unix_us))
    status = RobotStatus(
        mode=_mode(sample, context),
        e_stopped=_e_stopped(sample),
        drives_powered=_powered(mode, bits),
        motion_possible=possible,
        in_motion=context.moving,
        in_error=TriState.of(None if safety is None or not safety & MEANINGFUL else bool(errors)),
        error_code=errors[0].code if errors else 0,
    )
    state = None if mode is None else MODES.get(mode, str(mode))
    vehicle = Vehicle("UNIVERSAL_ROBOTS", "ARM", context.operational, None, state, context.firmware)
    return Values(status, Detail(errors=errors, inhibits=inhibits, vehicle=vehicle), _evidence(sample, context, at))


def _mode(sample: Sample, context: Context) -> RobotMode:
    if sample.robot_mode == BACKDRIVE or (sample.robot_bits is not None and sample.robot_bits & TEACH_BUTTON):
        return RobotMode.MANUAL
    return OPERATIONAL.get(context.operational or "", context.assumed)


def _e_stopped(sample: Sample) -> TriState:
    """FALSE only if the bits say something, and safety_status names no emergency stop beside them."""
    safety = sample.safety_bits
    if safety is None or not safety & MEANINGFUL:
        return UNKNOWN
    if safety & EMERGENCY:
        return TRUE
    return UNKNOWN if sample.safety_status in EMERGENCY_STOPS else FALSE


def _powered(mode: int | None, bits: int | None) -> TriState:
    """UNKNOWN if robot_mode says that there is no power, and the bit that there is."""
    if mode in UNPOWERED:
        return UNKNOWN if bits is not None and bits & POWER_ON else FALSE
    return TriState.of(None if bits is None else bool(bits & POWER_ON))


def _motion_possible(sample: Sample) -> TriState:
    """FALSE beats UNKNOWN: without power, with a stop, or in another mode it cannot move."""
    mode, bits = sample.robot_mode, sample.robot_bits
    reasons = (
        TriState.of(None if mode is None else mode == RUNNING),
        _safe(sample),
        TriState.of(None if bits is None else bool(bits & POWER_ON)),
    )
    return join(Logic.ALL, reasons)


def _safe(sample: Sample) -> TriState:
    """Whether the safety system lets it move: it must say so, and contradict itself nowhere."""
    safety, status = sample.safety_bits, sample.safety_status
    if safety is None:
        return UNKNOWN
    if safety & NO_MOTION:
        return FALSE
    agrees = status is None or status in MAY_MOVE
    return TRUE if agrees and safety & (NORMAL | REDUCED) else UNKNOWN


def _inhibits(sample: Sample, stops: list[Stop], before: Detail, unix_us: int) -> list[Inhibit]:
    named = {row.name: row.text for row in stops}
    if sample.robot_mode is not None and sample.robot_mode != RUNNING:
        name, text = NOT_RUNNING.get(sample.robot_mode, ("NOT_RUNNING", f"robot_mode {sample.robot_mode}"))
        named[name] = text
    elif sample.robot_bits is not None and not sample.robot_bits & POWER_ON:
        named["POWER_OFF"] = "the arm has no power"
    return [Inhibit(name, text, _since(name, before, unix_us)) for name, text in named.items()]


def _since(name: str, before: Detail, unix_us: int) -> int:
    known: list[ErrorCause | Inhibit] = [*before.errors, *before.inhibits]
    return next((one.since_us for one in known if one.name == name), unix_us)


def _evidence(sample: Sample, context: Context, at: float) -> dict[str, Evidence]:
    mode, bits, safety = sample[:3]
    in_mode = None if mode is None else f"robot_mode {mode} ({MODES.get(mode, 'unknown')})"
    in_safety = None if safety is None else f"safety_status_bits 0x{safety:03x}"
    if in_safety is not None and sample.safety_status is not None:
        in_safety += f", safety_status {sample.safety_status}"
    in_bits = None if bits is None else f"robot_status_bits 0x{bits:x}"
    asked = None if context.operational is None else f"operational mode {context.operational}"
    return {
        "mode": Evidence("teach button, backdrive, else the operational mode of the dashboard", asked or in_bits, at),
        "e_stopped": Evidence("emergency stop bits, and no other safety_status beside them", in_safety, at),
        "drives_powered": Evidence("the power bit; up to POWER_OFF there is no power", in_bits or in_mode, at),
        "motion_possible": Evidence("RUNNING, powered, NORMAL or REDUCED, no stop", in_mode or in_safety, at),
        "in_motion": Evidence("joint speeds, with hysteresis", "actual_qd", at),
        "in_error": Evidence("protective stop, violation, fault, unexplained safety stop", in_safety, at),
    }
