"""Tests of when a vehicle of a log was heard."""

from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.diagnosis.doctor.heard import Heard, LastStatus, Listener, duration
from mav_robot_status.interface import (
    Detail,
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    LinkState,
    RobotStatus,
    TriState,
)

START_US = 1_800_000_000_000_000


class Log:
    """One handle, and what the listener is shown of it."""

    def __init__(self) -> None:
        self.handle = IndustrialRobotStatusHandle("h")
        self.handles = IndustrialRobotStatusInterface()
        self.handles.register_handle(self.handle)
        self.listener = Listener()

    def say(self, at: float, heard_at: float | None, link: LinkState, moving: TriState = TriState.FALSE) -> Log:
        self.handle.heard_at = heard_at
        self.handle.detail = Detail(link=link)
        self.handle.status = RobotStatus(in_motion=moving)
        self.listener.on_tick(self.handles, instant(at))
        return self

    def end(self, at: float) -> Heard | None:
        return self.listener.heard(self.handle, instant(at))


def instant(at: float) -> Instant:
    return Instant(at, START_US + round(at * 1e6))


def test_a_vehicle_that_was_never_heard_has_no_times() -> None:
    assert Log().say(0, None, LinkState.NEVER_SEEN).end(9) is None


def test_the_last_status_is_that_of_the_last_heartbeat_and_not_of_the_silence_after_it() -> None:
    log = Log().say(0, 0, LinkState.CONNECTED).say(10, 10, LinkState.CONNECTED, TriState.TRUE)
    log.say(13, 10, LinkState.CONNECTED, TriState.UNKNOWN).say(13.5, 10, LinkState.LOST, TriState.UNKNOWN)
    found = log.end(40)
    assert found is not None
    assert (found.seconds, found.times, found.silence, found.until_us) == (10, 1, 30, START_US + 10_000_000)
    assert found.last.fields["in_motion"] is True


def test_a_silence_inside_a_log_does_not_count_as_heard() -> None:
    log = Log().say(0, 0, LinkState.CONNECTED).say(13, 10, LinkState.LOST)
    log.say(50, 50, LinkState.CONNECTED).say(60, 60, LinkState.CONNECTED)
    assert log.end(61) == Heard(20, 2, START_US + 60_000_000, 0.0, log.end(61).last)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0, "0.0 s"), (9.94, "9.9 s"), (9.96, "10 s"), (59.6, "1 min 0 s"), (252, "4 min 12 s"), (3725, "1 h 02 min")],
)
def test_a_duration_in_words(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_several_pieces_are_named() -> None:
    assert Heard(60, 3, 0, 0, LastStatus()).words == "1 min 0 s in 3 pieces"
