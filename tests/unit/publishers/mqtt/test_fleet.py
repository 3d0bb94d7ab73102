from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import Instant
from mav_robot_status.interface import Detail, RobotMode, RobotStatus, RobotStatusMsg
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.mqtt.fleet import Fleet
from mav_robot_status.publishers.mqtt.lines import line_of

KEEPALIVE = 10.0


class Ear:
    """A fleet, and what a board would show of it."""

    def __init__(self) -> None:
        self.fleet = Fleet("plant/robots", KEEPALIVE)
        self.shown: dict[str, dict[str, Any]] = {}

    def hear(self, what: str, payload: str, at: float, retained: bool = False, robot: str = "r") -> str | None:
        self.fleet.take(f"plant/robots/{robot}/{what}", payload.encode(), retained, now(at))
        return self.mode(at)

    def status(self, seq: int, at: float, retained: bool = False) -> str | None:
        status = RobotStatus(RobotMode.AUTO)
        line = line_of(RobotStatusMsg("rover", seq * 1_000_000, status, Detail(1, 1), 0.1), seq)
        return self.hear("status", line, at, retained)

    def mode(self, at: float) -> str | None:
        self.fleet.expire(now(at))
        self.shown.update(self.fleet.news())
        return self.shown["r"]["mode"] if "r" in self.shown else None


def now(at: float) -> Instant:
    return Instant(at, round(at * 1e6))


def test_a_status_counts_once_it_has_renewed_itself() -> None:
    ear = Ear()
    assert ear.hear("connection", "ONLINE", 0.0) == "UNKNOWN"
    assert ear.status(0, 0.1) == "UNKNOWN"
    assert ear.status(1, 1.1) == "AUTO"
    assert ear.shown["r"]["handle"] == "r"


def test_what_a_broker_retained_does_not_count() -> None:
    ear = Ear()
    ear.hear("connection", "ONLINE", 0.0, retained=True)
    assert ear.status(5, 0.1, retained=True) == "UNKNOWN"
    assert ear.status(6, 1.0) == "AUTO"


def test_what_a_bridge_brings_up_again_does_not_count() -> None:
    ear = Ear()
    ear.hear("connection", "ONLINE", 0.0)
    ear.status(0, 0.0)
    assert ear.status(1, 1.0) == "AUTO"
    assert ear.mode(1.0 + KEEPALIVE + 0.1) == "UNKNOWN"
    assert ear.status(1, 60.0) == "UNKNOWN"
    assert ear.status(7, 90.0) == "UNKNOWN"
    assert ear.status(8, 91.0) == "AUTO"


def test_without_a_gateway_that_says_it_is_there_nothing_counts() -> None:
    ear = Ear()
    ear.status(0, 0.0)
    assert ear.status(1, 1.0) == "UNKNOWN"
    assert ear.hear("connection", "ONLINE", 1.5) == "UNKNOWN"
    assert ear.status(2, 2.0) == "AUTO"
    for state in ("CONNECTIONBROKEN", "OFFLINE", "", "rubbish"):
        assert ear.hear("connection", state, 2.0) == "UNKNOWN"
        assert ear.status(3, 2.1) == "UNKNOWN"


def test_why_a_robot_is_unknown_is_told() -> None:
    ear = Ear()
    ear.status(0, 0.0)
    said = []
    for state in ("", "ONLINE", "OFFLINE", "CONNECTIONBROKEN"):
        ear.hear("connection", state, 0.0)
        said.append(ear.shown["r"]["inhibits"][0]["text"])
    assert said == [
        "no gateway has said that it is there",
        "the gateway says nothing new",
        "the gateway was ended",
        "the gateway is gone",
    ]
    assert (ear.shown["r"]["system"], ear.shown["r"]["link"]["state"]) == (1, "LOST")


def test_events_are_counted_with_those_that_came_twice_and_not_at_all() -> None:
    ear = Ear()
    for session, seq in [("a", 4), ("a", 5), ("a", 5), ("a", 8), ("b", 1), ("b", 2)]:
        ear.hear("events", json.dumps({"session": session, "seq": seq}), 0.0)
    fleet = ear.fleet
    assert (fleet.events, fleet.duplicates, fleet.missing) == (5, 1, 2)
    fleet.begin()
    ear.hear("events", json.dumps({"session": "b", "seq": 9}), 0.0)
    assert fleet.missing == 2


def test_there_are_no_more_robots_than_a_board_shows() -> None:
    ear = Ear()
    for number in range(5000):
        ear.hear("connection", "ONLINE", 0.0, robot=f"r{number}")
    assert len(ear.shown) == 4096
    assert ear.fleet.refused == 5000 - 4096


LINE = json.loads(line_of(RobotStatusMsg("rover", 0, RobotStatus(), Detail(1, 1), 0.1), 0))
JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(sorted(LINE)), JSON, st.sampled_from(["status", "events", "connection", "x/y", ""]), st.binary())
def test_nothing_that_anybody_publishes_raises(name: str, value: Any, what: str, rubbish: bytes) -> None:
    ear, board = Ear(), Board()
    ear.hear("connection", "ONLINE", 0.0)
    for seq, line in enumerate([LINE, {**LINE, name: value}, LINE]):
        for payload in (json.dumps({**line, "seq": seq, **({name: value} if line != LINE else {})}).encode(), rubbish):
            ear.fleet.take(f"plant/robots/r/{what}", payload, False, now(seq + 1.0))
            for robot, shown in ear.fleet.news().items():
                board.take_line(robot, shown, seq + 1.0)
                json.dumps([entry.whole() for entry in board], allow_nan=False)
