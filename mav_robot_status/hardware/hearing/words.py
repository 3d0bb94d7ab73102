"""STATUSTEXT and EVENT: what the autopilot says, and what is over when it says no more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink.definitions import Event, Statustext
from .. import causes, estop, statustext
from ..identity import ARDUPILOT, PX4, Stack
from ..memory import Said
from ..pulse import CRITICAL, TERMINATED
from ..texts import UNCLASSIFIED, Effect, TextRule, When, classify
from ..texts import ardupilot as ardupilot_texts
from ..texts import common as common_texts
from ..texts import px4 as px4_texts

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions

TEXT_TABLES: Final[dict[Stack, tuple[TextRule, ...]]] = {
    Stack.ARDUPILOT: ardupilot_texts.RULES,
    Stack.PX4: px4_texts.RULES,
    Stack.INAV: (),
    Stack.OTHER: (),
}


def pass_time(memory: Memory, now: Instant, options: HardwareOptions) -> None:
    """What time alone ends up to `now`: texts that wait in vain for chunks, and latches."""
    if memory.texts:
        memory.texts, overdue = statustext.overdue(memory.texts, now.mono)
        for text in overdue:
            _said(memory, text, now)
    if memory.latches:
        memory.latches = causes.lasting(memory.latches, memory.pulse, now.mono, options.text_hold_s)


def statustext_(memory: Memory, message: Statustext, now: Instant, options: HardwareOptions) -> None:
    """A STATUSTEXT, or a chunk of one."""
    pass_time(memory, now, options)
    memory.texts, finished = statustext.heard_chunk(memory.texts, message, now)
    for text in finished:
        _said(memory, text, now)


def _said(memory: Memory, text: statustext.Text, now: Instant) -> None:
    """A whole text, or what arrived of it."""
    words = text.text
    rule = classify(words, TEXT_TABLES[memory.stack])
    if rule is None:
        if text.severity <= UNCLASSIFIED and memory.pulse.armed and classify(words, common_texts.RULES) is None:
            memory.latches = causes.announce(memory.latches, 6000 + text.severity, words, now)
        return
    effect = rule.effect
    if effect is Effect.CAUSE and not _counts(rule.when, memory):
        effect = Effect.DETAIL if memory.pulse.armed else Effect.READINESS
    if effect is Effect.CAUSE:
        for code in rule.codes:
            memory.latches = causes.announce(memory.latches, code, words, now)
    elif effect is Effect.CLEAR:
        memory.latches = causes.clear(memory.latches, rule.codes)
    elif effect in (Effect.ESTOP, Effect.RELEASE):
        if memory.stack is ARDUPILOT and memory.pulse.armed and memory.family not in estop.HONOURED_BY:
            return
        engaged = effect is Effect.ESTOP
        memory.stop = estop.said(memory.stop, engaged, words, now)
        memory.assumed_free = False
        if memory.stack is not ARDUPILOT:
            memory.failsafe = _say(memory.failsafe, words, now)
        elif engaged:
            memory.not_ready = _say(memory.not_ready, words, now)
    elif effect is Effect.READINESS:
        memory.not_ready = _say(memory.not_ready, words, now)
    elif effect is Effect.DETAIL:
        memory.failsafe = _say(memory.failsafe, words, now)


def _counts(when: When, memory: Memory) -> bool:
    state = memory.pulse.state
    if when is When.ARMED:
        return memory.pulse.armed
    if when is When.CRITICAL:
        return state == CRITICAL
    if when is When.IN_TROUBLE:
        return memory.pulse.armed or state in (CRITICAL, TERMINATED)
    return True


def _say(before: Said | None, words: str, now: Instant) -> Said:
    return Said(words, before.since if before is not None and before.text == words else now, now.mono)


def event(memory: Memory, message: Event, now: Instant, options: HardwareOptions) -> None:
    """PX4: without metadata an event is only its levels. Internal level 6 answers an operator's command."""
    if message.sequence == memory.event:
        return
    memory.event = message.sequence
    external, internal = message.log_levels & 0x0F, message.log_levels >> 4
    if memory.stack is PX4 and memory.pulse.armed and external <= UNCLASSIFIED and internal <= 5:
        memory.latches = causes.announce(memory.latches, 7000 + external, None, now, "EVENT")
