from __future__ import annotations

import io
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.interface import (
    Detail,
    Inhibit,
    LinkState,
    PublisherContext,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
)
from mav_robot_status.publishers.mavlink import MavlinkPublisher, message_of

SEEN = Detail(1, 1)


class Port:
    def __init__(self) -> None:
        self.sent: list[tuple[Any, int]] = []

    def send(self, message: Any, system: int) -> None:
        self.sent.append((message, system))


@pytest.fixture
def port() -> Port:
    return Port()


@pytest.fixture
def publisher(port: Port) -> MavlinkPublisher:
    return MavlinkPublisher(PublisherContext({}, port, io.StringIO()))


def msg(code: int = 0, detail: Detail = SEEN, handle: str = "robot") -> RobotStatusMsg:
    return RobotStatusMsg(handle, 1_000_000, RobotStatus(error_code=code), detail, 0.1)


def publish(publisher: MavlinkPublisher, at: float, message: RobotStatusMsg) -> float | None:
    publisher.publish(message)
    return publisher.service(Instant(at, 0))


def test_a_message_says_all_of_a_status() -> None:
    status = RobotStatus(
        RobotMode.AUTO, TriState.UNKNOWN, TriState.TRUE, TriState.FALSE, TriState.TRUE, TriState.TRUE, 9
    )
    detail = Detail(4, 1, inhibits=(Inhibit(1, "DISARMED", None, 0), Inhibit(4, "PREARM_FAILING", "x", 0)))
    message = message_of(RobotStatusMsg("robot", 77, status, detail, None))
    assert message == (77, 9, 0b10010, 4, 1, 2, -1, 1, 0, 1, 1)


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7])
def test_any_rate_is_thinned_to_1_hz_on_average(publisher: MavlinkPublisher, port: Port, period: float) -> None:
    for tick in range(round(60 / period)):
        publish(publisher, tick * period, msg())
    assert len(port.sent) == pytest.approx(60, abs=1)


def test_a_change_goes_out_at_once_and_at_most_5_a_second_with_the_last_always_sent(
    publisher: MavlinkPublisher, port: Port
) -> None:
    publish(publisher, 0.0, msg())
    for number in range(1, 20):
        again = publish(publisher, number * 0.01, msg(number))
    assert [m.error_code for m, _ in port.sent] == [0, 1, 2, 3, 4, 5]
    assert again == 1.0
    assert publisher.service(Instant(again, 0)) is None
    assert port.sent[-1][0].error_code == 19


def test_after_a_pause_the_phase_begins_anew(publisher: MavlinkPublisher, port: Port) -> None:
    for at in (0.0, 60.0, 60.5, 60.9):
        publish(publisher, at, msg())
    assert len(port.sent) == 2


def test_of_a_vehicle_never_heard_nothing_is_said(publisher: MavlinkPublisher, port: Port) -> None:
    assert publish(publisher, 0.0, msg(detail=Detail(5, None, link=LinkState.NEVER_SEEN))) is None
    assert publish(publisher, 0.1, msg(detail=Detail(None, None))) is None
    assert port.sent == []


def test_a_lost_vehicle_is_still_spoken_of(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg(detail=Detail(5, 1, link=LinkState.LOST)))
    assert [system for _, system in port.sent] == [5]


def test_handles_are_thinned_each_for_itself(publisher: MavlinkPublisher, port: Port) -> None:
    publisher.publish(msg(handle="a"))
    publisher.publish(msg(handle="b", detail=Detail(2, 1)))
    publisher.service(Instant(0.0, 0))
    assert [system for _, system in port.sent] == [1, 2]
    assert not publisher.busy()
    publisher.close()
