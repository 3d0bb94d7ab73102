from __future__ import annotations

import logging

import pytest

from mav_robot_status.hardware.identity import Family, Stack
from mav_robot_status.hardware.requests import (
    ACCEPTED,
    AVAILABLE_MODES,
    BUDGET,
    COMMON,
    IN_PROGRESS,
    REQUEST_MESSAGE,
    SET_MESSAGE_INTERVAL,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    Requests,
    Wanted,
    wanted_of,
)
from mav_robot_status.mavlink.definitions import CommandAck, CommandLong, RequestDataStream

US = (1, 192)
FAILED = 4
ONE = (Wanted(1, "SYS_STATUS", 1.0, 55),)
TWO = (*ONE, Wanted(33, "GLOBAL_POSITION_INT", 4.0, 40, instead=32))


def ack(result: int = ACCEPTED, command: int = SET_MESSAGE_INTERVAL, to: tuple[int, int] = US) -> CommandAck:
    return CommandAck(command, result, 0, 0, *to)


def asked(requests: Requests, now: float, wanted: tuple[Wanted, ...] = ONE, modes: bool = False) -> CommandLong | None:
    command = requests.due(now, wanted, Stack.PX4 if modes else Stack.ARDUPILOT)
    assert not isinstance(command, RequestDataStream)
    return command


def answered(requests: Requests, now: float, wanted: tuple[Wanted, ...] = ONE, modes: bool = False) -> list[int]:
    """The messages that are asked for, each acknowledged at once."""
    ids = []
    while (command := asked(requests, now, wanted, modes)) is not None:
        ids.append(int(command.param1))
        requests.acknowledged(ack(command=command.command), US, now)
    return ids


@pytest.fixture
def requests() -> Requests:
    return Requests(1, 1, 100.0)


def test_nothing_is_asked_in_the_first_3_s(requests: Requests) -> None:
    assert asked(requests, 102.99) is None
    assert requests.next_due() == 103.0


def test_what_is_missing_is_asked_for_with_its_interval(requests: Requests) -> None:
    command = asked(requests, 103.0)
    assert command is not None
    assert (command.command, command.param1, command.param2) == (SET_MESSAGE_INTERVAL, 1, 1_000_000)
    assert (command.target_system, command.target_component, command.confirmation) == (1, 1, 0)


@pytest.mark.parametrize(("count", "expected"), [(1, [1]), (2, [])])  # in 3 s, of 1 Hz
def test_half_the_rate_is_enough(requests: Requests, count: int, expected: list[int]) -> None:
    for number in range(count):
        requests.arrived(1, 100.5 + number)
    assert answered(requests, 103.0) == expected


def test_a_loop_that_comes_late_does_not_make_rates_smaller(requests: Requests) -> None:
    for number in range(2):
        requests.arrived(1, 100.5 + number)
    assert answered(requests, 120.0) == []


def test_another_message_may_serve_instead(requests: Requests) -> None:
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


def test_without_an_answer_it_is_sent_four_times_and_given_up(requests: Requests) -> None:
    sent = [asked(requests, 103.0 + second) for second in range(6)]
    assert [c.confirmation if c else None for c in sent] == [0, 1, 2, 3, None, None]
    assert requests.next_due() == 133.0


@pytest.mark.parametrize("foreign", [ack(command=400), ack(to=(1, 191)), ack(to=(255, 190))])
def test_an_acknowledgement_of_somebody_elses_is_not_ours(requests: Requests, foreign: CommandAck) -> None:
    asked(requests, 103.0, TWO)
    requests.acknowledged(foreign, US, 103.1)
    assert asked(requests, 103.2, TWO) is None


def test_an_acknowledgement_without_addressee_is_ours(requests: Requests) -> None:
    asked(requests, 103.0, TWO)
    requests.acknowledged(ack(to=(0, 0)), US, 103.1)
    assert asked(requests, 103.2, TWO) is not None


def test_an_acknowledgement_before_anything_was_sent_is_harmless(requests: Requests) -> None:
    requests.acknowledged(ack(), US, 101.0)
    assert asked(requests, 103.0) is not None


@pytest.mark.parametrize("result", [IN_PROGRESS, TEMPORARILY_REJECTED])
def test_one_who_needs_time_gets_5_s(requests: Requests, result: int) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(result), US, 103.1)
    assert asked(requests, 108.0) is None
    assert asked(requests, 108.2) is not None


def test_a_refusal_is_final(requests: Requests) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(FAILED), US, 103.1)
    assert answered(requests, 133.0) == []


def refused(requests: Requests, result: int, stack: Stack, wanted: tuple[Wanted, ...] = ONE) -> object:
    """What is asked for after the command for the first message was refused."""
    assert requests.due(103.0, wanted, stack) is not None
    requests.acknowledged(ack(result), US, 103.1)
    return requests.due(103.1, wanted, stack)


def test_an_old_ardupilot_that_does_not_know_the_command_is_asked_for_the_stream(requests: Requests) -> None:
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, UNSUPPORTED, Stack.ARDUPILOT, four_hz) == RequestDataStream(4, 1, 1, 10, 1)
    assert requests.due(103.2, four_hz, Stack.ARDUPILOT) is None
    assert requests.next_due() == 133.0


def test_a_stream_of_which_something_comes_is_not_set_to_another_rate() -> None:
    requests = Requests(1, 1, 100.0)
    requests.arrived(30, 101.0)
    four_hz = (Wanted(30, "ATTITUDE", 4.0, 40),)
    assert refused(requests, UNSUPPORTED, Stack.ARDUPILOT, four_hz) is None


@pytest.mark.parametrize(("result", "stack"), [(FAILED, Stack.ARDUPILOT), (UNSUPPORTED, Stack.PX4)])
def test_nobody_else_is_asked_for_a_stream(requests: Requests, result: int, stack: Stack) -> None:
    assert not isinstance(refused(requests, result, stack), RequestDataStream)


def test_it_is_asked_twice_30_s_apart_and_then_lived_with(requests: Requests, caplog: pytest.LogCaptureFixture) -> None:
    assert answered(requests, 103.0) == [1]
    assert answered(requests, 132.9) == []
    assert answered(requests, 133.0) == [1]
    assert answered(requests, 163.0) == []
    assert requests.next_due() == float("inf")
    assert answered(requests, 1000.0) == []
    (told,) = [r.message for r in caplog.records if r.levelno == logging.WARNING]
    assert told == "vehicle 1.1 does not send SYS_STATUS although asked; the status lives without"


def test_what_flows_after_the_first_request_is_not_asked_for_again(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for number in range(40):
        requests.arrived(1, 103.5 + number)
    assert answered(requests, 133.0) == []


def test_after_a_reboot_all_begins_anew(requests: Requests) -> None:
    asked(requests, 103.0)
    requests.acknowledged(ack(FAILED), US, 103.1)
    requests.restart(200.0)
    assert asked(requests, 202.9) is None
    assert answered(requests, 203.0) == [1]


def test_what_did_not_come_while_the_link_was_lost_is_not_missing(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    requests.resume(132.0)  # lost until now
    for number in range(4):
        requests.arrived(1, 132.1 + number)
    assert answered(requests, 134.9) == []
    assert answered(requests, 135.0) == []


def test_a_link_that_flaps_is_not_asked_more_often(requests: Requests) -> None:
    assert answered(requests, 103.0) == [1]
    for second in range(105, 120):
        requests.resume(float(second))
    assert answered(requests, 132.9) == []
    assert answered(requests, 133.0) == [1]
    requests.resume(170.0)
    assert [answered(requests, float(t)) for t in (173, 200, 400)] == [[], [], []]


def test_the_modes_are_asked_for_once(requests: Requests) -> None:
    first = asked(requests, 103.0, (), True)
    assert first is not None
    assert (first.command, first.param1) == (REQUEST_MESSAGE, AVAILABLE_MODES)
    requests.acknowledged(ack(command=REQUEST_MESSAGE), US, 103.1)
    assert answered(requests, 133.0, (), True) == []


@pytest.mark.parametrize("stack", Stack)
@pytest.mark.parametrize("family", Family)
def test_all_that_is_asked_for_stays_within_the_budget(stack: Stack, family: Family) -> None:
    for watch_outputs in (False, True):
        wanted = wanted_of(stack, family, watch_outputs)
        assert set(COMMON) <= set(wanted)
        assert sum(w.rate * w.size for w in wanted) < BUDGET


def test_only_ardupilot_is_asked_whether_its_speed_is_measured() -> None:
    asked_of = {stack: {w.name for w in wanted_of(stack, Family.SUB, watch_outputs=False)} for stack in Stack}
    assert {stack for stack, names in asked_of.items() if "EKF_STATUS_REPORT" in names} == {Stack.ARDUPILOT}
