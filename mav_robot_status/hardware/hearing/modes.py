"""CURRENT_MODE and AVAILABLE_MODES."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink.decode import text
from ...mavlink.definitions import AvailableModes, CurrentMode
from ..flight_mode import AvailableMode
from ..memory import observed
from ..observation import heard

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions

MOST_MODES: Final = 256


def current_mode(memory: Memory, message: CurrentMode, now: Instant, options: HardwareOptions) -> Memory:
    """CURRENT_MODE: the standard mode that is flown."""
    return observed(memory, current_mode=heard(message, now.mono, memory.observation.current_mode))


def available_modes(memory: Memory, message: AvailableModes, now: Instant, options: HardwareOptions) -> Memory:
    """AVAILABLE_MODES: one entry of the autopilot's list, with its name."""
    if message.custom_mode not in memory.modes and len(memory.modes) >= MOST_MODES:
        return memory
    name = text(message.mode_name)
    mode = AvailableMode(name, message.standard_mode, message.properties)
    return memory._replace(modes={**memory.modes, message.custom_mode: mode})
