from __future__ import annotations

import io
import math

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError
from mav_robot_status.interface import (
    Audience,
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

from .port import SEEN, Port, msg, publish, run

STATION = Audience("station")
ROVER = Audience("rover")


@pytest.fixture
def port() -> Port:
    return Port(STATION)


@pytest.fixture
def publisher(port: Port) -> MavlinkPublisher:
    return MavlinkPublisher(PublisherContext({}, port, io.StringIO()))


def failing(code: int, detail: Detail = SEEN) -> RobotStatusMsg:
    return msg(RobotStatus(error_code=code), detail)


def test_a_message_has_every_field_of_a_status() -> None:
    status = RobotStatus(
        mode=RobotMode.AUTO,
        e_stopped=TriState.UNKNOWN,
        drives_powered=TriState.TRUE,
        motion_possible=TriState.FALSE,
        in_motion=TriState.TRUE,
        in_error=TriState.TRUE,
        error_code=9,
    )
    detail = Detail(4, 1, inhibits=(Inhibit("DISARMED", None, 0), Inhibit("PREARM_FAILING", "x", 0)))
    message = message_of(RobotStatusMsg("robot", 77, status, detail, None))
    assert message == (77, 9, 0b10010, 4, 1, 2, -1, 1, 0, 1, 1)


def test_a_group_and_its_vehicle_are_two_subjects_of_one_system(publisher: MavlinkPublisher, port: Port) -> None:
    stopped = RobotStatus(e_stopped=TriState.TRUE, motion_possible=TriState.FALSE)
    stop = Inhibit("E_STOPPED", None, 0, "arm")
    group = msg(stopped, Detail(4, 192, inhibits=(stop,), members=("base", "arm")), "robot")
    base = msg(RobotStatus(e_stopped=TriState.FALSE), Detail(4, 1), "base")
    for at in (0.0, 1.0):
        publish(publisher, at, *(one._replace(unix_us=int(at * 1e6)) for one in (group, base)))
        assert [(s.system, s.message.subject_system, s.message.subject_component, s.message.e_stopped)
                for s in port.taken()] == [(4, 4, 192, 1), (4, 4, 1, 0)]  # fmt: skip
    publish(publisher, 2.0, msg(stopped, Detail(members=("arm", "arm2")), "arms"))
    assert port.taken() == []  # nobody would know whose it is


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7])
def test_any_rate_is_limited_to_1_hz_on_average(publisher: MavlinkPublisher, port: Port, period: float) -> None:
    run(publisher, 60, period)
    assert len(port.sent) == pytest.approx(60, abs=1)


def test_changes_are_sent_at_once_at_most_5_a_second_and_the_last_is_always_sent(
    publisher: MavlinkPublisher, port: Port
) -> None:
    publish(publisher, 0.0, failing(0))
    for number in range(1, 20):
        again = publish(publisher, number * 0.01, failing(number))
    assert [s.message.error_code for s in port.sent] == [0, 1, 2, 3, 4, 5]
    assert again == 1.0
    assert publish(publisher, again) is None
    assert port.sent[-1].message.error_code == 19


def test_after_a_pause_the_phase_restarts(publisher: MavlinkPublisher, port: Port) -> None:
    for at in (0.0, 60.0, 60.5, 60.9):
        publish(publisher, at, msg())
    assert len(port.sent) == 2


def test_nothing_is_sent_before_the_first_heartbeat_of_a_vehicle(publisher: MavlinkPublisher, port: Port) -> None:
    unheard, unnamed = Detail(5, None, link=LinkState.NEVER_SEEN), Detail(None, None)
    port.asked = [("station", 5)]
    assert publish(publisher, 0.0, msg(detail=unheard), msg(detail=unnamed, handle="other")) is None
    assert port.sent == []


def test_a_lost_vehicle_is_still_published(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg(detail=Detail(5, 1, link=LinkState.LOST)))
    assert [s.system for s in port.sent] == [5]


def test_each_handle_has_its_own_rate_limit(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg(handle="a"), msg(handle="b", detail=Detail(2, 1)))
    assert [s.system for s in port.sent] == [1, 2]
    assert not publisher.busy()
    publisher.close()


@pytest.mark.parametrize(("interval", "in_10_s"), [(0.1, 101), (0.25, 41), (0.05, 101), (5.0, 3)])
def test_an_audience_gets_its_interval_but_no_more_than_is_published(
    publisher: MavlinkPublisher, port: Port, interval: float, in_10_s: int
) -> None:
    port.present = [STATION._replace(interval=interval), ROVER]
    run(publisher, 10.0)
    assert [s.key for s in port.sent].count("station") == in_10_s
    assert [s.key for s in port.sent].count("rover") == 11


def test_a_slightly_early_message_is_sent(publisher: MavlinkPublisher, port: Port) -> None:
    port.present = [STATION._replace(interval=0.1)]
    for tick in range(100):
        publish(publisher, tick * 0.1 + (0.006 if tick % 2 == 0 else 0.0), msg())
    assert len(port.sent) == 100


def test_an_audience_with_a_long_interval_still_gets_changes(publisher: MavlinkPublisher, port: Port) -> None:
    port.present = [STATION._replace(interval=60.0)]
    run(publisher, 1.0)
    publish(publisher, 1.1, failing(7))
    assert [s.message.error_code for s in port.sent] == [0, 7]


def test_an_audience_with_messages_disabled_gets_no_changes_either(publisher: MavlinkPublisher, port: Port) -> None:
    port.present = [STATION._replace(interval=math.inf), ROVER]
    run(publisher, 5.0)
    assert publish(publisher, 5.1, failing(7)) is None
    assert {s.key for s in port.sent} == {"rover"}


def test_a_new_audience_gets_the_last_status_at_once(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, failing(7))
    port.taken()
    port.present.append(ROVER)
    publish(publisher, 0.01)
    assert [(s.key, s.message.error_code) for s in port.taken()] == [("rover", 7)]
    publish(publisher, 0.02)
    assert port.sent == []


def test_an_old_message_is_not_repeated(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg())
    port.taken()
    port.present.append(ROVER)
    publish(publisher, 60.0)
    assert [s.key for s in port.sent] == ["rover"]


def test_a_vehicle_that_became_never_seen_is_not_sent_to_a_new_audience(
    publisher: MavlinkPublisher, port: Port
) -> None:
    publish(publisher, 0.0, msg())
    port.taken()
    publish(publisher, 0.1, msg(detail=Detail(1, None, link=LinkState.NEVER_SEEN)))
    port.present.append(ROVER)
    port.asked = [("station", 1)]
    publish(publisher, 0.2)
    assert port.sent == []


@pytest.mark.parametrize("pause", [[], [STATION._replace(interval=math.inf)]])
def test_a_returning_audience_gets_the_last_status_at_once(
    publisher: MavlinkPublisher, port: Port, pause: list[Audience]
) -> None:
    publish(publisher, 0.0, msg())
    port.present = pause
    publish(publisher, 0.1, msg())
    port.taken()
    port.present = [STATION]
    assert publish(publisher, 0.2) == 0.2  # at once, with what the controllers then publish again
    publish(publisher, 0.2, msg()._replace(unix_us=200_000))
    assert [(s.key, s.message.time_usec) for s in port.sent] == [("station", 200_000)]


def test_without_an_audience_no_periodic_messages_are_taken(publisher: MavlinkPublisher, port: Port) -> None:
    taken = []
    for number, present in enumerate([[STATION], [], [STATION._replace(interval=math.inf)], [STATION]]):
        port.present = list(present)
        publish(publisher, float(number))
        taken.append(publisher.periodic)
    assert taken == [True, False, False, True]


def test_the_state_of_a_gone_audience_is_deleted(publisher: MavlinkPublisher, port: Port) -> None:
    for number in range(100):
        port.present = [Audience(number)]
        publish(publisher, number * 0.1, msg())
    assert len(port.sent) == 100
    assert list(publisher._states) == [99]


def test_each_audience_has_its_own_limit_on_changes(publisher: MavlinkPublisher, port: Port) -> None:
    for number in range(6):
        publish(publisher, number * 0.01, failing(number))
    port.taken()
    port.present.append(ROVER)
    assert publish(publisher, 0.1, failing(6)) == 0.1  # the controllers ask again how long it rests
    assert publish(publisher, 0.1) == 1.0
    assert [s.key for s in port.taken()] == ["rover"]
    publish(publisher, 1.0)
    assert [(s.key, s.message.error_code) for s in port.sent] == [("station", 6)]


def test_it_rests_until_the_first_audience_is_due(publisher: MavlinkPublisher, port: Port) -> None:
    assert publisher.rests_until("robot") == -math.inf
    port.present = [STATION, ROVER._replace(interval=0.5)]
    publish(publisher, 0.0, msg())
    assert publisher.rests_until("robot") == pytest.approx(0.5, abs=0.02)
    publish(publisher, 0.5, msg())
    assert publisher.rests_until("robot") == pytest.approx(1.0, abs=0.02)
    assert publisher.rests_until("other") == -math.inf


def test_it_rests_for_a_second_at_most(publisher: MavlinkPublisher, port: Port) -> None:
    port.present = [STATION._replace(interval=60.0)]
    publish(publisher, 0.0, msg())
    assert publisher.rests_until("robot") == 1.0


def test_it_rests_while_no_audience_gets_this_vehicle(publisher: MavlinkPublisher, port: Port) -> None:
    port.present = [STATION._replace(systems=frozenset({9}))]
    publish(publisher, 0.0, msg())
    assert publisher.rests_until("robot") == 1.0
    assert not port.sent


def test_it_does_not_rest_while_a_change_waits(publisher: MavlinkPublisher) -> None:
    for number in range(7):
        publish(publisher, number * 0.01, failing(number))
    assert publisher.rests_until("robot") == -math.inf


def test_a_new_audience_ends_the_rest(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg())
    port.present = [STATION._replace(interval=0.1)]
    assert publish(publisher, 0.05) == 0.05
    publish(publisher, 0.1, msg())
    assert publisher.rests_until("robot") == pytest.approx(0.2, abs=0.02)


def test_the_answer_to_a_request_has_the_time_of_its_status(publisher: MavlinkPublisher, port: Port) -> None:
    """A controller that publishes seldom has no present status."""
    publish(publisher, 0.0, msg()._replace(unix_us=300_000))
    port.taken()
    port.asked = [("station", 1)]
    publisher.service(Instant(7.0, 7_000_000))
    assert [sent.message.time_usec for sent in port.taken()] == [300_000]


@pytest.mark.parametrize("interval", [None, math.inf])
def test_a_single_request_is_answered_once_and_at_once(
    publisher: MavlinkPublisher, port: Port, interval: float | None
) -> None:
    port.present = [STATION._replace(interval=interval), ROVER]
    publish(publisher, 0.0, failing(7), msg(detail=Detail(2, 1), handle="other"))
    port.taken()
    port.asked = [("station", 1)]
    publish(publisher, 0.01)
    publish(publisher, 0.02)
    assert [(s.key, s.system, s.message.error_code) for s in port.sent] == [("station", 1, 7)]


def test_a_request_of_a_gone_audience_is_not_answered(publisher: MavlinkPublisher, port: Port) -> None:
    publish(publisher, 0.0, msg())
    port.taken()
    port.asked = [("gone", 1), ("station", 9)]
    publish(publisher, 0.01)
    assert port.sent == []


def test_an_option_is_an_error(port: Port) -> None:
    with pytest.raises(UsageError, match="mavlink: unknown option 'rate'; there are none"):
        MavlinkPublisher(PublisherContext({"rate": 5}, port, io.StringIO()))
