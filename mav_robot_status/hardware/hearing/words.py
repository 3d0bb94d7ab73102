"""STATUSTEXT and EVENT: what the autopilot says, and what is over when it says no more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink.definitions import Event, Statustext
from .. import causes, estop, statustext
from ..identity import Stack
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


def pass_time(memory: Memory, now: Instant, options: HardwareOptions) -> Memory:
    """The memory at `now` if nothing was heard since: texts that wait in vain for chunks, latches that have ended."""
    if memory.texts:
        assembly, overdue = statustext.overdue(memory.texts, now.mono)
        if overdue or assembly is not memory.texts:
            memory = memory._replace(texts=assembly)
            for text in overdue:
                memory = _said(memory, text, now, options)
    if memory.latches:
        lasting = causes.lasting(memory.latches, memory.pulse, now.mono, options.text_hold_s)
        if len(lasting) != len(memory.latches):
            memory = memory._replace(latches=lasting)
    return memory


def statustext_(memory: Memory, message: Statustext, now: Instant, options: HardwareOptions) -> Memory:
    """A STATUSTEXT, or a chunk of one."""
    memory = pass_time(memory, now, options)
    assembly, finished = statustext.heard_chunk(memory.texts, message, now)
    memory = memory._replace(texts=assembly)
    for text in finished:
        memory = _said(memory, text, now, options)
    return memory


def _said(memory: Memory, text: statustext.Text, now: Instant, options: HardwareOptions) -> Memory:
    """The memory after a whole text (or what arrived of it)."""
    words = text.text
    rule = classify(words, TEXT_TABLES[memory.stack])
    if rule is None:
        if text.severity <= UNCLASSIFIED and memory.pulse.armed and classify(words, common_texts.RULES) is None:
            return memory._replace(latches=causes.announce(memory.latches, 6000 + text.severity, words, now))
        return memory
    effect = rule.effect
    if effect is Effect.CAUSE and not _counts(rule.when, memory):
        effect = Effect.DETAIL if memory.pulse.armed else Effect.READINESS
    if effect is Effect.CAUSE:
        latches = memory.latches
        for code in rule.codes:
            latches = causes.announce(latches, code, words, now)
        return memory._replace(latches=latches)
    if effect is Effect.CLEAR:
        return memory._replace(latches=causes.clear(memory.latches, rule.codes))
    if effect in (Effect.ESTOP, Effect.RELEASE):
        if memory.pulse.armed and memory.family not in estop.HONOURED_BY:
            return memory
        engaged = effect is Effect.ESTOP
        memory = memory._replace(stop=estop.said(memory.stop, engaged, words, now), assumed_free=False)
        return memory._replace(not_ready=_say(memory.not_ready, words, now)) if engaged else memory
    if effect is Effect.READINESS:
        return memory._replace(not_ready=_say(memory.not_ready, words, now))
    if effect is Effect.DETAIL:
        return memory._replace(failsafe=_say(memory.failsafe, words, now))
    return memory


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


def event(memory: Memory, message: Event, now: Instant, options: HardwareOptions) -> Memory:
    """PX4: without metadata an event is only its levels. Internal level 6 answers an operator's command."""
    if message.sequence == memory.event:
        return memory
    memory = memory._replace(event=message.sequence)
    external, internal = message.log_levels & 0x0F, message.log_levels >> 4
    if memory.stack is Stack.PX4 and memory.pulse.armed and external <= UNCLASSIFIED and internal <= 5:
        return memory._replace(latches=causes.announce(memory.latches, 7000 + external, None, now, "EVENT"))
    return memory
