"""Robots for a view: a board with their statuses, and a source that shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.gateway.background import Row
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers.board import Board, Transition
from mav_robot_status.views.terminal.robots import Memory, Robot
from mav_robot_status.views.terminal.text import Line

START = Instant(1000.0, 1_800_000_000_000_000)  # 2027-01-15T08:00:00Z
TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
ROVER = Vehicle("ARDUPILOTMEGA", "GROUND_ROVER", "HOLD", 4, "ACTIVE")
DISARMED = Inhibit("DISARMED", None, START.unix_us - 12_000_000)
PREARM = Inhibit("PREARM_FAILING", "PreArm: GPS 1: Bad fix", START.unix_us - 10_000_000)
RADIO = ErrorCause(2001, "RC_LOST", "Radio Failsafe", START.unix_us - 3_000_000)
CRASH = ErrorCause(4001, "CRASH", None, START.unix_us - 3_000_000)

DRIVING = RobotStatus(
    mode=RobotMode.AUTO, e_stopped=FALSE, drives_powered=TRUE, motion_possible=TRUE, in_motion=TRUE, in_error=FALSE
)
PARKED = RobotStatus(
    mode=RobotMode.MANUAL, e_stopped=FALSE, drives_powered=FALSE, motion_possible=FALSE, in_motion=FALSE, in_error=FALSE
)
STOPPED = RobotStatus(
    mode=RobotMode.AUTO, e_stopped=TRUE, drives_powered=FALSE, motion_possible=FALSE, in_motion=FALSE, in_error=FALSE
)
FAILED = RobotStatus(
    mode=RobotMode.AUTO,
    e_stopped=UNKNOWN,
    drives_powered=TRUE,
    motion_possible=TRUE,
    in_motion=FALSE,
    in_error=TRUE,
    error_code=2001,
)
NOTHING = RobotStatus()


def put(
    board: Board,
    status: RobotStatus = DRIVING,
    at: Instant = START,
    *,
    system: int | None = 1,
    component: int | None = 1,
    handle: str = "",
    age: float | None = 0.3,
    **detail: Any,
) -> None:
    """Put a status on a board."""
    details = Detail(system, component, **{"vehicle": ROVER, **detail})
    name = handle or f"vehicle/{system}"
    board.update(RobotStatusMsg(name, at.unix_us, status, details, age), at.mono)


def lose(board: Board, system: int, at: Instant = START, age: float = 5.0) -> None:
    """The link to a vehicle is lost."""
    stale = Inhibit("LINK_STALE", None, at.unix_us)
    quiet = Vehicle("ARDUPILOTMEGA", "GROUND_ROVER")
    put(board, NOTHING, at, system=system, age=age, link=LinkState.LOST, inhibits=(stale,), vehicle=quiet)


class Source:
    """A source for a view: a board at one moment. `wait` runs the next step of the test; it ends after the last one."""

    connection = "udp:127.0.0.1:14550"
    advice = "To find out why: doctor"

    def __init__(self, board: Board, *steps: Callable[[], object], rates: Mapping[str, float] | None = None) -> None:
        self.board, self.rates, self.explained = board, rates or {}, ""
        self.fields: dict[str, Any] = {}
        self._steps, self._endless = list(steps), not steps

    def now(self) -> Instant:
        return START

    def wait(self, seconds: float) -> bool:
        if self._steps:
            self._steps.pop(0)()
        return not self._steps and not self._endless

    def explanation(self) -> Mapping[str, Any] | None:
        return {"handle": self.explained, "fields": self.fields} if self.fields else None

    @property
    def version(self) -> int:
        return self.board.version

    def rows(self) -> list[Row]:
        return [Row(e.line, e.stamp, e.version, e.heartbeat_age, self.rates) for e in self.board]

    def changes(self, handles: Iterable[str], most: int) -> list[tuple[str, Transition]]:
        found = [(handle, change) for handle in handles for change in self.board.entries[handle].transitions]
        return found[: -most - 1 : -1]


def robots(board: Board) -> list[Robot]:
    """The robots of a board."""
    return Memory().robots(Source(board).rows(), START)


def one(**more: Any) -> Robot:
    """A robot."""
    board = Board()
    put(board, **more)
    return robots(board)[0]


def texts(lines: Iterable[Line]) -> list[str]:
    """The visible text of each line."""
    return ["".join(span.text for span in line).rstrip() for line in lines]
