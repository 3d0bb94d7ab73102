"""STATUSTEXT: what it reports, and when a report without repetition ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....mavlink.definitions import Statustext
from ....mavlink.enumerations import MAV_STATE_CRITICAL, MAV_STATE_FLIGHT_TERMINATION
from ..autopilots import firmware
from ..autopilots import texts as text_rules
from ..autopilots.profile import StopText
from ..autopilots.texts import UNCLASSIFIED, Effect, TextRule, When, classify
from ..estop import motor_test
from ..estop import state as estop
from ..readiness import state as readiness
from ..state import Statement, ToldFirmware, honours_stop, is_fresh
from . import causes, latches, sensors, text_assembly

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state import VehicleState


def pass_time(state: VehicleState, now: Instant, options: HardwareOptions) -> None:
    """End what has timed out at `now`: texts with missing chunks, reasons not to arm, and latches."""
    if state.texts:
        state.texts, overdue = text_assembly.overdue(state.texts, now.mono)
        for text in overdue:
            _said(state, text, now)
    if state.readiness is not readiness.NOTHING:
        state.readiness = readiness.passed(state.readiness, now.mono)
    if state.latches:
        state.latches = latches.lasting(
            state.latches, state.heartbeats, _error_bits(state, now.mono, options), now.mono, options.text_hold_s
        )


def _error_bits(state: VehicleState, now: float, options: HardwareOptions) -> frozenset[int]:
    """The bits of a fresh SYS_STATUS that are errors."""
    is_recent = is_fresh(state.latest.sys_status, now, options.sys_status_timeout)
    return state.error_bits(options) if is_recent else frozenset()


def statustext_(state: VehicleState, message: Statustext, now: Instant, options: HardwareOptions) -> None:
    """A STATUSTEXT, or a chunk of one."""
    pass_time(state, now, options)
    state.texts, finished = text_assembly.heard_chunk(state.texts, message, now)
    for text in finished:
        _said(state, text, now)


def _said(state: VehicleState, text: text_assembly.Text, now: Instant) -> None:
    """A complete text, or the part that arrived."""
    words = text.text
    if text_rules.ARMING.match(words):
        state.told_armed = max(state.told_armed, now.mono)
    motor_test.heard_text(state.test, words, now.mono)
    if words in state.profile.requests.boot_texts:
        state.started_at = now.mono
    version = firmware.of_text(words, state.profile.texts.firmware, state.family)
    if version is not None:
        state.firmware = ToldFirmware(version, now.mono, f"STATUSTEXT: {words}")
        return
    rule = classify(words, state.profile.texts.rules)
    if rule is not None:
        _apply(state, rule, words, now)
    elif text.severity <= UNCLASSIFIED and state.heartbeats.armed and classify(words, text_rules.COMMON) is None:
        state.latches = latches.announce(state.latches, causes.TEXT + text.severity, words, now)


def _apply(state: VehicleState, rule: TextRule, words: str, now: Instant) -> None:
    """What a text says according to its row."""
    effect = rule.effect
    if effect is Effect.CAUSE and not _counts(rule.when, state):
        effect = Effect.DETAIL if state.heartbeats.armed else Effect.READINESS
    if effect is Effect.CAUSE:
        announced(state, words, rule.codes, now)
    elif effect is Effect.CLEAR:
        cleared(state, words, rule.codes, now.mono)
    elif effect in (Effect.ESTOP, Effect.RELEASE):
        _stop_said(state, effect is Effect.ESTOP, words, now)
    elif effect is Effect.READINESS:
        _not_ready(state, words, now)
        denied_by = state.profile.speeds.denied_by
        if denied_by is not None and denied_by.match(words):
            state.denied_at = now.mono
    elif effect is Effect.DETAIL:
        state.failsafe = _say(state.failsafe, words, now)


def _stop_said(state: VehicleState, engaged: bool, words: str, now: Instant) -> None:
    """A text about an emergency stop."""
    armed = state.heartbeats.armed
    if state.profile.stops.outputs_show and armed and not honours_stop(state):
        return
    if engaged and armed and estop.REFUSES in words:
        state.stop = estop.doubted(state.stop, estop.LATE, now.mono)  # it was armed since, or is checked anew
    else:
        state.stop = estop.said(state.stop, engaged, words, now)
    state.assumed_free = False
    if state.profile.texts.stop_text is StopText.STATE:
        state.failsafe = _say(state.failsafe, words, now)
    elif engaged:
        _not_ready(state, words, now)


def _counts(when: When, state: VehicleState) -> bool:
    mav_state = state.heartbeats.state
    if when is When.ARMED:
        return state.heartbeats.armed
    if when is When.CRITICAL:
        return mav_state == MAV_STATE_CRITICAL
    if when is When.IN_TROUBLE:
        return state.heartbeats.armed or mav_state in (MAV_STATE_CRITICAL, MAV_STATE_FLIGHT_TERMINATION)
    return True


def _not_ready(state: VehicleState, words: str, now: Instant) -> None:
    """A reason why it cannot be armed: one of a burst, or the only one."""
    checks = state.profile.texts.checks
    if checks is None:
        state.readiness = readiness.alone(state.readiness, words, now)
    elif (found := checks.match(words)) is not None:
        state.readiness = readiness.reported(state.readiness, words, found[1], now)


def _say(before: Statement | None, words: str, now: Instant) -> Statement:
    return Statement(words, before.since if before is not None and before.text == words else now, now.mono)


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
