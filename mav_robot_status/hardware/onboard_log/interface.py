"""`OnboardLogRobotHW`: the hardware interface of an onboard log. No MAVLink is made up: records become a status."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, Protocol

from ...interface import Detail, IndustrialRobotStatusHandle, Inhibit, LinkState, RobotHW, RobotStatus
from .rules import as_inhibits, can_arm, derive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ...clock import Instant
    from ..mavlink.options import HardwareOptions
    from .record import Record
    from .state import LogState

GAP: Final = 1.0
"""Seconds without a record after which nothing is known."""
NOTHING_LOGGED: Final = "nothing was logged here"


class Meaning(Protocol):
    """What the records of an autopilot mean."""

    name: str
    """MAVLink's name of the autopilot."""
    state: LogState

    def wanted(self) -> Mapping[str, float]:
        """The records that mean something, with the least seconds between two."""

    def announced(self, names: frozenset[str]) -> None:
        """The kinds of records that the log holds."""

    def take(self, record: Record, now: Instant) -> bool:
        """Change the state by one record. True if nothing has changed."""

    def doubt(self) -> None:
        """Records are missing here."""


class OnboardLogRobotHW(RobotHW):
    """The robot of one log, as one handle."""

    stops_cut_power = False
    """The log shows both: a stop, and a motor test that goes on."""

    def __init__(
        self, make: Callable[[], Meaning], handle: str, options: HardwareOptions, name: str | None = None
    ) -> None:
        super().__init__()
        self._make = make
        self.meaning = make()
        self.gaps = 0
        """How often nothing was logged for longer than GAP."""
        self.seen: set[str] = set()
        """The kinds of records that were read."""
        self.deadline = math.inf
        """When `read` has something to do."""
        self._options = options
        self._name = name
        self._robot = IndustrialRobotStatusHandle(handle)
        self._last: float | None = None
        """When the last record was written."""
        self._ends_at = math.inf
        """When something in the state ends by itself."""
        self.forget()

    def forget(self) -> None:
        """No record was read."""
        self.set_status(self._robot, RobotStatus(), Detail(link=LinkState.NEVER_SEEN), {})
        self.meaning = self._make()
        self._last, self.deadline, self._ends_at = None, math.inf, math.inf

    def begun(self, booted_at: float, names: frozenset[str]) -> None:
        """When the autopilot has started (seconds of the replay), and the kinds of records that the log holds."""
        self._robot.booted_at = booted_at
        self.meaning.announced(names)

    def on_frame(self, record: Record, now: Instant, source: Any = None) -> None:
        """One record of the log."""
        last = self._last
        if last is None and self._robot.name not in self.handles.get_names():
            self.handles.register_handle(self._robot)
        if last is not None and now.mono - last > GAP:
            self.gaps += 1
            self.meaning.doubt()
            self.deadline = math.nextafter(now.mono, math.inf)
        self.seen.add(record.name)
        unchanged = self.meaning.take(record, now) and last is not None
        self._last = self._robot.heard_at = now.mono
        if not unchanged:  # records of the same time belong together: the next one of a later time shows the status
            self.deadline = min(self.deadline, math.nextafter(now.mono, math.inf))

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence to `now`."""
        self.read(now)

    def next_due(self, until: float = -math.inf) -> float:
        """After a change; when something ends by itself; when a gap begins."""
        last = self._last
        if last is None:
            return math.inf
        is_gap = any(inhibit.name == "LOG_GAP" for inhibit in self._robot.detail.inhibits)
        gap = math.inf if is_gap else math.nextafter(last + GAP, math.inf)
        return min(self.deadline, gap, self._ends_at)

    def read(self, now: Instant) -> None:
        """Put what the log has said into the handle."""
        if self._last is None:
            return
        state = self.meaning.state
        state.expire(now.mono)
        before = self._robot.detail
        vehicle = state.vehicle._replace(name=self._name)
        who = Detail(state.system, state.component, vehicle=vehicle, link=LinkState.CONNECTED)
        if now.mono - self._last > GAP:
            since = next((one.since_us for one in before.inhibits if one.name == "LOG_GAP"), now.unix_us)
            gap = Inhibit("LOG_GAP", NOTHING_LOGGED, since)
            self.set_status(self._robot, RobotStatus(), who._replace(inhibits=(gap,)), {})
        else:
            found = derive(state, self._options, now)
            mode = state.mode
            vehicle = vehicle._replace(flight_mode=mode.name, custom_mode=mode.number, can_arm=can_arm(state))
            inhibits = as_inhibits(found.inhibits, before.inhibits, now.unix_us)
            detail = who._replace(errors=found.errors, inhibits=inhibits, vehicle=vehicle)
            self.set_status(self._robot, found.status, detail, found.evidence)
        self.deadline = math.inf
        self._ends_at = state.next_end(now.mono)
