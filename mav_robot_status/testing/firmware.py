"""What differs between firmwares, as one row of data, and how a state is said on the wire; see `firmwares`."""

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
    """Message id to Hz: what flows without being asked for."""
    refused: int
    """MAV_RESULT of an arming that the checks do not allow."""
    prearm_prefix: str
    """Before the reason when the checks fail; empty: the firmware does not announce it by itself."""
    arming_refused: str
    """The text that goes with it; {} stands for the reason."""
    armed_text: str
    """Empty: it says nothing when it is armed or disarmed."""
    disarmed_text: str
    parameters: Mapping[str, int]
    vtol_state: int
    booting: VehicleState
    boot: tuple[Step, ...]
    """From `booting` to `ready`; the times count from the first heartbeat."""
    ready: VehicleState
    """Disarmed, all checks passed."""
    modes: tuple[Mode, ...] = ()
    """What it answers to a request for AVAILABLE_MODES; empty: it does not know that message."""
    on_request: frozenset[int] | None = None
    """The messages that it can be asked for; None: all that it has."""


def base_mode(firmware: Firmware, state: VehicleState) -> int:
    """HEARTBEAT.base_mode; a mode that is not in the table says CUSTOM_MODE only."""
    if state.base_mode is not None:
        return state.base_mode
    return firmware.base_modes.get(state.custom_mode, 1) | (ARMED if state.armed else 0)


def system_status(firmware: Firmware, state: VehicleState) -> int:
    """HEARTBEAT.system_status."""
    return firmware.status(state) if state.system_status is None else state.system_status


def sensors(firmware: Firmware, state: VehicleState, prearm_ok: bool) -> tuple[int, int, int]:
    """The masks of SYS_STATUS: present, enabled, health.

    ArduPilot says PREARM_CHECK in all three, healthy also while armed; PX4 only in health; others not at all.
    """
    present, enabled = state.sensors_present, state.sensors_enabled
    healthy = prearm_ok or (state.armed and firmware.autopilot == ARDUPILOT)
    if state.safety_switch and firmware.autopilot == ARDUPILOT:
        enabled &= ~MOTOR_OUTPUTS
    told = firmware.autopilot == PX4 or present & PREARM_CHECK
    return present, enabled, state.sensors_health & ~PREARM_CHECK | (PREARM_CHECK if healthy and told else 0)


def not_armable(state: VehicleState) -> str:
    """Why the vehicle cannot be armed; empty if it can."""
    if state.emergency_stop:
        return "Motors Emergency Stopped"
    return "Hardware safety switch" if state.safety_switch else state.prearm


def px4_mode(main: int, sub: int = 0) -> int:
    """PX4's custom_mode of a main and a sub mode."""
    return main << 16 | sub << 24
