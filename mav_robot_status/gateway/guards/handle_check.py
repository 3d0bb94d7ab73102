"""Checks the values that a third party's hardware interface puts into its handles.

A value of the wrong type would raise in every controller and publisher. A contradiction would be published as a fact.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import Detail, Evidence, Inhibit, LinkState, RobotStatus, validate
from ...interface.validation import assumptions

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from ...clock import Instant
    from ...interface import IndustrialRobotStatusHandle

log = logging.getLogger(__name__)

INVALID: Final = "its hardware interface reports invalid values"


class Values(NamedTuple):
    """What a handle holds. Compared by identity: a hardware interface sets new values, and does not change old ones."""

    status: RobotStatus
    detail: Detail
    evidence: Mapping[str, Evidence]


class Checked(NamedTuple):
    """The result of the last check of one handle."""

    given: Values
    """What the hardware interface put into the handle."""
    shown: Values
    """What the handle holds: `given`, or UNKNOWN while `given` is invalid."""
    known: Detail
    """The last valid detail."""


class HandleCheck:
    """Makes a handle UNKNOWN while its values are invalid. Logs the first fault of each handle."""

    def __init__(self, name: str, hardware: object = None) -> None:
        """`hardware` is the hardware interface with this name."""
        self._name = name
        self._assumptions = assumptions(hardware)
        self._checked: dict[str, Checked] = {}
        self._logged: set[str] = set()

    def check(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """Check the handles that have changed."""
        for handle in handles:
            if not _is_time(handle.heard_at):
                self._log(handle, f"heard_at: must be a number of seconds or None, not {handle.heard_at!r}")
                handle.heard_at = None
            last, held = self._checked.get(handle.name), _values(handle)
            if last is None or not _are_same(held, last.shown):
                self._check(handle, held if last is None else _given(held, last), now)

    def suspend(self, handles: Iterable[IndustrialRobotStatusHandle], why: str, now: Instant) -> None:
        """Make the handles UNKNOWN until `resume`."""
        for handle in handles:
            last = self._checked.get(handle.name)
            if last is not None:
                shown = _unknown(last.known, why, now)
                self._checked[handle.name] = last._replace(shown=shown)
                _put(handle, shown)

    def resume(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """Show again what the hardware interface puts into the handles."""
        for handle in handles:
            last = self._checked.get(handle.name)
            if last is not None:
                self._check(handle, _given(_values(handle), last), now)

    def lose(self, handles: Iterable[IndustrialRobotStatusHandle], why: str, now: Instant) -> None:
        """Make the handles UNKNOWN, as after the loss of a link."""
        for handle in handles:
            _put(handle, _unknown(self._known(handle), why, now))

    def _check(self, handle: IndustrialRobotStatusHandle, given: Values, now: Instant) -> None:
        fault = validate(given.status, given.detail, **self._assumptions) or _wrong_evidence(given.evidence)
        if fault is None:
            self._checked[handle.name] = Checked(given, given, given.detail)
            _put(handle, given)
            return
        self._log(handle, fault)
        known, last = self._known(handle), self._checked.get(handle.name)
        # the values of the first fault stay, so that a lasting fault publishes nothing
        shown = last.shown if last and last.shown is not last.given else _unknown(known, INVALID, now)
        self._checked[handle.name] = Checked(given, shown, known)
        _put(handle, shown)

    def _known(self, handle: IndustrialRobotStatusHandle) -> Detail:
        if handle.name in self._checked:
            return self._checked[handle.name].known
        return handle.detail if validate(RobotStatus(), handle.detail) is None else Detail()

    def _log(self, handle: IndustrialRobotStatusHandle, fault: str) -> None:
        if handle.name not in self._logged:
            self._logged.add(handle.name)
            log.error(
                "hardware interface '%s' puts invalid values into the handle '%s', which is unknown while it does: %s",
                self._name, handle.name, fault,
            )  # fmt: skip


def _values(handle: IndustrialRobotStatusHandle) -> Values:
    return Values(handle.status, handle.detail, handle.evidence)


def _put(handle: IndustrialRobotStatusHandle, values: Values) -> None:
    handle.status, handle.detail, handle.evidence = values


def _are_same(one: Values, other: Values) -> bool:
    return all(a is b for a, b in zip(one, other, strict=True))


def _given(held: Values, last: Checked) -> Values:
    """What the hardware interface put into the handle. A value that it has not replaced is still its last one."""
    given, shown = last.given, last.shown
    return Values(
        given.status if held.status is shown.status else held.status,
        given.detail if held.detail is shown.detail else held.detail,
        given.evidence if held.evidence is shown.evidence else held.evidence,
    )


def _unknown(known: Detail, why: str, now: Instant) -> Values:
    heard = known.link is not LinkState.NEVER_SEEN
    detail = known._replace(
        errors=(),
        inhibits=(Inhibit("LINK_STALE", why, now.unix_us),),
        vehicle=known.vehicle._replace(flight_mode=None, custom_mode=None, state=None),
        link=LinkState.LOST if heard else LinkState.NEVER_SEEN,
    )
    return Values(RobotStatus(), detail, {})


def _is_time(heard_at: object) -> bool:
    return heard_at is None or (type(heard_at) in (int, float) and math.isfinite(heard_at))  # type: ignore[arg-type]


def _wrong_evidence(evidence: Mapping[str, Evidence]) -> str | None:
    wrong = next((name for name, one in evidence.items() if not isinstance(one, Evidence)), None)
    return None if wrong is None else f"evidence: {wrong} must be an Evidence, not {evidence[wrong]!r}"
