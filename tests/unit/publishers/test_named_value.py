from __future__ import annotations

import io
from itertools import pairwise

import pytest

from mav_robot_status.interface import Audience, Detail, LinkState, PublisherContext, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink.decode import text
from mav_robot_status.mavlink.definitions import NamedValueInt, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.publishers.named_value import NamedValuePublisher, packed, text_of

from .port import Port, Sent, msg, publish, run

DRIVING = RobotStatus(
    mode=RobotMode.AUTO,
    e_stopped=TriState.UNKNOWN,
    drives_powered=TriState.TRUE,
    motion_possible=TriState.TRUE,
    in_motion=TriState.TRUE,
    in_error=TriState.FALSE,
    error_code=0,
)
STANDING = DRIVING._replace(in_motion=TriState.FALSE)
PARKED = STANDING._replace(mode=RobotMode.MANUAL, motion_possible=TriState.FALSE)
FAILING = DRIVING._replace(in_error=TriState.TRUE, error_code=4001)


@pytest.fixture
def port() -> Port:
    return Port(Audience("out", mirror=True), Audience("vehicle"))


@pytest.fixture
def mirror(port: Port) -> NamedValuePublisher:
    return NamedValuePublisher(PublisherContext({}, port, io.StringIO()))


def values(sent: list[Sent]) -> list[tuple[str, int]]:
    return [(text(s.message.name), s.message.value) for s in sent if isinstance(s.message, NamedValueInt)]


def test_a_group_is_not_taken_for_the_vehicle_whose_system_id_it_has(port: Port, mirror: NamedValuePublisher) -> None:
    stopped = RobotStatus(e_stopped=TriState.TRUE)
    group = msg(stopped, Detail(1, 192, members=("rover", "arm")), "robot")
    publish(mirror, 0.0, group, msg(DRIVING, handle="rover"))
    assert values(port.taken()) == [("RS_STATE", packed(DRIVING)), ("RS_ERROR", 0)]
    publish(mirror, 10.0, group)
    assert port.taken() == []


def test_autopilots_with_one_system_id_have_one_status_of_what_they_agree_on(
    port: Port, mirror: NamedValuePublisher
) -> None:
    """A ground station knows the values by the system id alone, and keeps the last one."""
    parked = DRIVING._replace(drives_powered=TriState.FALSE, motion_possible=TriState.FALSE, e_stopped=TriState.FALSE)
    both = msg(DRIVING, Detail(1, 1), "one"), msg(parked, Detail(1, 2), "two")
    publish(mirror, 0.0, *both)
    agreed = RobotStatus(RobotMode.AUTO, in_motion=TriState.TRUE, in_error=TriState.FALSE)
    assert {value for name, value in values(port.taken()) if name == "RS_STATE"} == {packed(agreed)}
    publish(mirror, 10.0, both[0], msg(parked._replace(in_error=TriState.TRUE, error_code=4001), Detail(1, 2), "two"))
    sent = values(port.taken())
    assert ("RS_ERROR", 4001) in sent
    assert {value for name, value in sent if name == "RS_STATE"} == {packed(agreed._replace(in_error=TriState.TRUE))}


def texts(sent: list[Sent]) -> list[tuple[int, str]]:
    return [(s.message.severity, text(s.message.text)) for s in sent if isinstance(s.message, Statustext)]


@pytest.mark.parametrize(
    ("status", "word"),
    [
        (RobotStatus(), 0),
        (RobotStatus(mode=RobotMode.MANUAL), 0b10),
        (RobotStatus(mode=RobotMode.AUTO), 0b11),
        (RobotStatus(e_stopped=TriState.TRUE), 0b10_00),
        (RobotStatus(drives_powered=TriState.TRUE), 0b10_00_00),
        (RobotStatus(motion_possible=TriState.TRUE), 0b10_00_00_00),
        (RobotStatus(in_motion=TriState.TRUE), 0b10_00_00_00_00),
        (RobotStatus(in_error=TriState.TRUE), 0b10_00_00_00_00_00),
        (DRIVING, 0b01_10_10_10_00_11),
    ],
)
def test_rs_state_has_two_bits_for_each_field(status: RobotStatus, word: int) -> None:
    assert packed(status) == word


@pytest.mark.parametrize(
    ("status", "line"),
    [
        (DRIVING, "RS: AUTO drv=1 mot=1 poss=1 es=? err=0"),
        (PARKED._replace(e_stopped=TriState.TRUE), "RS: MANUAL drv=1 mot=0 poss=0 es=1 err=0"),
        (FAILING, "RS: AUTO drv=1 mot=1 poss=1 es=? err=4001"),
        (RobotStatus(), "RS: UNKNOWN drv=? mot=? poss=? es=? err=?"),
    ],
)
def test_a_text_has_all_fields_in_one_line(status: RobotStatus, line: str) -> None:
    assert text_of(status) == line


def test_the_longest_text_fits_one_statustext() -> None:
    assert len(text_of(RobotStatus(in_error=TriState.TRUE, error_code=-(2**31)))) == 50


def test_messages_go_to_ground_stations_and_not_to_the_vehicle(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING, Detail(7, 1)))
    assert values(port.sent) == [("RS_STATE", packed(DRIVING)), ("RS_ERROR", 0)]
    assert texts(port.sent) == [(6, text_of(DRIVING))]
    assert {(s.key, s.system) for s in port.sent} == {("out", 7)}


def test_messages_fit_their_frames(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 5_000_000.0, msg(FAILING))  # 58 days
    assert len(port.sent) == 3
    for sent in port.sent:
        encode(sent.message, system=1, component=192, sequence=0)


def test_values_have_the_time_of_the_gateway_in_milliseconds(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 12.3456, msg(DRIVING))
    assert [s.message.time_boot_ms for s in port.sent[:2]] == [12345, 12345]


def test_values_are_sent_every_2_s_and_a_text_only_once(mirror: NamedValuePublisher, port: Port) -> None:
    run(mirror, 20.0, status=DRIVING)
    assert len(values(port.sent)) == 2 * 11
    assert len(texts(port.sent)) == 1


def test_changed_values_are_sent_at_once_and_at_most_5_times_a_second(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    for number in range(1, 20):
        again = publish(mirror, number * 0.01, msg(FAILING._replace(error_code=number)))
    assert [value for name, value in values(port.taken()) if name == "RS_ERROR"] == [1, 2, 3, 4, 5]
    assert again == 1.01
    publish(mirror, again)
    assert values(port.sent)[-1] == ("RS_ERROR", 19)


def test_a_change_of_motion_or_power_sends_values_and_no_text(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    publish(mirror, 10.0, msg(STANDING))
    publish(mirror, 20.0, msg(STANDING._replace(drives_powered=TriState.UNKNOWN)))
    assert len(values(port.sent)) == 4
    assert texts(port.sent) == []


@pytest.mark.parametrize(
    "changed",
    [
        DRIVING._replace(mode=RobotMode.MANUAL),
        DRIVING._replace(e_stopped=TriState.FALSE),
        DRIVING._replace(motion_possible=TriState.UNKNOWN),
        DRIVING._replace(in_error=TriState.UNKNOWN),
    ],
)
def test_a_change_of_an_announced_field_sends_a_text(
    mirror: NamedValuePublisher, port: Port, changed: RobotStatus
) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    publish(mirror, 2.0, msg(changed))
    assert texts(port.sent) == [(6, text_of(changed))]


def test_a_text_is_a_warning_only_when_an_error_begins(mirror: NamedValuePublisher, port: Port) -> None:
    stopped = FAILING._replace(motion_possible=TriState.FALSE)
    for at, status in enumerate((DRIVING, FAILING, stopped, DRIVING, FAILING)):
        publish(mirror, at * 2.0, msg(status))
    assert [severity for severity, _ in texts(port.sent)] == [6, 4, 6, 6, 4]


def test_an_error_in_the_first_status_is_a_warning(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(FAILING))
    assert texts(port.sent) == [(4, text_of(FAILING))]


def test_at_most_one_text_is_sent_in_2_s_and_the_last_state_is_always_sent(
    mirror: NamedValuePublisher, port: Port
) -> None:
    at: list[float] = []
    for tick in range(100):
        publish(mirror, tick * 0.1, msg((DRIVING, PARKED)[tick % 2]))
        at += [tick * 0.1] * len(texts(port.taken()))
    assert len(at) > 3
    assert all(later - earlier >= 2.0 for earlier, later in pairwise(at))
    again = publish(mirror, 10.0, msg(FAILING))
    assert again is not None
    while again is not None:
        port.taken()
        again = publish(mirror, again)
    assert texts(port.sent) == [(4, text_of(FAILING))]


def test_a_state_that_ends_while_it_is_delayed_is_not_sent(mirror: NamedValuePublisher, port: Port) -> None:
    for at, status in ((0.0, DRIVING), (0.5, FAILING), (1.0, DRIVING)):
        publish(mirror, at, msg(status))
    publish(mirror, 2.5, msg(DRIVING))
    assert texts(port.sent) == [(6, text_of(DRIVING))]


def test_messages_about_a_vehicle_have_its_system_id(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING), msg(FAILING, Detail(9, 1), handle="other"))
    assert texts([s for s in port.sent if s.system == 1]) == [(6, text_of(DRIVING))]
    assert values([s for s in port.sent if s.system == 9])[1] == ("RS_ERROR", 4001)


def test_a_new_ground_station_gets_the_last_status_at_once(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    port.present.append(Audience("late", mirror=True))
    publish(mirror, 0.1)
    assert [s.key for s in port.sent] == ["late"] * 3


def test_a_lost_vehicle_is_sent_and_one_without_a_heartbeat_is_not(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(detail=Detail(1, None, link=LinkState.NEVER_SEEN)))
    assert port.sent == []
    publish(mirror, 0.1, msg(detail=Detail(1, 1, link=LinkState.LOST)))
    assert texts(port.sent) == [(6, "RS: UNKNOWN drv=? mot=? poss=? es=? err=?")]


def test_requests_for_robot_status_do_not_affect_named_values(mirror: NamedValuePublisher, port: Port) -> None:
    port.present = [Audience("out", float("inf"), mirror=True)]
    port.asked = [("out", 1)]
    publish(mirror, 0.0, msg(DRIVING))
    assert len(port.sent) == 3
    assert port.requests() == [("out", 1)]
