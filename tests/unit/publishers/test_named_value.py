from __future__ import annotations

import io
from itertools import pairwise

import pytest

from mav_robot_status.interface import (
    Audience,
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    PublisherContext,
    RobotMode,
    RobotStatus,
    TriState,
)
from mav_robot_status.mavlink.decode import text
from mav_robot_status.mavlink.definitions import NamedValueInt, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.publishers.named_value import LONGEST_TEXT, NamedValuePublisher, cut, packed

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
FREE = DRIVING._replace(e_stopped=TriState.FALSE)
STOPPED = PARKED._replace(mode=RobotMode.AUTO, drives_powered=TriState.FALSE, e_stopped=TriState.TRUE)
LOW = Detail(1, 1, (ErrorCause(2003, "BATTERY_LOW", "Battery 1 is low 10.21V used 4910 mAh", 0),))
CRASH = Detail(1, 1, (ErrorCause(4001, "CRASH", "Crash: Going to HOLD", 0),))
LOST = Detail(1, 1, link=LinkState.LOST)
AUTO_TEXT, MANUAL_TEXT = (6, "Mode AUTO: a program drives"), (6, "Mode MANUAL: a pilot drives")
CRASHED_TEXT = (2, "CRASHED: Going to HOLD")


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


def said(mirror: NamedValuePublisher, port: Port, *steps: tuple[float, RobotStatus, Detail]) -> list[tuple[int, str]]:
    """The texts about a vehicle whose mode AUTO is known."""
    publish(mirror, -10.0, msg(FREE))
    port.taken()
    for at, status, detail in steps:
        again = publish(mirror, at, msg(status, detail))
    while again is not None:  # what is delayed
        again = publish(mirror, again)
    return texts(port.taken())


@pytest.mark.parametrize(
    ("steps", "wanted"),
    [
        (((0.0, STOPPED, Detail(1, 1)),), [(2, "EMERGENCY STOP engaged")]),
        (
            ((0.0, STOPPED, Detail(1, 1)), (5.0, FREE, Detail(1, 1))),
            [(2, "EMERGENCY STOP engaged"), (6, "Emergency stop released")],
        ),
        (((0.0, FAILING, CRASH),), [CRASHED_TEXT]),
        (((0.0, FAILING, LOW),), [(3, "FAULT: battery low")]),
        (
            ((0.0, FAILING, LOW), (5.0, FREE, Detail(1, 1))),
            [(3, "FAULT: battery low"), (6, "Fault ended: battery low")],
        ),
        (((0.0, FREE._replace(mode=RobotMode.MANUAL), Detail(1, 1)),), [MANUAL_TEXT]),
        (
            ((0.0, FAILING, Detail(3, 1, (ErrorCause(9002, "SYSTEM_ID_CONFLICT", None, 0),))),),
            [(3, "CONFLICT: two autopilots use system id 3")],
        ),
    ],
)
def test_an_event_is_one_text_in_words_with_its_severity(
    mirror: NamedValuePublisher,
    port: Port,
    steps: tuple[tuple[float, RobotStatus, Detail], ...],
    wanted: list[tuple[int, str]],
) -> None:
    assert said(mirror, port, *steps) == wanted


def test_a_robot_that_cannot_arm_says_why(mirror: NamedValuePublisher, port: Port) -> None:
    refused = Detail(
        1, 1, inhibits=(Inhibit("PREARM_FAILING", "PreArm: GPS 1: Bad fix", 0), Inhibit("DISARMED", None, 0))
    )
    parked = PARKED._replace(mode=RobotMode.AUTO, drives_powered=TriState.FALSE, e_stopped=TriState.FALSE)
    assert said(mirror, port, (0.0, parked, refused)) == [(4, "CANNOT ARM: GPS 1: Bad fix")]


def test_a_lost_vehicle_says_for_how_long_nothing_is_heard_and_a_loss_ends_no_error(
    mirror: NamedValuePublisher, port: Port
) -> None:
    publish(mirror, 0.0, msg(FAILING, LOW))
    publish(mirror, 10.0)
    port.taken()
    publish(mirror, 20.0, msg(RobotStatus(), LOST)._replace(heartbeat_age=3.6))
    publish(mirror, 30.0, msg(FAILING, LOW))
    assert texts(port.taken()) == [(4, "LOST: nothing heard for 4 s"), (6, "Heard again: MOVING")]


def test_what_is_not_known_is_told_each_time_and_its_end_is_not(mirror: NamedValuePublisher, port: Port) -> None:
    unsure = FREE._replace(drives_powered=TriState.UNKNOWN, motion_possible=TriState.UNKNOWN, in_motion=TriState.FALSE)
    still = FREE._replace(in_motion=TriState.FALSE)
    steps = [(at * 5.0, status, Detail(1, 1)) for at, status in enumerate((unsure, still, unsure))]
    assert said(mirror, port, *steps) == [(5, "UNKNOWN: whether it can move is not known")] * 2


def test_a_stop_of_which_nothing_is_known_is_not_called_released(mirror: NamedValuePublisher, port: Port) -> None:
    found = said(mirror, port, (0.0, STOPPED, Detail(1, 1)), (5.0, DRIVING, Detail(1, 1)))
    assert found[-1] == (6, "Emergency stop: unknown whether it is released")


@pytest.mark.parametrize("words", ["x" * 200, "\u2714" * 40, "Crash: " + "ä" * 60])
def test_a_text_has_at_most_50_bytes_of_whole_characters(words: str) -> None:
    found = cut(f"CRASHED: {words}")
    assert len(found) <= LONGEST_TEXT
    assert found.decode().startswith("CRASHED: ")


def test_messages_go_to_ground_stations_and_not_to_the_vehicle(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING, Detail(7, 1)))
    assert values(port.sent) == [("RS_STATE", packed(DRIVING)), ("RS_ERROR", 0)]
    assert texts(port.sent) == [AUTO_TEXT]
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


def test_at_most_one_text_is_sent_in_2_s_but_a_worse_one_at_once(mirror: NamedValuePublisher, port: Port) -> None:
    found: list[tuple[float, int]] = []
    manual = FREE._replace(mode=RobotMode.MANUAL)
    for tick in range(100):
        at = tick * 0.1
        publish(mirror, at, msg((FREE, manual)[tick % 2]) if tick < 55 else msg(FAILING, CRASH))
        found += [(at, severity) for severity, _ in texts(port.taken())]
    calm = [at for at, severity in found if severity == 6]
    assert len(calm) >= 3
    assert all(later - earlier >= 2.0 for earlier, later in pairwise(calm))
    assert [at for at, severity in found if severity == 2] == [5.5]


def test_a_state_that_ends_while_it_is_delayed_is_not_sent(mirror: NamedValuePublisher, port: Port) -> None:
    manual = FREE._replace(mode=RobotMode.MANUAL)
    for at, status in ((0.0, FREE), (0.5, manual), (1.0, FREE)):
        publish(mirror, at, msg(status))
    publish(mirror, 2.5, msg(FREE))
    assert texts(port.sent) == [AUTO_TEXT]


def test_messages_about_a_vehicle_have_its_system_id(mirror: NamedValuePublisher, port: Port) -> None:
    publish(mirror, 0.0, msg(DRIVING), msg(FAILING, Detail(9, 1), handle="other"))
    assert texts([s for s in port.sent if s.system == 1]) == [AUTO_TEXT]
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
    publish(mirror, 0.1, msg(detail=LOST))
    assert [text[:5] for _, text in texts(port.sent)] == ["LOST:"]


def test_requests_for_robot_status_do_not_affect_named_values(mirror: NamedValuePublisher, port: Port) -> None:
    port.present = [Audience("out", float("inf"), mirror=True)]
    port.asked = [("out", 1)]
    publish(mirror, 0.0, msg(DRIVING))
    assert len(port.sent) == 3
    assert port.requests() == [("out", 1)]
