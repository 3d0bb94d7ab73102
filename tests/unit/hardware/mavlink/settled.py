"""Checks `MOVES` and the `unsettled` marks: which facts a message really changes, found by settling all of them.

A `Witness` takes the place of `MavlinkRobotHW`. It ignores `MOVES`, settles every fact after every message, and notes
each fact that has changed, or that time changes earlier, without an `unsettled` mark.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, Final

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink import interface
from mav_robot_status.hardware.mavlink.handlers import Handler, heartbeat
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW, Stamped
from mav_robot_status.hardware.mavlink.message_table import KINDS, MOVES
from mav_robot_status.hardware.mavlink.moment import Moment
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.settle import SETTLE, fresh
from mav_robot_status.hardware.mavlink.state import vehicle_state
from mav_robot_status.hardware.mavlink.state.latest_messages import LatestMessages
from mav_robot_status.hardware.mavlink.vehicle import TrackedVehicle

Changes = set[tuple[type, str]]
"""Types of messages, each with the name of a fact that one of them has changed."""
Mark = tuple[str, int]
"""The file name and the line of a statement that sets `LatestMessages.unsettled`."""

ROWS: Final[Changes] = {(message, fact) for message, facts in MOVES.items() for fact in facts}


def outdated(vehicle: TrackedVehicle, now: Instant, options: HardwareOptions) -> list[str]:
    """The facts of a vehicle that differ from those of its state, or that time changes before its deadline.

    None if the next `read` evaluates the vehicle anyway. Without a link a status depends on the kind of vehicle alone.
    """
    state, facts = vehicle.state, vehicle.facts
    if state is None or not facts or vehicle.dirty or now.mono >= vehicle.moment.next:
        return []
    found = []
    for name, settle in SETTLE.items():
        moment = Moment(now.mono)
        if settle(state, moment, options) != getattr(facts, name) or moment.next < vehicle.moment.next:
            found.append(name)
    is_connected = facts.fresh.heartbeat or fresh(state, Moment(now.mono), options).heartbeat
    return found if is_connected else [name for name in found if name == "kind"]


class Witness(MavlinkRobotHW):
    """Settles every fact after every message. `changes` is what the tables must contain."""

    changes: ClassVar[Changes] = set()

    def take_all(self, records: Iterator[Stamped], last: Instant, until: float) -> tuple[Instant, Stamped | None]:
        """Take none of the records of a log, so that each passes `take`."""
        return last, next(records, None)

    def take(self, frame: Any, now: Instant, way: Any = None) -> TrackedVehicle | None:
        """Take one frame, and note the facts that it changes."""
        sender = super().take(frame, now, way)
        vehicle = self.find(*frame[1])
        if vehicle is not None:
            found = outdated(vehicle, now, self.options)
            self.changes.update((type(frame[3]), name) for name in found)
            if found:
                self._mark_dirty(vehicle)
        return sender


def ignore_table(monkeypatch: pytest.MonkeyPatch) -> Changes:
    """Let no message settle a fact by `MOVES`. Returns what a `Witness` notes from now on."""
    monkeypatch.setattr(interface, "KINDS", {number: (handler, ()) for number, (handler, _) in KINDS.items()})
    changes: Changes = set()
    monkeypatch.setattr(Witness, "changes", changes)
    return changes


def note_claims(monkeypatch: pytest.MonkeyPatch) -> Changes:
    """Let a `Witness` note only what a message changes whose handler says that it has changed nothing."""
    said_unchanged = False

    def noting(handler: Handler) -> Handler:
        def handle(*values: Any) -> bool | None:
            nonlocal said_unchanged
            said_unchanged = bool(handler(*values))
            return said_unchanged

        return handle

    class Claimed(set[tuple[type, str]]):
        def update(self, *found: Any) -> None:
            if said_unchanged:
                super().update(*found)

    monkeypatch.setattr(interface, "KINDS", {number: (noting(handler), ()) for number, (handler, _) in KINDS.items()})
    changes = Claimed()
    monkeypatch.setattr(Witness, "changes", changes)
    return changes


def omissions(changes: Changes) -> Changes:
    """The changes that `MOVES` lacks. A message without a row settles all facts."""
    return {(message, fact) for message, fact in changes if message in MOVES} - ROWS


def marks() -> list[Mark]:
    """All marks in the source."""
    package = Path(interface.__file__).parent
    return [
        (path.name, number)
        for folder in ("handlers", "state")
        for path in sorted((package / folder).glob("*.py"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if line.strip().endswith(".unsettled = True")
    ]


def switch_off(mark: Mark, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this mark set nothing."""

    class Unmarked(LatestMessages):
        def __setattr__(self, name: str, value: Any) -> None:
            caller = sys._getframe(1)
            if name != "unsettled" or (Path(caller.f_code.co_filename).name, caller.f_lineno) != mark:
                object.__setattr__(self, name, value)

    monkeypatch.setattr(heartbeat, "LatestMessages", Unmarked)
    monkeypatch.setattr(vehicle_state, "LatestMessages", Unmarked)
