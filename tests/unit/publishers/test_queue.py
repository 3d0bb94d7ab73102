from __future__ import annotations

import io
import threading

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.replay import NoMavlinkPort
from mav_robot_status.interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg
from mav_robot_status.publishers import queue
from mav_robot_status.publishers.queue import QueuePublisher

from ...deadline import allow


def made(patient: bool = False) -> QueuePublisher:
    return QueuePublisher(PublisherContext({}, NoMavlinkPort(), io.StringIO(), patient))


def msg(number: int) -> RobotStatusMsg:
    return RobotStatusMsg("robot", number, RobotStatus(), Detail(), None)


def test_messages_are_read_in_the_order_of_publication() -> None:
    publisher = made()
    for number in range(3):
        publisher.publish(msg(number))
    publisher.close()
    publisher.end()
    taken = [publisher.take() for _ in range(4)]
    assert [m.unix_us if m else None for m in taken] == [0, 1, 2, None]


def test_a_full_queue_drops_its_oldest_message_and_counts_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queue, "MAX_MESSAGES", 2)
    publisher = made()
    for number in range(5):
        publisher.publish(msg(number))
    assert publisher.dropped == 3
    assert publisher.take() == msg(3)


def test_a_replay_waits_for_its_reader_and_drops_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queue, "MAX_MESSAGES", 2)
    publisher = made(patient=True)

    def write() -> None:
        for number in range(50):
            publisher.publish(msg(number))

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    assert [publisher.take() for _ in range(50)] == [msg(number) for number in range(50)]
    writer.join(allow(5))
    assert not writer.is_alive()
    assert publisher.dropped == 0


def test_end_wakes_the_reader_and_the_writer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queue, "MAX_MESSAGES", 1)
    publisher, empty = made(patient=True), made()
    publisher.publish(msg(0))
    writer = threading.Thread(target=publisher.publish, args=(msg(1),), daemon=True)
    reader = threading.Thread(target=empty.take, daemon=True)
    for thread in (writer, reader):
        thread.start()
    for one in (publisher, empty):
        one.end()
    for thread in (writer, reader):
        thread.join(allow(5))
        assert not thread.is_alive()


def test_it_has_no_options() -> None:
    with pytest.raises(UsageError, match="queue: unknown option 'size'"):
        QueuePublisher(PublisherContext({"size": 3}, NoMavlinkPort(), io.StringIO()))


def test_it_is_never_busy() -> None:
    publisher = made()
    publisher.service(Instant(0.0, 0))
    assert publisher.busy() is False
