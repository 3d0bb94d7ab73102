from __future__ import annotations

import io
from itertools import pairwise

import pytest

from mav_robot_status.interface import (
    Audience,
    Detail,
    LinkState,
    PublisherContext,
    RobotMode,
    RobotStatus,
    TriState,
)
from mav_robot_status.mavlink.decode import text
from mav_robot_status.mavlink.definitions import NamedValueInt, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.publishers.mirror import MirrorPublisher, packed, text_of

from .port import Port, Sent, msg, publish, run

DRIVING = RobotStatus(RobotMode.AUTO, TriState.UNKNOWN, TriState.TRUE, TriState.TRUE, TriState.TRUE, TriState.FALSE, 0)
STANDING = DRIVING._replace(in_motion=TriState.FALSE)
PARKED = STANDING._replace(mode=RobotMode.MANUAL, motion_possible=TriState.FALSE)
FAILING = DRIVING._replace(in_error=TriState.TRUE, error_code=4001)


@pytest.fixture
def port() -> Port:
    return Port(Audience("out", mirror=True), Audience("vehicle"))


@pytest.fixture
def mirror(port: Port) -> MirrorPublisher:
    return MirrorPublisher(PublisherContext({}, port, io.StringIO()))


def values(sent: list[Sent]) -> list[tuple[str, int]]:
    return [(text(s.message.name), s.message.value) for s in sent if isinstance(s.message, NamedValueInt)]


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
def test_a_state_is_one_word_of_two_bits_for_each_field(status: RobotStatus, word: int) -> None:
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
def test_a_text_says_all_fields_in_one_line(status: RobotStatus, line: str) -> None:
    assert text_of(status) == line


def test_the_longest_text_fits_one_statustext() -> None:
    assert len(text_of(RobotStatus(in_error=TriState.TRUE, error_code=-(2**31)))) == 50


def test_everything_goes_to_ground_stations_and_nothing_to_the_vehicle(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING, Detail(7, 1)))
    assert values(port.sent) == [("RS_STATE", packed(DRIVING)), ("RS_ERROR", 0)]
    assert texts(port.sent) == [(6, text_of(DRIVING))]
    assert {(s.key, s.system) for s in port.sent} == {("out", 7)}


def test_what_is_sent_fits_its_frames(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 5_000_000.0, msg(FAILING))  # 58 days
    assert len(port.sent) == 3
    for sent in port.sent:
        encode(sent.message, system=1, component=192, sequence=0)


def test_values_carry_our_own_time_in_milliseconds(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 12.3456, msg(DRIVING))
    assert [s.message.time_boot_ms for s in port.sent[:2]] == [12345, 12345]


def test_values_come_every_2_s_and_a_text_only_once(mirror: MirrorPublisher, port: Port) -> None:
    run(mirror, 20.0, status=DRIVING)
    assert len(values(port.sent)) == 2 * 11
    assert len(texts(port.sent)) == 1


def test_values_come_at_once_on_a_change_and_at_most_5_times_a_second(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    for number in range(1, 20):
        again = publish(mirror, number * 0.01, msg(FAILING._replace(error_code=number)))
    assert [value for name, value in values(port.taken()) if name == "RS_ERROR"] == [1, 2, 3, 4, 5]
    assert again == 1.01
    publish(mirror, again)
    assert values(port.sent)[-1] == ("RS_ERROR", 19)


def test_motion_and_power_change_the_values_and_make_no_text(mirror: MirrorPublisher, port: Port) -> None:
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
def test_a_change_of_what_people_have_to_know_makes_a_text(
    mirror: MirrorPublisher, port: Port, changed: RobotStatus
) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    publish(mirror, 2.0, msg(changed))
    assert texts(port.sent) == [(6, text_of(changed))]


def test_a_text_is_a_warning_when_an_error_begins_and_only_then(mirror: MirrorPublisher, port: Port) -> None:
    stopped = FAILING._replace(motion_possible=TriState.FALSE)
    for at, status in enumerate((DRIVING, FAILING, stopped, DRIVING, FAILING)):
        publish(mirror, at * 2.0, msg(status))
    assert [severity for severity, _ in texts(port.sent)] == [6, 4, 6, 6, 4]


def test_the_error_that_is_there_from_the_start_is_a_warning(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(FAILING))
    assert texts(port.sent) == [(4, text_of(FAILING))]


def test_at_most_one_text_comes_in_2_s_and_the_last_state_is_always_told(mirror: MirrorPublisher, port: Port) -> None:
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


def test_a_state_that_is_over_before_its_turn_is_not_told(mirror: MirrorPublisher, port: Port) -> None:
    for at, status in ((0.0, DRIVING), (0.5, FAILING), (1.0, DRIVING)):
        publish(mirror, at, msg(status))
    publish(mirror, 2.5, msg(DRIVING))
    assert texts(port.sent) == [(6, text_of(DRIVING))]


def test_vehicles_are_told_of_each_under_its_own_system(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING), msg(FAILING, Detail(9, 1), handle="other"))
    assert texts([s for s in port.sent if s.system == 1]) == [(6, text_of(DRIVING))]
    assert values([s for s in port.sent if s.system == 9])[1] == ("RS_ERROR", 4001)


def test_a_ground_station_that_comes_later_is_told_at_once(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING))
    port.taken()
    port.present.append(Audience("late", mirror=True))
    publish(mirror, 0.1)
    assert [s.key for s in port.sent] == ["late"] * 3


def test_a_lost_vehicle_is_told_of_and_one_that_was_never_heard_is_not(mirror: MirrorPublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(detail=Detail(1, None, link=LinkState.NEVER_SEEN)))
    assert port.sent == []
    publish(mirror, 0.1, msg(detail=Detail(1, 1, link=LinkState.LOST)))
    assert texts(port.sent) == [(6, "RS: UNKNOWN drv=? mot=? poss=? es=? err=?")]


def test_what_consumers_ask_of_robot_status_does_not_concern_the_mirror(mirror: MirrorPublisher, port: Port) -> None:
    port.present = [Audience("out", float("inf"), mirror=True)]
    port.asked = [("out", 1)]
    publish(mirror, 0.0, msg(DRIVING))
    assert len(port.sent) == 3
    assert port.requests() == [("out", 1)]
