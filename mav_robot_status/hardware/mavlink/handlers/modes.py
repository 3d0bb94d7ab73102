"""What an autopilot reports about itself: CURRENT_MODE, AVAILABLE_MODES, AUTOPILOT_VERSION."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....mavlink.decode import text
from ....mavlink.definitions import AutopilotVersion, AvailableModes, CurrentMode, MessageInterval
from ..autopilots import firmware
from ..autopilots.modes import AvailableMode
from ..state.latest_messages import heard
from ..state.vehicle_state import ToldFirmware

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState

MOST_MODES: Final = 256


def current_mode(state: VehicleState, message: CurrentMode, now: Instant, options: HardwareOptions) -> None:
    """CURRENT_MODE: the present standard mode."""
    seen = state.latest
    seen.current_mode = heard(seen, message, now.mono, seen.current_mode)


def available_modes(state: VehicleState, message: AvailableModes, now: Instant, options: HardwareOptions) -> None:
    """AVAILABLE_MODES: one entry of the autopilot's list, with its name."""
    if message.custom_mode not in state.modes and len(state.modes) >= MOST_MODES:
        return
    name = text(message.mode_name)
    mode = AvailableMode(name, message.standard_mode, message.properties)
    state.modes = {**state.modes, message.custom_mode: mode}


def autopilot_version(state: VehicleState, message: AutopilotVersion, now: Instant, options: HardwareOptions) -> None:
    """AUTOPILOT_VERSION: the version of the firmware."""
    version = firmware.of_number(message.flight_sw_version)
    if version is not None:
        state.firmware = ToldFirmware(version, now.mono, f"AUTOPILOT_VERSION {version}")


def message_interval(state: VehicleState, message: MessageInterval, now: Instant, options: HardwareOptions) -> None:
    """MESSAGE_INTERVAL answers a request and says nothing about the vehicle."""
