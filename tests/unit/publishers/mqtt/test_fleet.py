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


class Subscriber:
    """A fleet, and the lines that a board would show."""

    def __init__(self) -> None:
        self.fleet = Fleet("plant/robots", KEEPALIVE)
        self.shown: dict[str, dict[str, Any]] = {}

    def receive(self, what: str, payload: str, at: float, retained: bool = False, robot: str = "r") -> str | None:
        self.fleet.take(f"plant/robots/{robot}/{what}", payload.encode(), retained, now(at))
        return self.mode(at)

    def status(self, seq: int, at: float, retained: bool = False) -> str | None:
        status = RobotStatus(mode=RobotMode.AUTO)
        line = line_of(RobotStatusMsg("rover", seq * 1_000_000, status, Detail(1, 1), 0.1), seq)
        return self.receive("status", line, at, retained)

    def mode(self, at: float) -> str | None:
        self.fleet.expire(now(at))
        self.shown.update(self.fleet.news())
        return self.shown["r"]["mode"] if "r" in self.shown else None


def now(at: float) -> Instant:
    return Instant(at, round(at * 1e6))


def test_a_status_is_live_once_a_second_one_follows() -> None:
    subscriber = Subscriber()
    assert subscriber.receive("connection", "ONLINE", 0.0) == "UNKNOWN"
    assert subscriber.status(0, 0.1) == "UNKNOWN"
    assert subscriber.status(1, 1.1) == "AUTO"
    assert subscriber.shown["r"]["handle"] == "r"


def test_after_a_doubt_a_robot_is_unknown_until_its_connection_and_two_statuses_arrive() -> None:
    subscriber = Subscriber()
    subscriber.receive("connection", "ONLINE", 0.0)
    subscriber.status(0, 0.1)
    assert subscriber.status(1, 1.1) == "AUTO"
    subscriber.fleet.doubt(now(1.2))
    assert subscriber.mode(1.2) == "UNKNOWN"
    assert subscriber.status(2, 1.3) == "UNKNOWN"
    assert subscriber.status(3, 1.4) == "UNKNOWN"
    subscriber.receive("connection", "ONLINE", 1.5, retained=True)
    assert subscriber.status(4, 1.6) == "AUTO"


def test_a_retained_status_is_not_live() -> None:
    subscriber = Subscriber()
    subscriber.receive("connection", "ONLINE", 0.0, retained=True)
    assert subscriber.status(5, 0.1, retained=True) == "UNKNOWN"
    assert subscriber.status(6, 1.0) == "AUTO"


def test_an_old_status_from_a_bridge_is_not_live() -> None:
    subscriber = Subscriber()
    subscriber.receive("connection", "ONLINE", 0.0)
    subscriber.status(0, 0.0)
    assert subscriber.status(1, 1.0) == "AUTO"
    assert subscriber.mode(1.0 + KEEPALIVE + 0.1) == "UNKNOWN"
    assert subscriber.status(1, 60.0) == "UNKNOWN"
    assert subscriber.status(7, 90.0) == "UNKNOWN"
    assert subscriber.status(8, 91.0) == "AUTO"


def test_a_status_is_not_live_unless_the_connection_is_online() -> None:
    subscriber = Subscriber()
    subscriber.status(0, 0.0)
    assert subscriber.status(1, 1.0) == "UNKNOWN"
    assert subscriber.receive("connection", "ONLINE", 1.5) == "UNKNOWN"
    assert subscriber.status(2, 2.0) == "AUTO"
    for state in ("CONNECTIONBROKEN", "OFFLINE", "", "rubbish"):
        assert subscriber.receive("connection", state, 2.0) == "UNKNOWN"
        assert subscriber.status(3, 2.1) == "UNKNOWN"


def test_the_inhibit_gives_the_reason_why_a_robot_is_unknown() -> None:
    subscriber = Subscriber()
    subscriber.status(0, 0.0)
    texts = []
    for state in ("", "ONLINE", "OFFLINE", "CONNECTIONBROKEN"):
        subscriber.receive("connection", state, 0.0)
        texts.append(subscriber.shown["r"]["inhibits"][0]["text"])
    assert texts == [
        "no gateway is online",
        "the gateway publishes nothing new",
        "the gateway was stopped",
        "the gateway is gone",
    ]
    assert (subscriber.shown["r"]["system"], subscriber.shown["r"]["link"]["state"]) == (1, "LOST")


def test_the_last_status_with_a_connected_link_is_kept_also_a_retained_one() -> None:
    subscriber = Subscriber()
    assert subscriber.fleet.last("r") is None
    subscriber.status(5, 0.0, retained=True)
    subscriber.receive("connection", "CONNECTIONBROKEN", 1.0)
    last = subscriber.fleet.last("r")
    assert last is not None
    assert (last["mode"], last["seq"]) == ("AUTO", 5)


def test_events_duplicates_and_missing_events_are_counted() -> None:
    subscriber = Subscriber()
    for session, seq in [("a", 4), ("a", 5), ("a", 5), ("a", 8), ("b", 1), ("b", 2)]:
        subscriber.receive("events", json.dumps({"session": session, "seq": seq}), 0.0)
    fleet = subscriber.fleet
    assert (fleet.events, fleet.duplicates, fleet.missing) == (5, 1, 2)
    fleet.begin()
    subscriber.receive("events", json.dumps({"session": "b", "seq": 9}), 0.0)
    assert fleet.missing == 2


def test_the_number_of_robots_is_bounded() -> None:
    subscriber = Subscriber()
    for number in range(5000):
        subscriber.receive("connection", "ONLINE", 0.0, robot=f"r{number}")
    assert len(subscriber.shown) == 4096
    assert subscriber.fleet.refused == 5000 - 4096


LINE = json.loads(line_of(RobotStatusMsg("rover", 0, RobotStatus(), Detail(1, 1), 0.1), 0))
JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


@given(st.sampled_from(sorted(LINE)), JSON, st.sampled_from(["status", "events", "connection", "x/y", ""]), st.binary())
def test_no_published_content_raises(name: str, value: Any, what: str, rubbish: bytes) -> None:
    subscriber, board = Subscriber(), Board()
    subscriber.receive("connection", "ONLINE", 0.0)
    for seq, line in enumerate([LINE, {**LINE, name: value}, LINE]):
        for payload in (json.dumps({**line, "seq": seq, **({name: value} if line != LINE else {})}).encode(), rubbish):
            subscriber.fleet.take(f"plant/robots/r/{what}", payload, False, now(seq + 1.0))
            for robot, shown in subscriber.fleet.news().items():
                board.update_line(robot, shown, seq + 1.0)
                json.dumps([entry.whole() for entry in board], allow_nan=False)
