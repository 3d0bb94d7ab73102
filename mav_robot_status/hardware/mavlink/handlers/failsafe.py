"""Which failsafe a text is about, and what remains when a text ends one.

Source: ArduPilot, Rover/failsafe.cpp. `failsafe_trigger` is called for the radio and for the ground station in turn.
When the time-out of either has passed, it names the one that it is called for, whichever is lost. It reports the end
when both are back. SYS_STATUS shows the radio in versions that report RC_RECEIVER; Rover 4.5.6 does not (recorded).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .. import causes
from ..state import latches, sensors

if TYPE_CHECKING:
    from ..state.vehicle_state import VehicleState

EITHER: Final = frozenset({causes.RC_LOST, causes.GCS_LOST})
TIMEOUT: Final = 1.5
"""FS_TIMEOUT, seconds: a lost radio is unhealthy in every SYS_STATUS of this time before the text."""


def lost(state: VehicleState, codes: tuple[int, ...], now: float) -> tuple[int, ...]:
    """The causes that a text announces, if it names `codes`."""
    if len(codes) != 1 or codes[0] not in EITHER or state.family not in state.profile.texts.failsafe_is_any:
        return codes
    heard = state.latest.sys_status
    if heard is not None:
        enabled = heard.message.onboard_control_sensors_enabled & sensors.RC_RECEIVER
        if enabled & ~heard.message.onboard_control_sensors_health:
            return (causes.RC_LOST,)
        if enabled and now - heard.at <= TIMEOUT:
            return (causes.GCS_LOST,)
    return (causes.FAILSAFE,)


def cleared(state: VehicleState, codes: tuple[int, ...], now: float) -> None:
    """End the causes that a text clears. It is believed at once: the state in the HEARTBEAT follows it."""
    if EITHER.intersection(codes) and state.family in state.profile.texts.failsafe_is_any:
        codes = (*EITHER, causes.FAILSAFE)
    before, after = state.latches, latches.clear(state.latches, codes)
    if len(after) < len(before) and not any(causes.CAUSES[code].clears is causes.Clears.FAILSAFE for code in after):
        state.failsafe_cleared = now
    state.latches = after
