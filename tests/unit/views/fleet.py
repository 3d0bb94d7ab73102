"""Vehicles for a table: a board with their statuses, and the state of a screen that shows it."""

from __future__ import annotations

from typing import Any

from mav_robot_status.clock import Instant
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
from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal import state
from mav_robot_status.views.terminal.text import Line, plain

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


def screen(board: Board, **more: Any) -> state.State:
    """The state of a screen that shows a board."""
    vehicles = tuple(state.Vehicle(entry.line, entry.heartbeat_age) for entry in board)
    return state.State("udp:127.0.0.1:14550", START, vehicles, **more)


def one(**more: Any) -> state.State:
    """A screen with one vehicle."""
    board = Board()
    put(board, **more)
    return screen(board)


def texts(lines: list[Line]) -> list[str]:
    """The visible text of each line."""
    return [plain(line).rstrip() for line in lines]
