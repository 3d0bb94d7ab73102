"""STATUSTEXT: what it reports, and when a report without repetition ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....mavlink.definitions import Statustext
from ....mavlink.enumerations import MAV_STATE_CRITICAL, MAV_STATE_FLIGHT_TERMINATION
from .. import causes
from ..autopilots import firmware
from ..autopilots import texts as text_rules
from ..autopilots.profile import StopText
from ..autopilots.texts import UNCLASSIFIED, Effect, When, classify
from ..state import estop, latches, readiness, text_assembly
from ..state.latest_messages import is_fresh
from ..state.vehicle_state import Statement, ToldFirmware, honours_stop
from . import failsafe

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState


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
    if words in state.profile.requests.boot_texts:
        state.started_at = now.mono
    version = firmware.of_text(words, state.profile.texts.firmware, state.family)
    if version is not None:
        state.firmware = ToldFirmware(version, now.mono, f"STATUSTEXT: {words}")
        return
    rule = classify(words, state.profile.texts.rules)
    if rule is None:
        if text.severity <= UNCLASSIFIED and state.heartbeats.armed and classify(words, text_rules.COMMON) is None:
            state.latches = latches.announce(state.latches, causes.TEXT + text.severity, words, now)
        return
    effect = rule.effect
    if effect is Effect.CAUSE and not _counts(rule.when, state):
        effect = Effect.DETAIL if state.heartbeats.armed else Effect.READINESS
    if effect is Effect.CAUSE:
        failsafe.announced(state, words, rule.codes, now)
    elif effect is Effect.CLEAR:
        failsafe.cleared(state, words, rule.codes, now.mono)
    elif effect in (Effect.ESTOP, Effect.RELEASE):
        if state.profile.stops.outputs_show and state.heartbeats.armed and not honours_stop(state):
            return
        engaged = effect is Effect.ESTOP
        if engaged and state.heartbeats.armed and estop.REFUSES in words:
            state.stop = estop.doubted(state.stop, estop.LATE, now.mono)  # it was armed since, or is checked anew
        else:
            state.stop = estop.said(state.stop, engaged, words, now)
        state.assumed_free = False
        if state.profile.texts.stop_text is StopText.STATE:
            state.failsafe = _say(state.failsafe, words, now)
        elif engaged:
            _not_ready(state, words, now)
    elif effect is Effect.READINESS:
        _not_ready(state, words, now)
        denied_by = state.profile.speeds.denied_by
        if denied_by is not None and denied_by.match(words):
            state.denied_at = now.mono
    elif effect is Effect.DETAIL:
        state.failsafe = _say(state.failsafe, words, now)


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
