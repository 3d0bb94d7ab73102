"""What an autopilot says of itself: CURRENT_MODE, AVAILABLE_MODES, AUTOPILOT_VERSION."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink.decode import text
from ...mavlink.definitions import AutopilotVersion, AvailableModes, CurrentMode
from ..flight_mode import AvailableMode
from ..observation import heard

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions

MOST_MODES: Final = 256


def current_mode(memory: Memory, message: CurrentMode, now: Instant, options: HardwareOptions) -> None:
    """CURRENT_MODE: the standard mode that is flown."""
    seen = memory.observation
    seen.current_mode = heard(message, now.mono, seen.current_mode)


def available_modes(memory: Memory, message: AvailableModes, now: Instant, options: HardwareOptions) -> None:
    """AVAILABLE_MODES: one entry of the autopilot's list, with its name."""
    if message.custom_mode not in memory.modes and len(memory.modes) >= MOST_MODES:
        return
    name = text(message.mode_name)
    mode = AvailableMode(name, message.standard_mode, message.properties)
    memory.modes = {**memory.modes, message.custom_mode: mode}


def autopilot_version(memory: Memory, message: AutopilotVersion, now: Instant, options: HardwareOptions) -> None:
    """AUTOPILOT_VERSION: the version of the software, which a build without a tag leaves at zero."""
    version = message.flight_sw_version >> 16
    if version:
        memory.version = version >> 8, version & 0xFF
