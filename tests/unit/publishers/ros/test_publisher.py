from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.errors import UsageError
from mav_robot_status.extras import install
from mav_robot_status.interface import PublisherContext, RobotStatusMsg
from mav_robot_status.publishers.ros import publisher as module
from mav_robot_status.publishers.ros.publisher import Ros2Publisher
from mav_robot_status.publishers.ros.worker import Gone
from mav_robot_status.testing.conformance.publisher import RecordedPort

from .statuses import BLOCKED, MOVABLE, message

EXAMPLE = Path(__file__).parents[4] / "config" / "one_vehicle_udp.yaml"
START = Instant(1000.0, 1_800_000_000_000_000)


class Taken:
    """A worker that remembers what it gets."""

    queued = dropped = 0

    def __init__(self, *_: object) -> None:
        self.items: list[RobotStatusMsg | Gone] = []

    def start(self) -> None:
        pass

    def close(self) -> None:
        pass

    def hand_over(self, items: Sequence[RobotStatusMsg | Gone]) -> None:
        self.items += items


@pytest.fixture(autouse=True)
def _no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "Worker", Taken)
    monkeypatch.setattr(module, "transport_of", lambda settings: None)


def made(**options: object) -> tuple[Ros2Publisher, list[Any]]:
    context = PublisherContext({"url": "dds://0", **options}, RecordedPort(), sys.stdout)
    publisher = Ros2Publisher(context)
    worker: Any = publisher._worker
    return publisher, worker.items


def run(publisher: Ros2Publisher, seconds: float, hertz: float = 10, start: float = 0.0) -> None:
    """A controller that publishes the same status at a rate."""
    for number in range(round(seconds * hertz)):
        publisher.publish(message())
        publisher.service(later(START, start + number / hertz))


@pytest.mark.parametrize(("rate", "expected"), [(1, 10), (3, 30), (10, 100), (0, 1)])
def test_without_a_change_the_rate_is_kept(rate: float, expected: int) -> None:
    publisher, items = made(rate=rate)
    run(publisher, 10)
    assert abs(len(items) - expected) <= 1


def test_every_change_is_handed_over_at_once_and_in_order() -> None:
    publisher, items = made()
    changes = [message(status) for status in (MOVABLE, BLOCKED) * 20]
    for number, msg in enumerate(changes):
        publisher.publish(msg)
        publisher.service(later(START, number / 100))
    assert items == changes


def test_a_change_does_not_move_the_phase() -> None:
    publisher, items = made()
    run(publisher, 1.0)
    publisher.publish(message(BLOCKED))
    publisher.service(later(START, 1.05))
    del items[:]
    publisher.publish(message(BLOCKED))
    publisher.service(later(START, 1.9))
    assert items == []
    publisher.publish(message(BLOCKED))
    publisher.service(later(START, 2.0))
    assert len(items) == 1


def test_two_handles_have_rates_of_their_own() -> None:
    publisher, items = made()
    for name in ("a", "b"):
        publisher.publish(message(handle=name))
    publisher.service(START)
    assert [msg.handle for msg in items] == ["a", "b"]


def test_a_handle_that_is_gone_is_forgotten() -> None:
    publisher, items = made()
    publisher.publish(message())
    publisher.service(START)
    publisher.publish(message())
    publisher.forget("rover")
    publisher.service(later(START, 5))
    assert items == [message(), Gone("rover")]


def test_changes_only() -> None:
    assert not made(rate=0)[0].periodic


@pytest.mark.parametrize(
    ("url", "library", "extra"), [("zenoh://127.0.0.1", "zenoh", "ros2"), ("dds://0", "cyclonedds", "ros2-dds")]
)
def test_a_missing_extra_is_one_line_that_says_what_to_install(
    url: str, library: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, library, None)
    for name in ("zenoh", "dds", "dds_types"):
        monkeypatch.delitem(sys.modules, f"mav_robot_status.publishers.ros.{name}", raising=False)
    if library == "cyclonedds":
        for name in [name for name in sys.modules if name.startswith("cyclonedds.")]:
            monkeypatch.delitem(sys.modules, name)
    with pytest.raises(UsageError) as raised:
        made(url=url)
    assert str(raised.value) == f"ros2: this output needs an extra: {install(extra)}"


def test_without_ros2_none_of_its_libraries_is_imported() -> None:
    program = (
        "import sys; from mav_robot_status.cli import main; main(['check-config', sys.argv[1]]);"
        "import mav_robot_status.gateway.event_loop, mav_robot_status.commands.run;"
        "print([name for name in sys.modules if name.partition('.')[0] in ('zenoh', 'cyclonedds', 'rosbags')])"
    )
    command = [sys.executable, "-c", program, str(EXAMPLE)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]"
