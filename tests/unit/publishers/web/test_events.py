from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from datetime import datetime
from typing import Any

import pytest

from mav_robot_status.interface import Detail, RobotMode, RobotStatus, TriState
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web import events
from mav_robot_status.publishers.web.events import Events, Listener
from mav_robot_status.testing import ManualClock

from ..port import msg

MANUAL, AUTO = RobotStatus(mode=RobotMode.MANUAL), RobotStatus(mode=RobotMode.AUTO)


class Stage:
    """Events of a board with a manual clock."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.board = Board()
        self.events = Events(self.board, self.clock.now, lambda: None)
        self.aborted: list[Listener] = []

    def listener(self, handle: str | None = None) -> Listener:
        listener = Listener(handle, lambda: self.aborted.append(listener))
        assert self.events.enter(listener)
        return listener

    def take(self, status: RobotStatus, handle: str = "robot") -> None:
        self.board.update(msg(status, handle=handle), self.clock.now().mono)

    def received(self, listener: Listener) -> list[tuple[str, Any]]:
        return list(parsed(self.events.since(listener)))


def parsed(data: bytes) -> Iterator[tuple[str, Any]]:
    for block in data.decode().split("\n\n")[:-1]:
        name, text = block.split("\n")
        yield name.removeprefix("event: "), json.loads(text.removeprefix("data: "))


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_a_new_listener_gets_the_whole_board_and_then_changes(stage: Stage) -> None:
    stage.take(MANUAL, "a")
    stage.take(MANUAL, "b")
    listener = stage.listener()
    [(name, data)] = stage.received(listener)
    assert name == "board"
    assert [line["handle"] for line in data["vehicles"]] == ["a", "b"]
    assert (data["standing"], data["stale_after"]) == (None, None)
    assert stage.received(listener) == []
    stage.take(AUTO, "b")
    [(name, data)] = stage.received(listener)
    assert (name, [line["handle"] for line in data["vehicles"]]) == ("change", ["b"])


def test_a_listener_gets_a_change_that_came_after_another_listener_of_the_same_pulse(stage: Stage) -> None:
    stage.take(MANUAL)
    stage.events.pulse()
    stage.received(stage.listener())
    stage.take(AUTO)
    late = stage.listener()
    [(name, data)] = stage.received(late)
    assert (name, data["vehicles"][0]["mode"]) == ("board", "AUTO")
    stage.events.pulse()
    assert [line for name, data in stage.received(late) for line in data["vehicles"]] == []


def test_each_line_comes_with_its_headline_and_none_is_made_while_nobody_listens(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def said(line: dict[str, Any], last: object, members: object) -> dict[str, Any]:
        made.append(line["handle"])
        return {"word": "PARKED"}

    monkeypatch.setattr(events, "said", said)
    stage.take(MANUAL, "a")
    stage.take(MANUAL, "b")
    stage.events.pulse()
    assert made == []
    for _ in range(2):
        [(_, data)] = stage.received(stage.listener())
        assert data["headlines"] == {"a": {"word": "PARKED"}, "b": {"word": "PARKED"}}
    assert made == ["a", "b"]  # once for all listeners


def test_the_page_is_told_whether_to_give_alarms(stage: Stage) -> None:
    assert stage.received(stage.listener())[0][1]["alarm"] is False
    loud = Events(stage.board, stage.clock.now, lambda: None, alarm=True)
    listener = Listener(None, lambda: None)
    loud.enter(listener)
    assert next(parsed(loud.since(listener)))[1]["alarm"] is True


def test_a_slow_listener_misses_the_states_between(stage: Stage) -> None:
    listener = stage.listener()
    stage.received(listener)
    for _ in range(100):
        stage.take(MANUAL)
        stage.take(AUTO)
    [(_, data)] = stage.received(listener)
    assert [line["mode"] for line in data["vehicles"]] == ["AUTO"]


def test_every_listener_gets_the_age_of_each_line_once_a_second(stage: Stage) -> None:
    stage.take(MANUAL)
    listener = stage.listener()
    stage.events.pulse()
    stage.received(listener)
    stage.clock.advance(0.5)
    stage.events.pulse()
    assert stage.received(listener) == []
    stage.clock.advance(0.5)
    stage.events.pulse()
    [(_, data)] = stage.received(listener)
    assert data["vehicles"] == []
    assert data["beats"] == {"robot": ["1970-01-01T00:00:01.000000Z", 0.1, 1.0]}


def test_listeners_that_keep_up_share_the_same_bytes(stage: Stage) -> None:
    one, other = stage.listener(), stage.listener()
    stage.take(MANUAL)
    stage.events.pulse()
    assert stage.events.since(one) == stage.events.since(other) != b""
    assert len(stage.events._cache) == 1


def test_a_listener_of_a_vehicle_gets_its_history_and_then_new_transitions(stage: Stage) -> None:
    stage.take(MANUAL)
    stage.clock.advance(5)
    listener = stage.listener("robot")
    data = dict(stage.received(listener))["history"]
    now, (since,) = (datetime.fromisoformat(data["now"][:-1]), set(data["kept_since"].values()))
    assert data["whole"]
    assert (now - datetime.fromisoformat(since[:-1])).total_seconds() == 5.0
    assert {"ago": 5.0, "name": "mode", "value": "MANUAL", "before": None}.items() <= data["transitions"][0].items()
    stage.clock.advance(1)
    stage.take(AUTO)
    data = dict(stage.received(listener))["history"]
    assert (data["whole"], [(t["name"], t["before"]) for t in data["transitions"]]) == (False, [("mode", "MANUAL")])
    assert "history" not in dict(stage.received(listener))


def test_the_causes_of_a_shown_vehicle_are_sent_when_it_changes(stage: Stage) -> None:
    stage.take(MANUAL)
    listener = stage.listener("robot")
    assert dict(stage.received(listener))["about"] == {"handle": "robot", "causes": [], "last": None}
    assert stage.received(listener) == []
    stage.take(AUTO)
    assert "about" in dict(stage.received(listener))


def test_events_and_what_waits_for_a_person_are_sent_once_and_to_everybody(stage: Stage) -> None:
    first = stage.listener()
    stage.received(first)
    stage.take(MANUAL._replace(e_stopped=TriState.TRUE))
    data = dict(stage.received(first))["change"]
    assert [(one["word"], one["what"]) for one in data["events"]] == [("EMERGENCY STOP", "begins")]
    assert len(data["pending"]) == 1
    stage.board.acknowledge(None, stage.clock.now())
    second = stage.listener()
    for listener in (first, second):
        data = next(data for _, data in stage.received(listener))
        assert (data["pending"], data["events"][-1]["what"]) == ([], "acknowledged")
    assert stage.received(first) == []


def test_a_group_is_told_anew_when_a_member_changes(stage: Stage) -> None:
    detail = Detail(1, 192, members=("base",))
    stage.board.update(msg(MANUAL, detail, "group"), 0.0)
    stage.take(MANUAL, "base")
    listener = stage.listener()
    stage.received(listener)
    stage.take(MANUAL._replace(e_stopped=TriState.TRUE), "base")
    data = dict(stage.received(listener))["change"]
    assert [line["handle"] for line in data["vehicles"]] == ["base"]
    assert data["headlines"]["group"]["sentences"][0]["text"] == "base is stopped"


def test_an_unknown_vehicle_has_no_history(stage: Stage) -> None:
    assert [name for name, _ in stage.received(stage.listener("nobody"))] == ["board"]


def test_an_explanation_is_sent_once_and_only_while_a_listener_shows_the_vehicle(stage: Stage) -> None:
    stage.take(MANUAL)
    listener = stage.listener("robot")
    stage.received(listener)
    assert stage.events.watched == {"robot"}
    stage.events.explain("robot", {"fields": {}})
    stage.events.explain("other", {"fields": {}})
    assert stage.received(listener) == [("explanation", {"fields": {}})]
    assert stage.received(listener) == []
    stage.events.leave(listener)
    assert (stage.events.watched, stage.events.explanations) == (frozenset(), {})


def test_a_listener_that_does_not_read_is_disconnected(stage: Stage) -> None:
    listener = stage.listener()
    listener.busy_since = stage.clock.now().mono
    stage.clock.advance(events.PATIENCE)
    stage.events.pulse()
    assert not stage.aborted
    stage.clock.advance(0.1)
    stage.events.pulse()
    assert stage.aborted == [listener]
    assert stage.events.dropped == 1


def test_the_number_of_listeners_is_bounded(stage: Stage) -> None:
    for _ in range(events.MOST_LISTENERS):
        stage.listener()
    assert not stage.events.enter(Listener(None, lambda: None))


def test_only_a_change_wakes_the_listeners(stage: Stage) -> None:
    async def play() -> list[bool]:
        waiting = asyncio.ensure_future(stage.events.wait())
        woken = []
        for changes in (False, True):
            if changes:
                stage.take(MANUAL)
            await asyncio.sleep(0)
            stage.events.pulse()
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            woken.append(waiting.done())
        waiting.cancel()
        return woken

    stage.clock.advance(1.0)
    stage.events.pulse()  # a tick
    assert asyncio.run(play()) == [False, True]


def test_texts_of_a_vehicle_cannot_end_an_event() -> None:
    data = events.event("change", {"text": "a\n\ndata: b\r\u2028"})
    assert data.count(b"\n") == 3
    assert list(parsed(data)) == [("change", {"text": "a\n\ndata: b\r\u2028"})]
