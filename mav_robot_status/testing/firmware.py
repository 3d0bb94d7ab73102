"""The differences between firmwares as data, and how each reports its state; see `firmwares`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from .scenario import MOTOR_OUTPUTS, PREARM_CHECK, Step, VehicleState

ARMED = 128
ARDUPILOT, PX4 = 3, 12
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
UNINIT, BOOT, CALIBRATING, STANDBY, ACTIVE, CRITICAL, EMERGENCY, POWEROFF, FLIGHT_TERMINATION = range(9)
ON_GROUND, IN_AIR, TAKEOFF, LANDING = 1, 2, 3, 4
INITIALISING = 16


class Mode(NamedTuple):
    """One row of AVAILABLE_MODES."""

    custom_mode: int
    name: str
    standard_mode: int = 0
    """MAV_STANDARD_MODE; 0 non-standard."""
    properties: int = 0


class Firmware(NamedTuple):
    """One autopilot firmware in one kind of vehicle."""

    name: str
    type: int
    autopilot: int
    base_modes: Mapping[int, int]
    """HEARTBEAT.base_mode of each known custom_mode, without the ARMED bit."""
    status: Callable[[VehicleState], int]
    """HEARTBEAT.system_status."""
    outputs: Callable[[VehicleState], tuple[int, ...]]
    """SERVO_OUTPUT_RAW."""
    streams: Mapping[int, float]
    """Message id to Hz: the streams that run without a request."""
    refused: int
    """The MAV_RESULT of arming while the pre-arm checks fail."""
    prearm_prefix: str
    """Precedes the reason when the checks fail; empty: the firmware does not announce the reason."""
    arming_refused: str
    """The text that accompanies `refused`; {} becomes the reason."""
    armed_text: str
    """Empty: the firmware sends no text when it arms."""
    disarmed_text: str
    parameters: Mapping[str, int]
    vtol_state: int
    booting: VehicleState
    boot: tuple[Step, ...]
    """From `booting` to `ready`; the times count from the first heartbeat."""
    ready: VehicleState
    """Disarmed, all checks passed."""
    modes: tuple[Mode, ...] = ()
    """The rows of AVAILABLE_MODES; empty: the firmware does not support that message."""
    version: int = 0
    """AUTOPILOT_VERSION.flight_sw_version; 0: the firmware does not support that message."""
    on_request: frozenset[int] | None = None
    """The messages that a peer can request; None: all that the firmware sends."""


def base_mode(firmware: Firmware, state: VehicleState) -> int:
    """HEARTBEAT.base_mode; CUSTOM_MODE only, for a mode that is not in the table."""
    if state.base_mode is not None:
        return state.base_mode
    return firmware.base_modes.get(state.custom_mode, 1) | (ARMED if state.armed else 0)


def system_status(firmware: Firmware, state: VehicleState) -> int:
    """HEARTBEAT.system_status."""
    return firmware.status(state) if state.system_status is None else state.system_status


def sensors(firmware: Firmware, state: VehicleState, prearm_ok: bool) -> tuple[int, int, int]:
    """The masks of SYS_STATUS: present, enabled, health.

    ArduPilot sets PREARM_CHECK in all three, and in health also while armed; PX4 only in health; others never.
    """
    present, enabled = state.sensors_present, state.sensors_enabled
    healthy = prearm_ok or (state.armed and firmware.autopilot == ARDUPILOT)
    if state.safety_switch and firmware.autopilot == ARDUPILOT:
        enabled &= ~MOTOR_OUTPUTS
    reported = firmware.autopilot == PX4 or present & PREARM_CHECK
    return present, enabled, state.sensors_health & ~PREARM_CHECK | (PREARM_CHECK if healthy and reported else 0)


def not_armable(state: VehicleState) -> tuple[str, ...]:
    """Why the vehicle cannot be armed; empty if it can."""
    if state.emergency_stop:
        return ("Motors Emergency Stopped",)
    if state.safety_switch:
        return ("Hardware safety switch",)
    reasons = (state.prearm,) if isinstance(state.prearm, str) else state.prearm
    return tuple(reason for reason in reasons if reason)


def px4_mode(main: int, sub: int = 0) -> int:
    """PX4's custom_mode of a main and a sub mode."""
    return main << 16 | sub << 24
