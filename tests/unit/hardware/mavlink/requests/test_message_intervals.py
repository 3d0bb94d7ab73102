from __future__ import annotations

import logging
from dataclasses import replace

import pytest

from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, AUTOPILOTS, PX4, Autopilot
from mav_robot_status.hardware.mavlink.autopilots.wanted import COMMON, Wanted
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.requests.message_intervals import BUDGET, Requests, wanted_of
from mav_robot_status.mavlink.definitions import CommandAck, CommandLong, RequestDataStream
from mav_robot_status.mavlink.enumerations import (
    MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
    MAV_CMD_REQUEST_MESSAGE,
    MAV_CMD_SET_MESSAGE_INTERVAL,
    MAV_RESULT_ACCEPTED,
    MAV_RESULT_IN_PROGRESS,
    MAV_RESULT_TEMPORARILY_REJECTED,
    MAV_RESULT_UNSUPPORTED,
    MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    MAVLINK_MSG_ID_AVAILABLE_MODES,
)

US = (1, 192)
FAILED = 4
ONE = (Wanted(1, "SYS_STATUS", 1.0, 55),)
ONLY_RATES = replace(ARDUPILOT, requests=replace(ARDUPILOT.requests, once=()))
"""An ArduPilot of which nothing is requested once."""
TWO = (*ONE, Wanted(33, "GLOBAL_POSITION_INT", 4.0, 40, instead=32))


def ack(
    result: int = MAV_RESULT_ACCEPTED, command: int = MAV_CMD_SET_MESSAGE_INTERVAL, to: tuple[int, int] = US
) -> CommandAck:
    return CommandAck(command, result, 0, 0, *to)


def asked(requests: Requests, now: float, wanted: tuple[Wanted, ...] = ONE, modes: bool = False) -> CommandLong | None:
    command = requests.due(now, wanted, PX4 if modes else ONLY_RATES)
    assert not isinstance(command, RequestDataStream)
    return command


def answered(requests: Requests, now: float, wanted: tuple[Wanted, ...] = ONE, modes: bool = False) -> list[int]:
    """The requested messages, each acknowledged at once."""
    ids = []
    while (command := asked(requests, now, wanted, modes)) is not None:
        ids.append(int(command.param1))
        requests.acknowledged(ack(command=command.command), US, now)
    return ids


@pytest.fixture
def requests() -> Requests:
    return Requests(1, 1, 100.0)


def test_nothing_is_requested_in_the_first_3_s(requests: Requests) -> None:
    assert asked(requests, 102.99) is None
    assert requests.next_due() == 103.0


def test_a_missing_message_is_requested_with_its_interval(requests: Requests) -> None:
    command = asked(requests, 103.0)
    assert command is not None
    assert (command.command, command.param1, command.param2) == (MAV_CMD_SET_MESSAGE_INTERVAL, 1, 1_000_000)
    assert (command.target_system, command.target_component, command.confirmation) == (1, 1, 0)


@pytest.mark.parametrize(("count", "expected"), [(1, [1]), (2, [])])  # in 3 s at 1 Hz
def test_half_the_wanted_rate_is_enough(requests: Requests, count: int, expected: list[int]) -> None:
    for number in range(count):
        requests.arrived(1, 100.5 + number)
    assert answered(requests, 103.0) == expected


def test_a_late_event_loop_does_not_reduce_the_measured_rates(requests: Requests) -> None:
    for number in range(2):
        requests.arrived(1, 100.5 + number)
    assert answered(requests, 120.0) == []


def test_an_alternative_message_is_sufficient(requests: Requests) -> None:
    for number in range(6):
        requests.arrived(32, 100.2 + number * 0.3)
    assert answered(requests, 103.0, TWO) == [1]


def test_one_command_is_outstanding_at_a_time(requests: Requests) -> None:
    assert asked(requests, 103.0, TWO) is not None
    assert asked(requests, 103.5, TWO) is None
    requests.acknowledged(ack(), US, 103.5)
    assert requests.next_due() < 103.5
    second = asked(requests, 103.5, TWO)
    assert second is not None
    assert second.param1 == 33


def test_a_command_without_an_answer_is_sent_four_times(requests: Requests) -> None:
    sent = [asked(requests, 103.0 + second) for second in range(6)]
    assert [c.confirmation if c else None for c in sent] == [0, 1, 2, 3, None, None]
    assert requests.next_due() == 133.0


@pytest.mark.parametrize("foreign", [ack(command=400), ack(to=(1, 191)), ack(to=(255, 190))])
def test_an_acknowledgement_of_another_command_or_target_is_ignored(requests: Requests, foreign: CommandAck) -> None:
    asked(requests, 103.0, TWO)
    requests.acknowledged(foreign, US, 103.1)
    assert asked(requests, 103.2, TWO) is None


def test_an_acknowledgement_without_a_target_is_accepted(requests: Requests) -> None:
    asked(requests, 103.0, TWO)
    requests.acknowledged(ack(to=(0, 0)), US, 103.1)
    assert asked(requests, 103.2, TWO) is not None


def test_an_acknowledgement_before_the_first_command_is_ignored(requests: Requests) -> None:
    requests.acknowledged(ack(), US, 101.0)
    assert asked(requests, 103.0) is not None


@pytest.mark.parametrize("result", [MAV_RESULT_IN_PROGRESS, MAV_RESULT_TEMPORARILY_REJECTED])
def test_a_command_in_progress_gets_5_s(requests: Requests, result: int) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(result), US, 103.1)
    assert asked(requests, 108.0) is None
    assert asked(requests, 108.2) is not None


def test_a_refusal_is_final(requests: Requests) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(FAILED), US, 103.1)
    assert answered(requests, 133.0) == []


def refused(requests: Requests, result: int, profile: Autopilot, wanted: tuple[Wanted, ...] = ONE) -> object:
    """The requests after a refusal of the command for the first message."""
    assert requests.due(103.0, wanted, profile) is not None
    requests.acknowledged(ack(result), US, 103.1)
    return requests.due(103.1, wanted, profile)


def test_an_old_ardupilot_without_the_command_gets_a_stream_request(requests: Requests) -> None:
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, MAV_RESULT_UNSUPPORTED, ONLY_RATES, four_hz) == RequestDataStream(4, 1, 1, 10, 1)
    assert requests.due(103.2, four_hz, ONLY_RATES) is None
    assert requests.next_due() == 133.0


def test_the_rate_of_an_active_stream_is_not_changed() -> None:
    requests = Requests(1, 1, 100.0)
    requests.arrived(30, 101.0)
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, MAV_RESULT_UNSUPPORTED, ONLY_RATES, four_hz) is None


@pytest.mark.parametrize(("result", "profile"), [(FAILED, ARDUPILOT), (MAV_RESULT_UNSUPPORTED, PX4)])
def test_other_autopilots_get_no_stream_request(requests: Requests, result: int, profile: Autopilot) -> None:
    assert not isinstance(refused(requests, result, profile), RequestDataStream)


def test_a_missing_message_is_requested_twice_30_s_apart_and_then_accepted_as_missing(
    requests: Requests, caplog: pytest.LogCaptureFixture
) -> None:
    assert answered(requests, 103.0) == [1]
    assert answered(requests, 132.9) == []
    assert answered(requests, 133.0) == [1]
    assert answered(requests, 163.0) == []
    assert requests.next_due() == float("inf")
    assert answered(requests, 1000.0) == []
    (told,) = [r.message for r in caplog.records if r.levelno == logging.WARNING]
    assert told == "vehicle 1.1 does not send SYS_STATUS although requested; continuing without"


def test_a_message_that_arrives_after_the_first_request_is_not_requested_again(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for number in range(40):
        requests.arrived(1, 103.5 + number)
    assert answered(requests, 133.0) == []


def test_all_requests_restart_after_a_reboot(requests: Requests) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(FAILED), US, 103.1)
    requests.restart(200.0)
    assert asked(requests, 202.9) is None
    assert answered(requests, 203.0) == [1]


def test_messages_absent_during_a_lost_link_are_not_missing(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    requests.resume(132.0)  # the link was lost until now
    for number in range(4):
        requests.arrived(1, 132.1 + number)
    assert answered(requests, 134.9) == []
    assert answered(requests, 135.0) == []


def test_a_flapping_link_does_not_cause_more_requests(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for second in range(105, 120):
        requests.resume(float(second))
    assert answered(requests, 132.9) == []
    assert answered(requests, 133.0) == [1]
    requests.resume(170.0)
    assert [answered(requests, float(t)) for t in (173, 200, 400)] == [[], [], []]


def test_version_and_modes_are_requested_once(requests: Requests) -> None:
    first = asked(requests, 103.0, (), True)
    assert first is not None
    assert (first.command, first.param1) == (MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, 103.1)
    second = asked(requests, 103.1, (), True)
    assert second is not None
    assert (second.command, second.param1) == (MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_AVAILABLE_MODES)
    requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, 103.1)
    assert answered(requests, 133.0, (), True) == []
    requests.restart(200.0)
    assert answered(requests, 203.0, (), True) == [MAVLINK_MSG_ID_AUTOPILOT_VERSION, MAVLINK_MSG_ID_AVAILABLE_MODES]


def test_old_firmware_gets_the_old_command_for_its_version(requests: Requests) -> None:
    assert requests.due(103.0, (), ARDUPILOT) is not None
    requests.acknowledged(ack(MAV_RESULT_UNSUPPORTED, MAV_CMD_REQUEST_MESSAGE), US, 103.1)
    older = requests.due(103.1, (), ARDUPILOT)
    assert isinstance(older, CommandLong)
    assert (older.command, older.param1) == (MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1.0)
    requests.acknowledged(ack(MAV_RESULT_UNSUPPORTED, MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES), US, 103.2)
    assert requests.due(103.2, (), ARDUPILOT) is None


@pytest.mark.parametrize("profile", AUTOPILOTS, ids=lambda profile: str(profile.name))
@pytest.mark.parametrize("family", Family)
def test_all_requests_stay_within_the_budget(profile: Autopilot, family: Family) -> None:
    for watch_outputs in (False, True):
        wanted = wanted_of(profile, family, watch_outputs)
        assert set(COMMON) <= set(wanted) or not wanted
        assert sum(w.rate * w.size for w in wanted) < BUDGET


def test_the_speed_source_is_requested_from_ardupilot_only() -> None:
    asked_of = {
        profile.name: {w.name for w in wanted_of(profile, Family.SUB, watch_outputs=False)} for profile in AUTOPILOTS
    }
    assert {name for name, names in asked_of.items() if "EKF_STATUS_REPORT" in names} == {ARDUPILOT.name}
