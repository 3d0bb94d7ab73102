"""The verdict on each frame, its time, and who is known to have said it."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.belief import Belief, Heard, Verdict
from mav_robot_status.hardware.mavlink.belief.belief import MOST_NEW, MOST_SPEAKERS
from mav_robot_status.mavlink.definitions import (
    Attitude,
    ExtendedSysState,
    Heartbeat,
    MissionCurrent,
    Statustext,
    SystemTime,
)
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser

START = Instant(100.0, 1_800_000_000_000_000)
BEAT = Heartbeat(0, 2, 3, 81, 3, 3)
LANDED = ExtendedSysState(0, 1)
NEWS, LATE, COPY = Verdict.NEWS, Verdict.LATE, Verdict.COPY


def clock(seconds: float) -> SystemTime:
    return SystemTime(0, round(seconds * 1000))


def text(words: str) -> Statustext:
    return Statustext(6, words.encode(), 0, 0)


class Ear:
    """A belief that hears frames of vehicle 1.1."""

    def __init__(self) -> None:
        self.belief = Belief()

    def hear(self, at: float, number: int, message: Any, channel: Any = "radio", lag: float = 0.0) -> Heard:
        """One frame, seconds after the start."""
        (frame,) = Parser(None).feed(encode(message, system=1, component=1, sequence=number & 255))
        return self.belief.hear(frame, channel, later(START, at), lag)

    def stream(self, channel: Any = "radio", *, first: int = 0, count: int = 20, start: float = 0.0) -> None:
        """Clocks at 10 Hz, of a vehicle that booted a minute before the start."""
        for tick in range(count):
            at = start + tick / 10
            self.hear(at, first + tick, clock(60 + at), channel)


def said(heard: Heard) -> float | None:
    """When it was said, seconds after the start."""
    return None if heard.said is None else heard.said.mono - START.mono


@pytest.mark.parametrize(
    ("number", "message", "verdict", "at"),
    [
        (20, BEAT, NEWS, 2.0),
        (60, BEAT, NEWS, 2.0),
        (150, BEAT, NEWS, 2.0),  # of a new speaker
    ],
)
def test_a_frame_is_news_at_the_time_of_its_arrival(number: int, message: Any, verdict: Verdict, at: float) -> None:
    ear = Ear()
    ear.stream()
    heard = ear.hear(2.0, number, message)
    assert (heard.verdict, said(heard)) == (verdict, at)
    assert len(ear.belief.speakers) == (2 if number == 150 else 1)


def test_the_same_bytes_are_a_copy_on_any_channel_and_nobody_is_alive_by_it() -> None:
    ear = Ear()
    ear.hear(0.0, 0, text("hello"))
    for channel in ("radio", "wifi"):
        assert ear.hear(3.0, 0, text("hello"), channel) == Heard(COPY)
    assert ear.belief.copied == 2
    assert len(ear.belief.speakers) == 1
    assert ear.hear(11.0, 0, text("hello")).verdict is NEWS


def test_a_state_without_a_clock_recurs_when_its_number_does_and_is_news() -> None:
    ear = Ear()
    for tick in range(3 * 256):  # 64 frames a second: each number comes again after 4 s
        assert ear.hear(tick / 64, tick, BEAT).verdict is NEWS
    assert len(ear.belief.speakers) == 1


def test_a_sender_whose_number_never_changes_is_one_speaker() -> None:
    ear = Ear()
    for second in range(20):
        assert ear.hear(second, 0, BEAT).verdict is NEWS
        assert ear.hear(second + 0.1, 0, clock(60 + second)).verdict is NEWS
    assert len(ear.belief.speakers) == 1


def test_a_late_state_is_used_unless_a_newer_one_of_its_kind_was() -> None:
    ear = Ear()
    ear.stream()
    ear.hear(2.0, 24, BEAT)
    state = ear.hear(2.3, 22, LANDED)
    assert state.verdict is LATE
    assert said(state) == pytest.approx(2.0, abs=0.01)
    assert ear.hear(2.4, 23, BEAT) == Heard(LATE)
    event = ear.hear(2.5, 21, text("said before"))
    assert event.verdict is LATE
    assert said(event) == pytest.approx(2.0, abs=0.01)
    assert ear.hear(2.6, 20, BEAT, lag=0.0) == Heard(LATE)


def test_a_frame_of_a_late_link_has_the_time_at_which_it_was_said() -> None:
    ear = Ear()
    ear.stream()
    assert said(ear.hear(6.0, 20, clock(62.0))) == pytest.approx(2.0, abs=0.01)
    assert said(ear.hear(6.1, 21, BEAT)) == pytest.approx(2.1, abs=0.01)


def test_after_a_silence_the_count_tells_that_frames_were_held_back() -> None:
    ear = Ear()
    ear.stream()
    assert said(ear.hear(7.0, 20, BEAT)) == pytest.approx(2.0, abs=0.01)
    other = Ear()
    other.stream()
    assert said(other.hear(7.0, 20 + 40, BEAT)) == 7.0


def test_a_signature_tells_how_late_a_frame_is() -> None:
    ear = Ear()
    ear.hear(0.0, 0, BEAT)
    assert said(ear.hear(5.0, 1, BEAT, lag=3.0)) == 2.0
    assert said(ear.hear(6.0, 2, BEAT, lag=0.2)) == 6.0


def test_frames_that_say_nothing_fill_their_numbers() -> None:
    ear = Ear()
    ear.hear(0.0, 0, BEAT)
    unknown = Frame(900_000, (1, 1), 1, None, b"a frame that cannot be checked")
    assert ear.belief.hear(unknown, "radio", later(START, 0.1)) == Heard(COPY)
    (unread,) = Parser({0}).feed(encode(LANDED, system=1, component=1, sequence=2))
    heard = ear.belief.hear(unread, "radio", later(START, 0.2))
    assert (heard.verdict, heard.said) == (NEWS, None)
    assert heard.speaker is ear.belief.main


def test_a_message_that_is_counted_apart_is_no_second_speaker() -> None:
    ear = Ear()
    for second in range(10):
        ear.hear(second, 50 + 10 * second, BEAT)
        assert ear.hear(second + 0.5, second, MissionCurrent(1)).verdict is NEWS
    assert len(ear.belief.speakers) == 1


def test_what_is_lost_is_told_to_its_speaker() -> None:
    ear = Ear()
    ear.stream(count=10)
    for tick in range(20):
        ear.hear(1.0 + tick / 10, 15 + tick, BEAT)
    main = ear.belief.main
    assert main is not None
    assert main.lost_since == pytest.approx(100.9)


# -- who is who --------------------------------------------------------------------------------------------------------


def test_three_copies_on_a_channel_with_news_prove_one_speaker() -> None:
    ear = Ear()
    ear.hear(0.0, 0, BEAT)
    ear.hear(0.1, 1, BEAT, "wifi")
    assert len(ear.belief.speakers) == 2
    for number in range(2, 5):
        ear.hear(0.1 * number, number, text(str(number)))
        ear.hear(0.1 * number, number, text(str(number)), "wifi")
    assert len(ear.belief.speakers) == 1
    assert len(ear.belief.changes) == 1


def test_copies_far_from_the_count_of_a_stranger_prove_nothing() -> None:
    ear = Ear()
    ear.hear(0.0, 128, BEAT, "wifi")
    for number in range(6):
        for channel in ("radio", "wifi"):
            ear.hear(0.1 * number, number, text(str(number)), channel)
    assert len(ear.belief.speakers) == 2


def test_a_new_channel_of_the_same_clock_is_the_same_speaker_after_a_second() -> None:
    ear = Ear()
    ear.stream()
    ear.stream("wifi", first=100, start=2.0, count=10)
    assert len(ear.belief.speakers) == 2
    ear.stream("wifi", first=110, start=3.0, count=2)
    assert len(ear.belief.speakers) == 1


def test_a_channel_that_brought_only_copies_brings_news_of_the_same_speaker() -> None:
    ear = Ear()
    for number in range(4):
        for channel in ("radio", "wifi"):
            ear.hear(0.1 * number, number, text(str(number)), channel)
    heard = ear.hear(0.5, 4, BEAT, "wifi")
    assert (heard.verdict, heard.speaker) == (NEWS, ear.belief.main)


def test_a_clock_that_does_not_fit_is_that_of_another_speaker_at_once() -> None:
    ear = Ear()
    ear.stream()
    heard = ear.hear(2.0, 20, clock(900.0))
    assert heard.speaker is not ear.belief.main
    assert ear.hear(2.1, 21, clock(62.1)).speaker is ear.belief.main


def test_the_next_boot_on_a_silent_channel_joins_the_speaker() -> None:
    ear = Ear()
    ear.stream()
    for tick in range(12):
        ear.hear(5.0 + tick / 10, tick, Attitude(round(1000 * (1.0 + tick / 10)), 0.0, 0.0, 0.0))
    assert len(ear.belief.speakers) == 1
    (change,) = ear.belief.changes
    assert change.speaker is ear.belief.main
    assert getattr(change, "booted", None) == pytest.approx(104.0)


# -- bounds ------------------------------------------------------------------------------------------------------------


def test_speakers_and_counts_are_bounded() -> None:
    ear = Ear()
    ear.stream()
    for number in range(200):
        ear.hear(2.0, number * 60, text(str(number)), f"port {number % 50}")
        ear.hear(2.0, number * 60, text(f"and {number}"))
    assert len(ear.belief.speakers) <= MOST_SPEAKERS
    assert len(ear.belief._on["radio"]) <= 1 + MOST_NEW
    assert ear.belief.main in ear.belief.speakers


def test_copies_of_a_forgotten_speaker_prove_nothing() -> None:
    ear = Ear()
    ear.hear(0.0, 100, BEAT)
    for number in range(4):
        ear.hear(0.1, number, text(str(number)), "first")
    ear.belief.keep(lambda channel: channel != "first")
    ear.hear(0.2, 0, text("other"), "second")
    for number in range(4):
        ear.hear(0.3, number, text(str(number)), "second")
    assert ear.belief.main in ear.belief.speakers
    assert len(ear.belief.speakers) == 2
