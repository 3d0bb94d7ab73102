from __future__ import annotations

import json
import re
import time
from importlib.resources import files
from itertools import islice

import jsonschema  # type: ignore[import-untyped]
import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.interface import Detail, RobotMode, RobotStatus, TriState
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web import events
from mav_robot_status.publishers.web.serve import GENERATED, STANDING, serve
from mav_robot_status.publishers.web.settings import WebSettings

from ....deadline import in_time
from ..port import msg
from .site import Site, until

MANUAL, AUTO = RobotStatus(mode=RobotMode.MANUAL), RobotStatus(mode=RobotMode.AUTO)


def test_a_board_is_served_without_a_gateway() -> None:
    server = serve(Board(), WebSettings(port=0))
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", server.url)
    server.close()
    server.close()
    assert server.post(lambda board, events, now: None)  # the server is closed: no effect, no error


def test_vehicles_are_native_lines() -> None:
    with Site() as site:
        assert site.ask("/api/v1/vehicles").json == []
        site.take(
            msg(MANUAL, Detail(2, 1), "b"), msg(AUTO, Detail(1, 1), "plant1/rover3"), msg(AUTO, Detail(2, 2), "c")
        )
        lines = site.ask("/api/v1/vehicles").json
        schema = site.ask("/schema.json").json
        assert [line["handle"] for line in lines] == ["plant1/rover3", "b", "c"]
        for line in lines:
            jsonschema.validate(line, schema)
        for which, handle in (
            ("2", "b"),
            ("2.2", "c"),
            ("plant1/rover3", "plant1/rover3"),
            ("plant1%2Frover3", "plant1/rover3"),
        ):
            assert site.ask(f"/api/v1/vehicles/{which}").json["handle"] == handle
        missing = site.ask("/api/v1/vehicles/7")
        assert (missing.status, missing.json["error"]) == (404, "no such vehicle; /api/v1/vehicles lists them")


def test_a_system_id_is_that_of_the_vehicle_and_not_of_its_group() -> None:
    with Site() as site:
        site.take(msg(MANUAL, Detail(1, 192, members=("rover", "arm")), "robot"), msg(AUTO, Detail(1, 1), "rover"))
        assert [line["handle"] for line in site.ask("/api/v1/vehicles").json] == ["robot", "rover"]
        for which, handle in (("1", "rover"), ("1.1", "rover"), ("1.192", "robot"), ("robot", "robot")):
            assert site.ask(f"/api/v1/vehicles/{which}").json["handle"] == handle


def test_the_schema_is_that_of_the_package() -> None:
    schema = json.loads((files("mav_robot_status") / "data" / "robot_status.schema.json").read_text("utf-8"))
    with Site() as site:
        assert site.ask("/schema.json").json == schema


def test_it_is_ready_while_the_source_runs() -> None:
    with Site() as site:
        site.server.turned = present().mono
        assert (site.ask("/readyz").status, site.ask("/healthz").status) == (200, 200)
        site.server.turned = present().mono - STANDING - 1
        ready = site.ask("/readyz")
        assert (ready.status, ready.json["ready"]) == (503, False)
        assert ready.json["standing"] > STANDING
        assert site.ask("/healthz").status == 200


def test_it_is_ready_with_an_unchecked_source() -> None:
    with Site() as site:
        assert site.ask("/readyz").json == {"ready": True, "standing": None, "vehicles": 0}


@pytest.mark.parametrize(
    ("path", "kind"),
    [("/", "text/html"), ("/page.js", "text/javascript"), ("/page.css", "text/css"), ("/icon.svg", "image/svg")],
)
def test_assets_have_a_content_type_and_are_cached(path: str, kind: str) -> None:
    with Site() as site:
        first = site.ask(path)
        assert first.headers["Content-Type"].startswith(kind)
        assert site.ask(path, If_None_Match=first.headers["ETag"]).status == 304
        assert site.ask(path, "HEAD").body == b""


def test_the_page_loads_nothing_from_other_hosts() -> None:
    folder = files("mav_robot_status.publishers.web") / "assets"
    for asset in folder.iterdir():
        text = asset.read_text("utf-8")
        assert not [u for u in re.findall(r"https?://[^\s\"')]+", text) if u != "http://www.w3.org/2000/svg"]
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(|style=\"|\son[a-z]+=\"", text
        )
        for name in re.findall(r"(?:from |href=|src=)\"(?:\./)?([\w.]+\.(?:js|css|svg))\"", text):
            assert (folder / name).is_file() or name in GENERATED


def test_a_change_is_sent_as_an_event() -> None:
    with Site() as site:
        site.take(msg(MANUAL))
        listening = site.listen("/events?handle=robot")
        head = listening.head()
        assert "200 OK" in head
        assert "Content-Type: text/event-stream" in head
        names = [name for name, _ in islice(listening.events(), 3)]
        assert names == ["board", "about", "history"]
        start = time.monotonic()
        site.take(msg(AUTO))
        data = next(data for name, data in listening.events() if name == "change" and data["vehicles"])
        assert data["vehicles"][0]["mode"] == "AUTO"
        assert in_time(time.monotonic() - start, 1.0)
        listening.close()
        until(lambda: not site.server._events.listeners)


def test_an_acknowledgement_is_kept_and_no_other_site_can_send_one() -> None:
    with Site(token="correct-horse-battery") as site:
        site.take(msg(MANUAL._replace(e_stopped=TriState.TRUE)))
        ours = {"X_Requested_With": "page", "Authorization": "Bearer correct-horse-battery"}
        path = "/api/v1/acknowledge?handle=robot"
        assert site.ask(path, "POST", X_Requested_With="page").status == 401
        assert site.ask(path, "POST", Authorization=ours["Authorization"]).status == 403
        assert site.ask(path, "GET", **ours).status == 405
        assert site.ask("/api/v1/vehicles", "POST", **ours).status == 405
        assert len(site.server.board.alarms.pending) == 1
        assert site.ask(path, "POST", **ours).status == 204
        assert not site.server.board.alarms.pending


def test_the_wall_is_the_same_page() -> None:
    with Site() as site:
        assert site.ask("/wall").body == site.ask("/").body
        assert b'<symbol id="stop"' in site.ask("/").body


def test_the_head_of_the_stream_has_an_end() -> None:
    with Site() as site:
        asked = site.ask("/events", "HEAD")
        assert (asked.status, asked.headers["Content-Type"], asked.body) == (200, "text/event-stream", b"")
        assert asked.headers["X-Accel-Buffering"] == "no"
        assert asked.headers["Content-Length"] is None
        until(lambda: not site.server._events.listeners)


def test_a_listener_beyond_the_limit_gets_503_with_retry_after(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "MOST_LISTENERS", 1)
    with Site() as site:
        first = site.listen()
        next(first.events())
        refused = site.ask("/events")
        assert (refused.status, refused.headers["Retry-After"]) == (503, "10")
        first.close()


def test_a_dead_browser_is_disconnected_and_the_others_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "PATIENCE", 0.3)
    with Site() as site:
        dead, alive = site.listen(), site.listen()
        long = "x" * 200_000
        until(lambda: len(site.server._events.listeners) == 2)
        reading = alive.events()
        number = 0
        while not site.server._events.dropped:
            site.take(msg(AUTO, handle=f"{number}{long}"))
            next(data for name, data in reading if name == "change")
            number += 1
            assert number < 500
        until(lambda: len(site.server._events.listeners) == 1)
        dead.close()
        alive.close()


def test_it_accepts_one_change_at_a_time() -> None:
    with Site() as site:
        began: list[int] = []

        def slow(board: Board, events: object, now: Instant) -> None:
            began.append(len(began))
            time.sleep(0.2)

        assert site.server.post(slow)
        until(lambda: began == [0])
        assert site.server.post(slow)  # the first runs, the second waits
        assert not site.server.post(slow)
        until(lambda: began == [0, 1])
