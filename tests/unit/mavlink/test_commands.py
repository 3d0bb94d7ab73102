from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.mavlink.commands import Answer, answer
from mav_robot_status.mavlink.definitions import CommandAck, CommandInt, CommandLong, MessageInterval
from mav_robot_status.mavlink.encode import encode

GET, SET, REQUEST = 510, 511, 512
HEARTBEAT, ROBOT_STATUS, MESSAGE_INTERVAL, ATTITUDE = 0, 59900, 244, 30
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
GROUND_STATION = 255, 190
NAN = math.nan


def is_us(system: int, component: int) -> bool:
    return system in (1, 7) and component == 192


def long(command: int, *params: float, target: tuple[int, int] = (1, 192), confirmation: int = 0) -> CommandLong:
    return CommandLong._make((*(*params, *[0.0] * 7)[:7], command, *target, confirmation))


def answered(
    command: int, *params: float, interval: float | None = None, offered: tuple[int, ...] = (HEARTBEAT, ROBOT_STATUS)
) -> Answer:
    got = answer(long(command, *params), GROUND_STATION, is_us, interval, offered)
    assert got is not None
    return got


def result(got: Answer) -> int:
    ack = got.replies[0]
    assert isinstance(ack, CommandAck)
    return ack.result


def test_an_acknowledgement_names_the_command_and_its_sender() -> None:
    got = answer(long(SET, ROBOT_STATUS, 100_000, target=(7, 192)), GROUND_STATION, is_us)
    assert got is not None
    assert got.system == 7
    assert got.replies == (CommandAck(SET, ACCEPTED, 0, 0, 255, 190),)


@pytest.mark.parametrize("target", [(1, 1), (0, 192), (1, 0), (0, 0), (2, 192), (1, 191)])
@pytest.mark.parametrize("command", [GET, SET, REQUEST, 400])
def test_a_command_without_our_exact_address_is_not_answered(target: tuple[int, int], command: int) -> None:
    assert answer(long(command, ROBOT_STATUS, target=target), GROUND_STATION, is_us) is None


@pytest.mark.parametrize(
    ("us", "interval"),
    [
        (100_000, 0.1),
        (5_000_000, 5.0),
        (0, None),
        (-1, math.inf),
        (50_000, 0.05),
        (49_999, 0.05),
        (1, 0.05),
        (0.5, 0.05),
    ],
)
def test_an_interval_is_set_and_a_shorter_one_becomes_20_hz(us: float, interval: float | None) -> None:
    got = answered(SET, ROBOT_STATUS, us, interval=3.0)
    assert (result(got), got.interval, got.once) == (ACCEPTED, interval, None)


@pytest.mark.parametrize(
    ("message_id", "us"),
    [(ROBOT_STATUS, us) for us in (-2, -0.5, NAN, math.inf, -math.inf, 2**31, 3e38)]
    + [(message_id, 100_000) for message_id in (ATTITUDE, 59900.5, -1, NAN, math.inf, 3e38)],
)
def test_an_invalid_interval_is_denied_and_the_current_one_stays(message_id: float, us: float) -> None:
    got = answered(SET, message_id, us, interval=3.0)
    assert (result(got), got.interval) == (DENIED, 3.0)


@pytest.mark.parametrize(("us", "expected"), [(0, ACCEPTED), (1_000_000, ACCEPTED), (100_000, DENIED), (-1, DENIED)])
def test_our_heartbeat_stays_at_1_hz(us: float, expected: int) -> None:
    got = answered(SET, HEARTBEAT, us, interval=3.0)
    assert (result(got), got.interval) == (expected, 3.0)


@pytest.mark.parametrize("message_id", [HEARTBEAT, ROBOT_STATUS])
def test_a_message_that_is_requested_once_is_sent_once(message_id: int) -> None:
    got = answered(REQUEST, message_id, interval=math.inf)
    assert (result(got), got.once, got.interval) == (ACCEPTED, message_id, math.inf)


@pytest.mark.parametrize("message_id", [ATTITUDE, 148, -1, 0.5, NAN, math.inf, 3e38])
def test_a_message_that_we_do_not_send_is_denied(message_id: float) -> None:
    got = answered(REQUEST, message_id)
    assert (result(got), got.once) == (DENIED, None)


@pytest.mark.parametrize("command", [SET, REQUEST])
@pytest.mark.parametrize("message_id", [HEARTBEAT, ROBOT_STATUS])
def test_a_message_that_is_switched_off_is_denied(command: int, message_id: int) -> None:
    got = answered(command, message_id, 1_000_000, offered=())
    assert (result(got), got.once, got.interval) == (DENIED, None, None)


@pytest.mark.parametrize("params", [(GET,), (REQUEST, MESSAGE_INTERVAL)])
@pytest.mark.parametrize(
    ("message_id", "interval", "us"),
    [
        (ROBOT_STATUS, None, 1_000_000),
        (ROBOT_STATUS, 0.1, 100_000),
        (ROBOT_STATUS, math.inf, -1),
        (ROBOT_STATUS, 2147.483647, 2**31 - 1),
        (HEARTBEAT, 0.1, 1_000_000),
        (ATTITUDE, 0.1, 0),
        (65535, 0.1, 0),
    ],
)
def test_an_interval_is_sent_after_the_acknowledgement(
    params: tuple[int, ...], message_id: int, interval: float | None, us: int
) -> None:
    got = answered(*params, message_id, interval=interval)
    assert result(got) == ACCEPTED
    assert got.replies[1:] == (MessageInterval(us, message_id),)
    assert (got.interval, got.once) == (interval, None)


@pytest.mark.parametrize("message_id", [65536, -1, 0.5, NAN, math.inf])
def test_the_interval_of_an_id_beyond_16_bits_is_denied(message_id: float) -> None:
    assert answered(GET, message_id).replies == (CommandAck(GET, DENIED, 0, 0, *GROUND_STATION),)


def test_a_disabled_message_has_the_interval_not_available() -> None:
    assert answered(GET, ROBOT_STATUS, interval=0.1, offered=()).replies[1] == MessageInterval(0, ROBOT_STATUS)


@pytest.mark.parametrize("command", [400, 176, 0, 519])
def test_any_other_command_is_unsupported_and_changes_nothing(command: int) -> None:
    got = answered(command, ROBOT_STATUS, interval=3.0)
    assert got == Answer(1, (CommandAck(command, UNSUPPORTED, 0, 0, *GROUND_STATION),), 3.0, None)


def test_a_repeated_command_has_the_same_answer() -> None:
    first, again = (
        answer(long(SET, ROBOT_STATUS, 100_000, confirmation=n), GROUND_STATION, is_us, interval)
        for n, interval in ((0, None), (1, 0.1))
    )
    assert first == again


def test_command_int_has_the_answer_of_command_long() -> None:
    command = CommandInt(ROBOT_STATUS, 200_000, 0, 0, 0, 0, 0, SET, 1, 192, 0, 0, 0)
    assert answer(command, GROUND_STATION, is_us) == answered(SET, ROBOT_STATUS, 200_000)


@given(
    command=st.one_of(st.sampled_from([GET, SET, REQUEST]), st.integers(0, 65535)),
    params=st.lists(st.floats(width=32), min_size=7, max_size=7),
    sender=st.tuples(st.integers(0, 255), st.integers(0, 255)),
    interval=st.one_of(st.none(), st.floats(0.05, 2147.0), st.just(math.inf)),
)
def test_any_command_has_an_answer_that_fits_its_frames(
    command: int, params: list[float], sender: tuple[int, int], interval: float | None
) -> None:
    got = answer(long(command, *params), sender, is_us, interval)
    assert got is not None
    for reply in got.replies:
        encode(reply, system=got.system, component=192, sequence=0)
    assert got.interval is None or got.interval >= 0.05
