from __future__ import annotations

import contextlib
import io
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.errors import UsageError
from mav_robot_status.interface import PublisherContext, RobotMode, RobotStatus
from mav_robot_status.publishers.web import publisher as publishers
from mav_robot_status.publishers.web.publisher import HttpPublisher

from ....deadline import SOON, allow
from ..port import Port, msg
from .site import Listening, until

MANUAL, AUTO = RobotStatus(mode=RobotMode.MANUAL), RobotStatus(mode=RobotMode.AUTO)
Explain = Callable[[str, Instant], Mapping[str, Any] | None]


@contextlib.contextmanager
def publishing(explain: Explain | None = None) -> Iterator[HttpPublisher]:
    context = PublisherContext({"listen": "127.0.0.1:0"}, Port(), io.StringIO(), False, explain)
    publisher = HttpPublisher(context)
    try:
        yield publisher
    finally:
        publisher.close()


def waits_for(event: threading.Event) -> None:
    event.wait(allow(SOON))


def port(publisher: HttpPublisher) -> int:
    return int(publisher.url.rpartition(":")[2].strip("/"))


def test_published_messages_reach_the_board_in_the_other_thread() -> None:
    with publishing() as publisher:
        assert not publisher.busy()
        publisher.publish(msg(MANUAL))
        publisher.publish(msg(AUTO))
        publisher.service(present())
        board = publisher._server.board
        until(lambda: "robot" in board.entries)
        assert board.entries["robot"].line["mode"] == "AUTO"
        assert [t.value for t in board.entries["robot"].transitions if t.name == "mode"] == ["MANUAL", "AUTO"]


def test_a_busy_server_gets_the_last_status_of_each_handle_and_the_rest_is_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(publishers, "MOST_WAITING", 10)
    with publishing() as publisher:
        going_on = threading.Event()
        assert publisher._server.post(lambda *_: waits_for(going_on))
        until(lambda: publisher._server.post(lambda *_: None))
        for number in range(100):
            publisher.publish(msg(MANUAL._replace(error_code=number), handle=f"robot{number % 2}"))
            again = publisher.service(now := present())
            assert again is not None
            assert now.mono < again < now.mono + 1.0
            assert len(publisher._waiting) <= 11
        going_on.set()
        board = publisher._server.board
        until(lambda: publisher.service(present()) is not None and len(board.entries) == 2)
        assert [board.entries[f"robot{n}"].line["error_code"] for n in (0, 1)] == [98, 99]


def test_a_shown_vehicle_is_explained_periodically_and_at_once_after_a_change() -> None:
    asked: list[tuple[str, float]] = []

    def explain(handle: str, now: Instant) -> Mapping[str, Any]:
        asked.append((handle, now.mono))
        return {"fields": {}, "number": len(asked)}

    with publishing(explain) as publisher:
        publisher.publish(msg(MANUAL))
        publisher.publish(msg(MANUAL, handle="other"))
        publisher.service(Instant(0.0, 0))
        assert asked == []
        listening = Listening(port(publisher), "/events?handle=robot")
        until(lambda: publisher._server.watched == {"robot"})
        for at, status in ((1.0, MANUAL), (1.5, MANUAL), (1.6, AUTO), (1.7, AUTO), (2.6, AUTO)):
            publisher.publish(msg(status))
            publisher.service(Instant(at, 0))
        # at 1.0 it is new, at 1.5 its status is known for the first time since
        assert asked == [("robot", 1.0), ("robot", 1.5), ("robot", 1.6), ("robot", 2.6)]
        until(lambda: publisher._server._posted is False)
        publisher.service(Instant(2.7, 0))
        assert next(data for name, data in listening.events() if name == "explanation")["number"] >= 1
        listening.close()
        until(lambda: not publisher._server.watched)


def test_each_round_explains_one_of_the_shown_vehicles_in_turn() -> None:
    asked: list[str] = []
    with publishing(lambda handle, now: asked.append(handle)) as publisher:
        listening = [Listening(port(publisher), f"/events?handle=robot{n}") for n in range(3)]
        until(lambda: len(publisher._server.watched) == 3)
        for at in range(6):
            publisher.service(Instant(at / 10, 0))
        assert sorted(asked) == ["robot0", "robot1", "robot2"]
        for one in listening:
            one.close()


def test_without_the_extra_the_error_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    package = "mav_robot_status.publishers.web."
    needing = {package + name for name in ("access_control", "connections", "handler", "scrape", "serve")}
    for name in [name for name in sys.modules if name in needing or name.startswith("tornado.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "tornado", None)
    with pytest.raises(UsageError, match=r"pip install 'mav-robot-status\[web\]'"), publishing():
        pass
