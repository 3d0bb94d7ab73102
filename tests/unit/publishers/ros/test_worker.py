"""The worker with a transport that a test can take away, and a clock that only a test advances."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.interface import Detail, LinkState, NotReady
from mav_robot_status.publishers.ros import worker as module
from mav_robot_status.publishers.ros.messages import HARDWARE_STATUS, ROBOT_STATUS, hardware_status, robot_status
from mav_robot_status.publishers.ros.settings import DDS, Ros2Settings
from mav_robot_status.publishers.ros.transport import Sample, UnreachableError
from mav_robot_status.publishers.ros.worker import LONGEST_WAIT, STEADY, Gone, Worker, unknown
from mav_robot_status.testing import ManualClock

from ....deadline import wait_until
from .statuses import BLOCKED, FAILING, MOVABLE, RADIO, message

SETTINGS = Ros2Settings(DDS, 0)


class Network:
    """A transport that remembers what it sends."""

    def __init__(self) -> None:
        self.away: str | None = None
        self.breaks: Exception | None = None
        self.gate = threading.Event()
        self.gate.set()
        self.waits = 0
        self.sent: list[Sample] = []
        self.removed: list[str] = []
        self.opened = self.closed = 0

    def open(self) -> None:
        if self.away is not None:
            raise UnreachableError(self.away)
        self.opened += 1

    def lost(self) -> str | None:
        return None if self.away is None else "connection lost"

    def send(self, sample: Sample) -> None:
        if not self.gate.is_set():
            self.waits += 1
            self.gate.wait()
        if self.breaks is not None:
            raise self.breaks
        self.sent.append(sample)

    def remove(self, topic: str) -> None:
        self.removed.append(topic)

    def close(self) -> None:
        self.closed += 1

    @property
    def statuses(self) -> list[bytes]:
        return [sample.payload for sample in list(self.sent) if sample.type is ROBOT_STATUS]

    def wait_for(self, *payloads: bytes) -> None:
        wait_until(lambda: self.statuses[-len(payloads) :] == list(payloads), what=f"{self.statuses} {payloads}")


@pytest.fixture
def network() -> Network:
    return Network()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def worker(network: Network, clock: ManualClock) -> Iterator[Worker]:
    made = Worker(network, SETTINGS, clock)
    made.start()
    yield made
    network.gate.set()
    made.close()


MESSAGES = [message(status, unix_us=number) for number, status in enumerate([MOVABLE, BLOCKED, FAILING, MOVABLE] * 20)]
BYTES = [robot_status(msg) for msg in MESSAGES]


def test_every_message_is_sent_in_its_order(worker: Worker, network: Network) -> None:
    for msg in MESSAGES:
        worker.hand_over([msg])
    network.wait_for(*BYTES)
    assert {sample.topic for sample in network.sent} == {"/rover/robot_status", "/diagnostics"}
    assert worker.dropped == 0


def test_while_the_network_is_away_only_the_last_message_of_each_handle_is_kept(
    worker: Worker, network: Network, clock: ManualClock
) -> None:
    network.away = "no answer"
    worker.hand_over(MESSAGES)
    worker.hand_over([message(FAILING, RADIO, handle="other")])
    wait_until(lambda: worker.dropped == len(MESSAGES) - 1 and not worker.queued)
    network.away = None
    clock.advance(2 * LONGEST_WAIT)
    worker.hand_over([])
    network.wait_for(robot_status(message(FAILING, RADIO, handle="other")), BYTES[-1])
    assert worker.dropped == len(MESSAGES) - 1


def test_a_lost_connection_is_opened_again_at_once_and_later_messages_are_sent(
    worker: Worker, network: Network
) -> None:
    worker.hand_over(MESSAGES[:1])
    network.wait_for(BYTES[0])
    lost, network.lost = network.lost, lambda: "connection lost"  # type: ignore[method-assign]
    worker.hand_over([])
    wait_until(lambda: network.opened > 1)
    network.lost = lost  # type: ignore[method-assign]
    network.wait_for(BYTES[0], BYTES[0])  # it may not have arrived
    worker.hand_over(MESSAGES[1:2])
    network.wait_for(BYTES[0], BYTES[1])


def test_a_message_that_could_not_be_sent_is_sent_again(worker: Worker, network: Network, clock: ManualClock) -> None:
    network.breaks = UnreachableError("cannot publish")
    worker.hand_over(MESSAGES[:1])
    wait_until(lambda: network.closed)
    network.breaks = None
    clock.advance(2 * LONGEST_WAIT)
    worker.hand_over([])
    network.wait_for(BYTES[0])
    assert worker.dropped == 0


def test_each_reason_is_logged_once_and_so_is_the_end(
    worker: Worker, network: Network, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    network.away = "no answer"
    for msg in MESSAGES[:5]:
        worker.hand_over([msg])
        clock.advance(2 * LONGEST_WAIT)
        wait_until(lambda: not worker.queued)
    network.away = None
    _until(lambda: network.opened, worker, clock)
    _until(lambda: len(caplog.messages) > 1, worker, clock)
    assert caplog.messages == [
        "ros2: DDS domain 0: no answer; trying again",
        "ros2: DDS domain 0: connected again",
    ]


def _until(found: Callable[[], object], worker: Worker, clock: ManualClock) -> None:
    """Let time pass for the worker until something is true."""

    def passed() -> bool:
        clock.advance(STEADY)
        worker.hand_over([])
        return bool(found())

    wait_until(passed)


def test_a_full_queue_loses_its_oldest_messages_counted_and_logged_once(
    worker: Worker, network: Network, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "MOST_QUEUED", 10)
    network.gate.clear()
    worker.hand_over(MESSAGES[:1])
    wait_until(lambda: network.waits)
    for msg in MESSAGES[1:]:
        worker.hand_over([msg])
    assert worker.queued == 10
    assert worker.dropped == len(MESSAGES) - 11
    assert [text for text in caplog.messages if "oldest" in text] == [
        "ros2: more messages come than can be published: the oldest ones are dropped"
    ]
    network.gate.set()
    network.wait_for(BYTES[0], *BYTES[-10:])


def test_a_network_that_takes_nothing_for_long_counts_as_lost(
    worker: Worker, network: Network, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    network.gate.clear()
    worker.hand_over(MESSAGES[:1])
    wait_until(lambda: network.waits)
    clock.advance(5)
    network.gate.set()
    wait_until(lambda: network.closed)
    assert caplog.messages == ["ros2: DDS domain 0: it does not read what is sent; trying again"]


def test_the_topic_of_a_handle_that_is_gone_is_removed(worker: Worker, network: Network) -> None:
    worker.hand_over([MESSAGES[0], Gone("rover"), Gone("nobody")])
    wait_until(lambda: network.removed)
    assert network.removed == ["/rover/robot_status"]


def test_the_hardware_status_of_a_group_is_that_of_its_members_and_unknown_at_the_end(
    network: Network, clock: ManualClock
) -> None:
    arm, robot = message(handle="arm"), message(detail=Detail(members=("arm",)), handle="robot")
    worker = Worker(network, SETTINGS._replace(hardware_status=True), clock)
    worker.start()
    worker.hand_over([arm, robot])
    wait_until(lambda: len(network.sent) == 6)
    topic, kind, payload, _ = network.sent[-1]
    assert (topic, kind, payload) == ("/robot/hardware_status", HARDWARE_STATUS, hardware_status(robot, {"arm": arm}))
    worker.hand_over([Gone("arm")])
    wait_until(lambda: network.removed == ["/arm/robot_status", "/arm/hardware_status"])
    worker.hand_over([arm])
    worker.close()
    last = {sample.topic: sample.payload for sample in network.sent}
    gone = {msg.handle: unknown(msg, clock()) for msg in (arm, robot)}
    assert last["/robot/hardware_status"] == hardware_status(gone["robot"], gone)
    assert gone["robot"].detail.not_ready == (NotReady("arm", "LINK_STALE"),)


def test_at_the_end_every_handle_is_unknown(worker: Worker, network: Network, clock: ManualClock) -> None:
    worker.hand_over(MESSAGES[:2])
    worker.close()
    assert network.statuses == [*BYTES[:2], robot_status(unknown(MESSAGES[1], clock()))]
    assert unknown(MESSAGES[1], clock()).detail.link is LinkState.LOST
    assert network.closed


def test_an_error_in_the_thread_stops_this_output_only(
    worker: Worker, network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    network.breaks = RuntimeError("a bug")
    worker.hand_over(MESSAGES[:1])
    wait_until(lambda: "the output has failed" in caplog.text)
    wait_until(lambda: not worker._thread.is_alive())
    worker.hand_over(MESSAGES)
    assert worker.queued == 0
