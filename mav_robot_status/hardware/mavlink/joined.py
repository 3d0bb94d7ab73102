"""The status of a vehicle while several speakers claim its ids: the join of theirs, hazard first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface.status import Inhibit, RobotMode, TriState
from ..join import Logic, join
from .readiness.rule import inhibit
from .reason import Reason, claims_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...clock import Instant
    from ...interface.status import Detail
    from .derive import Derived

DIFFER: Final = Reason("several senders use the ids of this vehicle, and differ", claims_words)
LOGIC: Final = {
    "e_stopped": Logic.ALL,
    "drives_powered": Logic.ANY,
    "motion_possible": Logic.ANY,
    "in_motion": Logic.ANY,
    "in_error": Logic.ANY,
}
"""The hazard decides: "live" if one says so, "safe" only if all do."""


def joined(every: Sequence[Derived], before: Detail, now: Instant) -> Derived:
    """The status of several speakers, the main one first. `before` is the previous detail of the vehicle."""
    main = every[0]
    found = {field: join(logic, [getattr(one.status, field) for one in every]) for field, logic in LOGIC.items()}
    if found["e_stopped"] is TriState.TRUE and found["drives_powered"] is not TriState.FALSE:
        found["e_stopped"] = TriState.UNKNOWN
    modes = {one.status.mode for one in every}
    wrong = next((one for one in every if one.status.in_error is TriState.TRUE), main)
    status = main.status._replace(
        mode=modes.pop() if len(modes) == 1 else RobotMode.UNKNOWN,
        e_stopped=found["e_stopped"],
        drives_powered=found["drives_powered"],
        motion_possible=found["motion_possible"],
        in_motion=found["in_motion"],
        in_error=found["in_error"],
        error_code=wrong.status.error_code,
    )
    detail = main.detail._replace(
        errors=wrong.detail.errors, inhibits=_inhibits(main, status.motion_possible, before, now)
    )
    if len({(one.detail.vehicle.flight_mode, one.detail.vehicle.custom_mode) for one in every}) > 1:
        detail = detail._replace(vehicle=detail.vehicle._replace(flight_mode=None, custom_mode=None))
    reasons = {
        field: reason if getattr(status, field) is getattr(main.status, field) else DIFFER
        for field, reason in main.reasons.items()
    }
    return main._replace(status=status, detail=detail, reasons=reasons)


def _inhibits(main: Derived, possible: TriState, before: Detail, now: Instant) -> tuple[Inhibit, ...]:
    """None while motion is possible. What one sender says is no reason while another one says otherwise."""
    if possible is TriState.TRUE:
        return ()
    if possible is main.status.motion_possible:
        return main.detail.inhibits
    return (inhibit("SENDER_UNCERTAIN", None, before, now),)
