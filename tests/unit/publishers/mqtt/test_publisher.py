"""The publisher without a broker: its events wait on disk. tests/system has a real broker."""

from __future__ import annotations

import io
import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError
from mav_robot_status.interface import Detail, LinkState, PublisherContext, RobotMode, RobotStatus, RobotStatusMsg
from mav_robot_status.publishers.mqtt.journal import Journal
from mav_robot_status.publishers.mqtt.publisher import MqttPublisher
from mav_robot_status.publishers.mqtt.spool import Event

from ..port import Port

MANUAL, AUTO = RobotStatus(mode=RobotMode.MANUAL), RobotStatus(mode=RobotMode.AUTO)
NOBODY = "mqtt://127.0.0.1:1/robots"


def msg(status: RobotStatus, handle: str = "rover", system: int | None = 1) -> RobotStatusMsg:
    return RobotStatusMsg(handle, 0, status, Detail(system, 1), None)


@pytest.fixture
def spool(tmp_path: Path) -> Path:
    return tmp_path / "spool.sqlite"


@pytest.fixture
def publish(spool: Path) -> Callable[..., list[dict[str, Any]]]:
    """Publish at these times; return the events that wait at the end."""

    def run(*messages: RobotStatusMsg, patient: bool = False, **options: object) -> list[dict[str, Any]]:
        asked = {"url": NOBODY, "spool": str(spool), "robot": "r{system}", **options}
        publisher = MqttPublisher(PublisherContext(asked, Port(), io.StringIO(), patient))
        for number, message in enumerate(messages):
            assert not publisher.busy()
            publisher.publish(message)
            publisher.service(Instant(float(number), number * 1_000_000))
        publisher.close()
        if not spool.exists():
            return []
        with closing(sqlite3.connect(spool)) as db:
            return [json.loads(text) for (text,) in db.execute("SELECT text FROM events ORDER BY place")]

    return run


def test_each_change_is_one_event_and_a_repetition_is_not(publish: Callable[..., list[dict[str, Any]]]) -> None:
    events = publish(msg(MANUAL), msg(MANUAL), msg(AUTO), msg(MANUAL))
    assert [event["seq"] for event in events] == [1, 2, 3]
    assert [event["changed"]["mode"]["new"] for event in events] == ["MANUAL", "AUTO", "MANUAL"]
    assert len({event["session"] for event in events}) == 1


def test_each_run_has_its_own_session(publish: Callable[..., list[dict[str, Any]]]) -> None:
    publish(msg(MANUAL))
    events = publish(msg(MANUAL))
    assert len({event["session"] for event in events}) == 2
    assert len({event["id"] for event in events}) == 2


def test_each_robot_has_its_own_events(publish: Callable[..., list[dict[str, Any]]]) -> None:
    events = publish(msg(MANUAL), msg(AUTO, "other", 2), msg(AUTO))
    assert [(event["robot"], event["seq"]) for event in events] == [("r1", 1), ("r2", 1), ("r1", 2)]


def test_a_second_robot_of_the_same_name_is_not_published(
    publish: Callable[..., list[dict[str, Any]]], caplog: pytest.LogCaptureFixture
) -> None:
    events = publish(msg(MANUAL), msg(AUTO, "other"), msg(MANUAL, "other"))
    assert [event["handle"] for event in events] == ["rover"]
    assert caplog.text.count("both have the robot name 'r1'") == 1


def test_a_robot_is_published_once_it_has_a_name(publish: Callable[..., list[dict[str, Any]]]) -> None:
    unheard = msg(MANUAL, system=None)
    unheard = unheard._replace(detail=unheard.detail._replace(link=LinkState.NEVER_SEEN))
    assert [event["system"] for event in publish(unheard, msg(MANUAL))] == [1]


def test_an_event_is_on_the_disk_when_publish_returns(spool: Path) -> None:
    options = {"url": NOBODY, "spool": str(spool), "robot": "r{system}"}
    with closing(MqttPublisher(PublisherContext(options, Port(), io.StringIO()))) as publisher:
        for number, status in enumerate((MANUAL, AUTO, MANUAL), start=1):
            publisher.publish(msg(status))
            with closing(Journal(f"{spool}-new", 0)) as as_after_a_kill:
                assert [json.loads(event.text)["seq"] for event in as_after_a_kill.left] == list(range(1, number + 1))


def test_events_left_in_the_journal_by_a_kill_come_first_in_the_next_run(
    publish: Callable[..., list[dict[str, Any]]], spool: Path
) -> None:
    assert [event["seq"] for event in publish(msg(MANUAL))] == [1]
    with closing(Journal(f"{spool}-new", 1)) as killed:
        killed.append(Event(2, "r1", 0.0, '{"seq": 2}'))
    assert [event["seq"] for event in publish(msg(AUTO), msg(MANUAL))] == [1, 2, 1, 2]


def test_the_last_status_of_a_round_with_a_change_is_published(spool: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"url": NOBODY, "spool": str(spool), "robot": "r{system}"}
    with closing(MqttPublisher(PublisherContext(options, Port(), io.StringIO()))) as publisher:
        told: list[RobotMode] = []
        assert publisher._worker is not None
        monkeypatch.setattr(
            publisher._worker, "hand_over", lambda new: told.extend(m.status.mode for m in new.values())
        )
        for status in (MANUAL, AUTO, AUTO):
            publisher.publish(msg(status))
        publisher.service(Instant(0.0, 0))
        assert told == [RobotMode.AUTO]


def test_a_replay_publishes_nothing(publish: Callable[..., list[dict[str, Any]]], spool: Path) -> None:
    assert publish(msg(MANUAL), patient=True) == []
    assert not spool.exists()


def test_a_wrong_option_is_an_error_before_anything_starts(publish: Callable[..., list[dict[str, Any]]]) -> None:
    with pytest.raises(UsageError, match="unknown option 'topic'"):
        publish(topic="x")
