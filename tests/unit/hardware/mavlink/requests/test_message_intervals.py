from __future__ import annotations

import logging

import pytest

from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, AUTOPILOTS, PX4, Autopilot
from mav_robot_status.hardware.mavlink.autopilots.wanted import COMMON, METADATA, Wanted
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.requests.message_intervals import BUDGET, RETRIES, Requests, wanted_of
from mav_robot_status.mavlink.definitions import CommandAck, CommandLong, RequestDataStream
from mav_robot_status.mavlink.enumerations import (
    MAV_CMD_GET_MESSAGE_INTERVAL,
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
GET = MAV_CMD_GET_MESSAGE_INTERVAL
FAILED = 4
ONE = (Wanted(1, "SYS_STATUS", 1.0, 55),)
ONLY_RATES = ARDUPILOT._replace(requests=ARDUPILOT.requests._replace(once=()))
"""An ArduPilot of which nothing is requested once."""
TWO = (*ONE, Wanted(33, "GLOBAL_POSITION_INT", 4.0, 40, instead=32))


def ack(
    result: int = MAV_RESULT_ACCEPTED, command: int = MAV_CMD_SET_MESSAGE_INTERVAL, to: tuple[int, int] = US
) -> CommandAck:
    return CommandAck(command, result, 0, 0, *to)


def asked(requests: Requests, now: float, wanted: tuple[Wanted, ...] = ONE, modes: bool = False) -> CommandLong | None:
    """The next request to an autopilot that does not tell its intervals."""
    command = due(requests, now, wanted, PX4 if modes else ONLY_RATES)
    assert not isinstance(command, RequestDataStream)
    return command


def due(
    requests: Requests, now: float, wanted: tuple[Wanted, ...], profile: Autopilot
) -> CommandLong | RequestDataStream | None:
    command = requests.due(now, wanted, profile)
    if isinstance(command, CommandLong) and command.command == GET:
        requests.acknowledged(ack(MAV_RESULT_UNSUPPORTED, GET), US, now)
        command = requests.due(now, wanted, profile)
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
    assert answered(requests, 103.5) == expected


def test_a_late_event_loop_does_not_reduce_the_measured_rates(requests: Requests) -> None:
    for number in range(2):
        requests.arrived(1, 100.5 + number)
    assert answered(requests, 120.0) == []


def test_an_alternative_message_is_sufficient(requests: Requests) -> None:
    for number in range(6):
        requests.arrived(32, 100.2 + number * 0.3)
    assert answered(requests, 103.2, TWO) == [1]


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
    assert requests.next_due() == 109.0


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
    assert due(requests, 103.0, wanted, profile) is not None
    requests.acknowledged(ack(result), US, 103.1)
    return requests.due(103.1, wanted, profile)


def test_an_old_ardupilot_without_the_command_gets_a_stream_request(requests: Requests) -> None:
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, MAV_RESULT_UNSUPPORTED, ONLY_RATES, four_hz) == RequestDataStream(4, 1, 1, 10, 1)
    assert requests.due(103.2, four_hz, ONLY_RATES) is None
    assert requests.next_due() == 106.0


def test_the_rate_of_an_active_stream_is_not_changed() -> None:
    requests = Requests(1, 1, 100.0)
    requests.arrived(30, 100.0)
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, MAV_RESULT_UNSUPPORTED, ONLY_RATES, four_hz) is None


def test_a_stream_of_which_another_message_arrives_is_not_requested() -> None:
    requests = Requests(1, 1, 100.0)
    for tick in range(15):
        requests.arrived(2, 100.0 + tick / 5)
    system_time, estimator = Wanted(2, "SYSTEM_TIME", 1.0, 24), Wanted(193, "EKF_STATUS_REPORT", 0.5, 34)
    assert refused(requests, MAV_RESULT_UNSUPPORTED, ONLY_RATES, (system_time, estimator)) is None


@pytest.mark.parametrize(("result", "profile"), [(FAILED, ARDUPILOT), (MAV_RESULT_UNSUPPORTED, PX4)])
def test_other_autopilots_get_no_stream_request(requests: Requests, result: int, profile: Autopilot) -> None:
    assert not isinstance(refused(requests, result, profile), RequestDataStream)


def test_a_missing_message_is_requested_twice_30_s_apart_and_then_accepted_as_missing(
    requests: Requests, caplog: pytest.LogCaptureFixture
) -> None:
    assert answered(requests, 103.0) == [1]
    assert answered(requests, 129.9) == []
    assert answered(requests, 133.0) == [1]
    assert answered(requests, 163.0) == []
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
    requests.look_again(132.0)  # the link was lost until now
    for number in range(4):
        requests.arrived(1, 132.1 + number)
    assert answered(requests, 134.9) == []
    assert answered(requests, 135.2) == []


def test_after_a_sign_of_a_reboot_it_asks_again_for_what_is_missing(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    requests.look_again(140.0)
    assert answered(requests, 142.9) == []
    assert answered(requests, 143.0) == [1]


def test_signs_in_quick_succession_do_not_postpone_the_requests(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for second in (140.0, 141.0, 142.5):
        requests.look_again(second)
    assert answered(requests, 143.0) == [1]


def windows(requests: Requests, first: float, last: float) -> dict[float, list[int]]:
    """What is requested at the end of each window."""
    found = {}
    now = first
    while now < last:
        now += 3.0
        if ids := answered(requests, now):
            found[now] = ids
    return found


def test_a_message_that_falls_silent_is_requested_again(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for second in range(104, 200):
        requests.arrived(1, float(second))
        answered(requests, float(second))
    assert list(windows(requests, 199.0, 240.0)) == [pytest.approx(210.0, abs=3.0), pytest.approx(240.0, abs=3.0)]
    assert windows(requests, 240.0, 400.0) == {}


def test_a_message_that_never_arrived_does_not_fall_silent(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    assert list(windows(requests, 103.0, 400.0)) == [133.0]


def test_nothing_is_requested_while_the_autopilot_starts(requests: Requests) -> None:
    for tenth in range(80):
        requests.wait_for_boot(100.0 + tenth / 10)
        assert answered(requests, 100.0 + tenth / 10) == []
    assert answered(requests, 110.9) == [1]


def test_an_autopilot_that_never_ends_its_start_is_asked_all_the_same(requests: Requests) -> None:
    for second in range(60):
        requests.wait_for_boot(100.0 + second)
    requests.wait_for_boot(170.0)
    assert answered(requests, 170.0) == [1]


def test_the_first_window_begins_with_the_first_message_of_a_stream(requests: Requests) -> None:
    requests.arrived(253, 101.0)  # a text is no stream
    requests.arrived(1, 102.9)
    requests.arrived(1, 103.9)
    assert answered(requests, 103.0) == []
    assert answered(requests, 105.9) == []


FOUR_HZ = (Wanted(30, "ATTITUDE", 4.0, 40),)


def first_question(requests: Requests) -> None:
    question = requests.due(103.0, FOUR_HZ, ONLY_RATES)
    assert isinstance(question, CommandLong)
    assert (question.command, question.param1) == (GET, 30)


@pytest.mark.parametrize(
    ("interval_us", "requested"), [(100_000, None), (500_000, None), (1_000_000, 250_000), (-1, 250_000)]
)
def test_a_message_that_will_come_fast_enough_is_not_requested(
    requests: Requests, interval_us: int, requested: int | None
) -> None:
    first_question(requests)
    requests.told(30, interval_us)
    requests.acknowledged(ack(command=GET), US, 103.1)
    command = requests.due(103.5, FOUR_HZ, ONLY_RATES)
    assert (command.param2 if isinstance(command, CommandLong) else None) == requested


def test_the_answer_to_a_question_may_follow_its_acknowledgement(requests: Requests) -> None:
    first_question(requests)
    requests.acknowledged(ack(command=GET), US, 103.1)
    assert requests.due(103.2, FOUR_HZ, ONLY_RATES) is None
    requests.told(30, 100_000)
    assert requests.due(103.5, FOUR_HZ, ONLY_RATES) is None


def test_an_unanswered_question_is_not_repeated(requests: Requests) -> None:
    first_question(requests)
    assert requests.due(103.9, FOUR_HZ, ONLY_RATES) is None
    command = requests.due(104.0, FOUR_HZ, ONLY_RATES)
    assert isinstance(command, CommandLong)
    assert command.command == MAV_CMD_SET_MESSAGE_INTERVAL


def test_no_rate_below_the_one_seen_before_is_requested(requests: Requests) -> None:
    for number in range(31):
        requests.arrived(30, 100.0 + number / 10)
    assert requests.due(103.0, FOUR_HZ, ONLY_RATES) is None
    requests.restart(120.0)
    command = due(requests, 123.0, FOUR_HZ, ONLY_RATES)
    assert isinstance(command, CommandLong)
    assert command.param2 == pytest.approx(100_000, rel=0.05)


def test_version_modes_and_metadata_are_requested_once(requests: Requests) -> None:
    first = asked(requests, 103.0, (), True)
    assert first is not None
    assert (first.command, first.param1) == (MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, 103.1)
    second = asked(requests, 103.1, (), True)
    assert second is not None
    assert (second.command, second.param1) == (MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_AVAILABLE_MODES)
    requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, 103.1)
    third = asked(requests, 103.2, (), True)
    assert third is not None
    assert (third.command, third.param1) == (MAV_CMD_REQUEST_MESSAGE, METADATA.id)
    requests.delivered(METADATA.id)
    requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, 103.3)
    assert answered(requests, 133.0, (), True) == []
    requests.restart(200.0)
    assert answered(requests, 203.0, (), True) == [
        MAVLINK_MSG_ID_AUTOPILOT_VERSION,
        MAVLINK_MSG_ID_AVAILABLE_MODES,
        METADATA.id,
    ]


def test_only_a_second_refusal_ends_the_request_for_metadata(requests: Requests) -> None:
    refused = ack(MAV_RESULT_UNSUPPORTED, MAV_CMD_REQUEST_MESSAGE)  # the first one may be that of another request
    times = []
    for tick in range(200):
        now = 103.0 + tick / 10
        command = requests.due(now, (), PX4)
        if isinstance(command, CommandLong) and command.param1 == METADATA.id:
            times.append(now)
            requests.acknowledged(refused, US, now)
        elif command is not None:
            requests.acknowledged(ack(command=MAV_CMD_REQUEST_MESSAGE), US, now)
    assert len(times) == 2


def test_metadata_that_is_lost_after_its_acknowledgement_is_requested_again(requests: Requests) -> None:
    accepted = ack(command=MAV_CMD_REQUEST_MESSAGE)
    times = []
    for tick in range(400):
        now = 103.0 + tick / 10
        command = requests.due(now, (), PX4)
        if isinstance(command, CommandLong):
            requests.acknowledged(accepted, US, now)
            if command.param1 == METADATA.id:
                times.append(now)
    assert times == pytest.approx([103.2 + 5 * number for number in range(RETRIES + 1)], abs=0.31)


def test_what_is_not_wanted_is_not_requested(requests: Requests) -> None:
    ids = []
    while (command := requests.due(103.0, (), PX4, {METADATA})) is not None:
        assert isinstance(command, CommandLong)
        ids.append(int(command.param1))
        requests.acknowledged(ack(command=command.command), US, 103.0)
    assert ids == [MAVLINK_MSG_ID_AUTOPILOT_VERSION, MAVLINK_MSG_ID_AVAILABLE_MODES]


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
