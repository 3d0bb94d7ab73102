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
    from ....clock import Instant
    from ..state.vehicle_state import VehicleState

TIMEOUT: Final = 1.5
"""FS_TIMEOUT, seconds: a lost radio is unhealthy in every SYS_STATUS of this time before the text."""


def _names_either(state: VehicleState, text: str | None) -> bool:
    """Whether a text about a lost radio or ground station may name the wrong one."""
    pattern = state.profile.texts.failsafe_is_any.get(state.family)
    return pattern is not None and text is not None and pattern.match(text) is not None


def _by_radio(state: VehicleState, now: float) -> int:
    """Which failsafe it is, by the radio in the latest SYS_STATUS."""
    heard = state.latest.sys_status
    if heard is not None:
        enabled = heard.message.onboard_control_sensors_enabled & sensors.RC_RECEIVER
        if enabled & ~heard.message.onboard_control_sensors_health:
            return causes.RC_LOST
        if enabled and now - heard.at <= TIMEOUT:
            return causes.GCS_LOST
    return causes.FAILSAFE


def announced(state: VehicleState, text: str, codes: tuple[int, ...], now: Instant) -> None:
    """Announce the causes `codes` of a text."""
    for code in (_by_radio(state, now.mono),) if _names_either(state, text) else codes:
        state.latches = latches.announce(state.latches, code, text, now)


def cleared(state: VehicleState, text: str, codes: tuple[int, ...], now: float) -> None:
    """End the causes that a text clears. It is believed at once: the state in the HEARTBEAT follows it."""
    if _names_either(state, text):
        codes = (causes.RC_LOST, causes.GCS_LOST, causes.FAILSAFE)
    before, after = state.latches, latches.clear(state.latches, codes)
    if len(after) < len(before) and not any(causes.CAUSES[code].clears is causes.Clears.FAILSAFE for code in after):
        state.failsafe_cleared = now
    state.latches = after


def radio_heard(state: VehicleState, now: float) -> None:
    """After a SYS_STATUS: it may tell which failsafe an earlier text was about."""
    for code in (causes.FAILSAFE, causes.GCS_LOST):
        latch = state.latches.get(code)
        if latch is None or not _names_either(state, latch.text):
            continue
        found = _by_radio(state, now)
        is_early = code == causes.FAILSAFE or now <= latch.since.mono + TIMEOUT
        if is_early and found not in (code, causes.FAILSAFE):
            state.latches = {**latches.clear(state.latches, (code,)), found: latch}
