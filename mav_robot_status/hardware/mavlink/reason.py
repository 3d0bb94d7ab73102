"""Why a field has its value: the rule that decided, and the evidence for it in words.

The words are made on request, by a function that stands beside the rule: a rule reads facts, and the underlying numbers
and times of arrival are in the state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface.status import Evidence, TriState
from ...language import next_step

if TYPE_CHECKING:
    from .facts import Facts
    from .state import Heard, VehicleState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

Shown = tuple[str | None, float | None]
"""The deciding message with its field or text, and when it arrived (monotonic seconds)."""
Words = Callable[["VehicleState", "Facts", "Reason"], Shown]


def nothing(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """No message decided."""
    return None, None


def claims_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What the senders with these ids say."""
    return "the HEARTBEATs of several senders", None


def at(heard: Heard | None) -> float | None:
    """When a message arrived, if it did."""
    return None if heard is None else heard.at


def words(text: str, kind: str) -> Words:
    """Words on the latest message of a kind in `LatestMessages`; `text` may name facts: `{facts.landed_state}`."""

    def shown(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
        return text.format(facts=facts, state=state), at(getattr(state.latest, kind))

    return shown


class Reason(NamedTuple):
    """The rule that decided, and what it decided on."""

    rule: str
    words: Words = nothing
    code: int = 0
    """The code of the cause, if it decided on a cause."""
    doubt: bool = False
    """Of an unknown e_stopped: whether there is evidence of a stop, so that the drives may have no power."""


Finding = tuple[TriState, Reason]

CLAIMED: Final = Reason("another sender claims the ids of this vehicle", claims_words)
"""Two vehicles use the ids and cannot be told apart: nothing is known."""


class EvidenceOfVehicle(Mapping[str, Evidence]):
    """The evidence for each field of a status, made when it is read, with the numbers of that time."""

    __slots__ = ("_facts", "_reasons", "_state", "asked")

    def __init__(self, state: VehicleState, facts: Facts, reasons: Mapping[str, Reason]) -> None:
        self._state, self._facts, self._reasons = state, facts, reasons
        self.asked: dict[str, str] = {}
        """What is known about the request for each message, in words."""

    def __getitem__(self, field: str) -> Evidence:
        reason = self._reasons[field]
        source, heard_at = reason.words(self._state, self._facts, reason)
        step = next_step(field, reason.rule, self._facts.kind.profile.name, self.asked)
        return Evidence(reason.rule, source, heard_at, step)

    def __iter__(self) -> Iterator[str]:
        return iter(self._reasons)

    def __len__(self) -> int:
        return len(self._reasons)


def off(rule: str) -> str:
    """Why motion is not possible, from the reason why its drives have no power."""
    return f"Drives are off: {'it is disarmed' if rule == 'disarmed' else rule}"
