"""The texts in an onboard log, by the same tables as the STATUSTEXT of the autopilot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ..mavlink.autopilots.texts import COMMON, UNCLASSIFIED, Effect, When, classify
from ..mavlink.faults import causes
from .state import FALSE, TRUE, Told

if TYPE_CHECKING:
    from ...clock import Instant
    from ..mavlink.autopilots.texts import TextRule
    from .state import LogState

SHOWN: Final = "a text of the autopilot"


def said(
    state: LogState, text: str, rules: tuple[TextRule, ...], source: str, now: Instant, severity: int | None = None
) -> None:
    """The autopilot has logged a text. `severity` is that of syslog; None if the log does not hold it."""
    rule = classify(text, rules)
    if rule is None:
        is_severe = severity is not None and severity <= UNCLASSIFIED and state.armed.value is TRUE
        if is_severe and severity is not None and classify(text, COMMON) is None:
            state.raise_error((causes.TEXT + severity,), text, now.unix_us, now.mono)
    elif rule.effect is Effect.CAUSE and _counts(rule.when, state):
        state.raise_error(rule.codes, text, now.unix_us, now.mono)
    elif rule.effect is Effect.CLEAR:
        state.clear(rule.codes)
    elif rule.effect in (Effect.ESTOP, Effect.RELEASE):
        _stop(state, text, rule.effect is Effect.ESTOP, source, now)
    elif rule.effect is Effect.READINESS and state.armed.value is not TRUE:
        state.against_arming(text, now.unix_us, now.mono)


def _counts(when: When, state: LogState) -> bool:
    """Whether a cause counts now."""
    if when is When.ALWAYS:
        return True
    return state.armed.value is TRUE or (when is When.IN_TROUBLE and state.terminated is not None)


def _stop(state: LogState, text: str, engaged: bool, source: str, now: Instant) -> None:
    """A text about the emergency stop. A record of the stop itself knows better."""
    value = TRUE if engaged else FALSE
    if state.stop.value is value or (state.stop.source or "").startswith(("EV ", "actuator_armed")):
        return
    if not (engaged and state.armed.value is TRUE and "Arm: " in text):
        state.stop = Told(value, f"“{text}”", source, now.mono)
