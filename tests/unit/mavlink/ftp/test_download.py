from __future__ import annotations

import itertools
import math
import random
import struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.mavlink.ftp.download import APART, BURST_RATE, MOST_GAPS, SLACK, TRIES, Download, Failure
from mav_robot_status.mavlink.ftp.payload import (
    ACK,
    BURST_READ_FILE,
    ERRORS,
    MOST_DATA,
    NAK,
    OPEN_FILE_RO,
    READ_FILE,
    TERMINATE_SESSION,
    Payload,
)
from mav_robot_status.testing.file_server import FileServer
from mav_robot_status.testing.lossy import Lossy

from .server import play

PATH = "etc/extras/file"
UDP, SERIAL = 20_000.0, 1000.0
MEGABYTE = 1 << 20


def contents(size: int, seed: int = 1) -> bytes:
    return random.Random(seed).randbytes(size)


def download(rate: float = UDP, now: float = 0.0, sequence: int = 0) -> Download:
    return Download(PATH, rate=rate, now=now, most=MEGABYTE, sequence=sequence)


def opened(size: int, rate: float = UDP) -> tuple[Download, Payload]:
    """A download of a file of this size whose session is open, and its first request for data."""
    made = download(rate)
    asked = made.due(0.0)
    assert asked is not None
    made.heard(reply(asked, struct.pack("<I", size)), 0.01)
    asked = made.due(1.0)
    assert asked is not None
    return made, asked


def reply(asked: Payload, data: bytes = b"", **changes: Any) -> Payload:
    number = asked.sequence + 1 & 0xFFFF
    made = Payload(number, 0, ACK, data, asked.offset, len(data), req_opcode=asked.opcode)
    return made._replace(**changes)


def refusal(asked: Payload, code: int, *more: int) -> Payload:
    return reply(asked, bytes((code, *more)), opcode=NAK)


@pytest.mark.parametrize("size", [1, 3, 4, 5, 238, 239, 240, 478, 479, 17_344, 100_000])
@pytest.mark.parametrize("bursts", [True, False])
def test_a_file_arrives_and_its_session_is_closed(size: int, bursts: bool) -> None:
    server = FileServer({PATH: contents(size)}, bursts=bursts)
    for _ in range(2):  # the second one needs the only session
        made = download()
        play(made, server)
        assert made.outcome == contents(size)
        assert made.progress == (size, size)
        assert made.next_due() == math.inf


@settings(max_examples=60, deadline=None)
@given(
    size=st.integers(1, 9000),
    loss=st.floats(0, 0.3),
    duplication=st.floats(0, 0.3),
    reordering=st.floats(0, 0.5),
    seed=st.integers(0, 10_000),
    rate=st.sampled_from([UDP, SERIAL]),
    bursts=st.booleans(),
    sequence=st.sampled_from([0, 65_500, 65_534, 65_535]),
)
def test_a_file_that_arrives_over_a_bad_link_is_the_file(
    size: int, loss: float, duplication: float, reordering: float, seed: int, rate: float, bursts: bool, sequence: int
) -> None:
    made = download(rate, sequence=sequence)
    play(made, FileServer({PATH: contents(size)}, bursts=bursts), Lossy(loss, duplication, reordering, seed))
    if isinstance(made.outcome, Failure):  # so many losses in a row
        assert "no answer to" in made.outcome.reason
        assert loss + reordering > 0.15
    else:
        assert made.outcome == contents(size)


def test_most_downloads_over_a_link_that_loses_a_fifth_succeed() -> None:
    done = 0
    for seed in range(20):
        made = download()
        play(made, FileServer({PATH: contents(17_344)}), Lossy(0.2, 0.1, 0.2, seed))
        done += made.outcome == contents(17_344)
    assert done >= 19


@pytest.mark.parametrize(("rate", "seconds"), [(SERIAL, 5.0), (UDP, 2.0)])
def test_a_download_keeps_to_its_rate(rate: float, seconds: float) -> None:
    moved: list[tuple[float, int]] = []
    made = download(rate)
    play(made, FileServer({PATH: contents(40_000)}), see=lambda now, one: moved.append((now, 27 + len(one.data))))
    assert made.outcome == contents(40_000)
    total, last = sum(size for _, size in moved), moved[-1][0]
    assert total / last <= rate * 1.05
    if rate < BURST_RATE:  # no window of five seconds has more; a burst comes as one
        for start, _ in moved:
            assert sum(size for at, size in moved if start <= at < start + seconds) <= rate * seconds + 300


def test_requests_are_apart_and_small() -> None:
    asked: list[tuple[float, int]] = []
    made = download()
    server = FileServer({PATH: contents(20_000)}, bursts=False)
    play(made, server, see=lambda now, one: None if one.opcode in (ACK, NAK) else asked.append((now, len(one.data))))
    assert all(b[0] - a[0] >= APART - 1e-9 for a, b in itertools.pairwise(asked))


def test_a_serial_link_gets_no_burst() -> None:
    _, asked = opened(10_000, SERIAL)
    assert asked.opcode == READ_FILE
    _, asked = opened(10_000, UDP)
    assert asked.opcode == BURST_READ_FILE


def test_without_an_answer_it_gives_up_after_so_many_tries_with_the_same_number() -> None:
    made = download()
    sent = [request for tick in range(400) if (request := made.due(tick / 10)) is not None]
    assert len(sent) == TRIES
    assert {request.sequence for request in sent} == {1}
    assert made.outcome == Failure(f"no answer to OpenFileRO after {TRIES} tries")
    assert made.ended


def test_a_file_of_an_impossible_size_is_refused_and_closed() -> None:
    for size in (0, MEGABYTE + 1, 0xFFFFFFFF):
        made = download()
        asked = made.due(0.0)
        assert asked is not None
        made.heard(reply(asked, struct.pack("<I", size)), 0.01)
        assert isinstance(made.outcome, Failure)
        assert str(size) in made.outcome.reason
        closing = made.due(1.0)
        assert closing is not None
        assert closing.opcode == TERMINATE_SESSION


@pytest.mark.parametrize("code", [*ERRORS, 64, 255])
@pytest.mark.parametrize("phase", ["opening", "reading", "closing"])
def test_every_refusal_ends_in_one_reason(code: int, phase: str) -> None:
    made = download()
    now = 0.0
    refused = 0
    while not made.ended and now < 200.0:
        asked = made.due(now)
        if asked is not None:
            kind = {OPEN_FILE_RO: "opening", TERMINATE_SESSION: "closing"}.get(asked.opcode, "reading")
            if kind == phase:
                refused += 1
                made.heard(refusal(asked, code, 13), now)
            elif kind == "opening":
                made.heard(reply(asked, struct.pack("<I", 100)), now)
            else:
                made.heard(reply(asked, bytes(100)), now)
        now += 0.1
    assert made.ended
    assert refused > 0
    if phase == "closing":
        assert made.outcome == bytes(100)
    else:
        assert isinstance(made.outcome, Failure)
        assert made.outcome.reason


def test_a_busy_server_is_asked_again_until_its_session_is_free() -> None:
    server = FileServer({PATH: contents(100)})
    other = Payload(77, 0, OPEN_FILE_RO, PATH.encode(), 0, len(PATH))
    server.answer(other.pack(), 0.0)
    made = download()
    ended = play(made, server)
    assert made.outcome == contents(100)
    assert ended > 10.0


def test_a_server_that_forgets_the_session_is_asked_for_the_rest_only() -> None:
    server = FileServer({PATH: contents(20_000)}, bursts=False)
    made = download()
    opens = reads = 0

    def see(now: float, one: Payload) -> None:
        nonlocal opens, reads
        opens += one.opcode == OPEN_FILE_RO
        reads += one.opcode == READ_FILE
        if reads == 40 and opens == 1:
            server.answer(Payload(9999, 0, TERMINATE_SESSION).pack(), now)

    play(made, server, see=see)
    assert made.outcome == contents(20_000)
    assert opens == 2
    assert reads < 90


def test_a_file_that_ends_early_is_no_file() -> None:
    made, asked = opened(1000, SERIAL)
    made.heard(reply(asked, bytes(100)), 1.0)
    rest = made.due(2.0)
    assert rest is not None
    made.heard(refusal(rest, 6), 2.0)
    assert made.outcome == Failure("it ends at byte 100 of 1000")


def test_answers_of_another_session_number_or_time_have_no_effect() -> None:
    made, asked = opened(100)
    data = bytes(100)
    for answer in (
        reply(asked, data, session=1),
        reply(asked, data, sequence=asked.sequence - 2),
        reply(asked, data, sequence=asked.sequence + 0x9000),
        reply(asked, data, opcode=3),
        reply(asked, data, opcode=NAK, req_opcode=READ_FILE, sequence=asked.sequence + 2),
        reply(asked, data, offset=1),
        reply(asked, data, offset=0xFFFFFFFF),
        reply(asked, b""),
        reply(asked, b"", offset=50),
        reply(asked, b"", req_opcode=TERMINATE_SESSION),
    ):
        made.heard(answer, 1.0)
        assert made.outcome is None
        assert made.progress == (0, 100)
    made.heard(reply(asked, data), 1.0)
    assert made.outcome == data


def test_a_byte_that_has_arrived_does_not_change() -> None:
    made, asked = opened(200)
    made.heard(reply(asked, b"a" * 100), 1.0)
    made.heard(reply(asked, b"b" * 200), 1.0)
    assert made.outcome == b"a" * 100 + b"b" * 100


def test_an_endless_burst_of_what_is_there_already_ends() -> None:
    made, asked = opened(10_000)
    now, asks = 1.0, 0
    while not made.ended and now < 300.0:
        now += 0.01
        made.heard(reply(asked, bytes(100)), now)
        request = made.due(now)
        if request is not None:
            asks, asked = asks + 1, request
    assert isinstance(made.outcome, Failure)
    assert asks < 3 * TRIES


def test_a_burst_that_claims_its_end_at_once_ends() -> None:
    made, asked = opened(10_000)
    now = 1.0
    while not made.ended and now < 300.0:
        now += 0.05
        made.heard(reply(asked, b"", burst_complete=1), now)
        asked = made.due(now) or asked
    assert isinstance(made.outcome, Failure)


def test_a_server_that_drips_is_given_up() -> None:
    made, asked = opened(1000)
    now, at = 1.0, 0
    while not made.ended and now < 1000.0:
        now += 0.9
        made.heard(reply(asked, b"x", offset=at), now)
        at += 1
        asked = made.due(now) or asked
    assert isinstance(made.outcome, Failure)
    assert "longer than" in made.outcome.reason
    assert now < 2 * SLACK


def test_gaps_are_bounded() -> None:
    made, asked = opened(MEGABYTE)
    for offset in range(0, 3 * MOST_GAPS, 2):
        made.heard(reply(asked, b"x", offset=offset), 1.0)
    assert len(made._missing) <= MOST_GAPS


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.floats(0, 2),
            st.integers(-3, 40),
            st.integers(0, 1),
            st.sampled_from([0, 1, 4, 5, 15, ACK, ACK, ACK, NAK, 255]),
            st.sampled_from([1, 4, 4, 5, 5, 15, 15, 200]),
            st.binary(max_size=MOST_DATA),
            st.integers(0, 2000) | st.integers(0, 0xFFFFFFFF),
            st.integers(0, 1),
        ),
        max_size=80,
    ),
    st.sampled_from([UDP, SERIAL]),
)
def test_any_answers_at_any_time_neither_raise_nor_grow(answers: list[tuple[float, ...]], rate: float) -> None:
    made = Download(PATH, rate=rate, now=0.0, most=2000)
    now, number = 0.0, 0
    for wait, ahead, session, opcode, req_opcode, data, offset, complete in answers:
        now += wait
        request = made.due(now)
        if request is not None:
            number = request.sequence
            assert request.opcode in (TERMINATE_SESSION, OPEN_FILE_RO, READ_FILE, BURST_READ_FILE)
        sequence = int(number + ahead) & 0xFFFF
        assert isinstance(data, bytes)
        made.heard(
            Payload(sequence, int(session), int(opcode), data, int(offset), len(data), int(req_opcode), int(complete)),
            now,
        )
        arrived, size = made.progress
        assert 0 <= arrived <= size <= 2000
        assert made.next_due() <= now + 13.0 or made.ended
    for tick in range(4000):
        made.due(now + tick / 4)
    assert made.ended
    assert made.outcome is not None
