"""Tests of the verdict on a log."""

from __future__ import annotations

from mav_robot_status.interface import Inhibit
from mav_robot_status.views.verdict import LONGEST, Verdict, verdict

from .flights import FALSE, START_US, TRUE, Flight, error

CRASH = error(4001, "CRASH", "Crash: Going to HOLD")
REFUSED = Inhibit("PREARM_FAILING", "PreArm: GPS 1: Bad fix", START_US)


def of(flight: Flight, end: float) -> Verdict:
    timeline = flight.end(end)
    return verdict(timeline, timeline.vehicles[0])


def test_a_crash_says_when_after_what_and_how_it_ended() -> None:
    flight = Flight().say(0, armed=False).say(10).say(25, errors=(CRASH,)).say(27, armed=False, errors=(CRASH,))
    found = of(flight, 30)
    assert found.sentence == "CRASHED at 08:00:25, 15 s into MANUAL: “Crash: Going to HOLD”; disarmed 2 s later."
    assert found.members() == {"state": "CRASHED", "word": "CRASHED", "sentence": found.sentence}


def test_an_emergency_stop_lasts_to_the_end_of_the_log() -> None:
    flight = Flight().say(0, e_stopped=FALSE).say(10, armed=False, e_stopped=TRUE)
    assert of(flight, 20).sentence == "EMERGENCY STOP from 08:00:10 to the end of the log."


def test_a_parked_robot_that_begins_with_a_stop_is_judged_by_its_drive() -> None:
    flight = Flight().say(0, armed=False, e_stopped=TRUE).say(5, armed=False, e_stopped=FALSE)
    flight.say(10).say(25, errors=(CRASH,))
    assert of(flight, 30).state.word == "CRASHED"


def test_one_that_was_never_armed_says_why_and_how_often() -> None:
    flight = Flight()
    for second in range(0, 56, 14):
        flight.say(second, armed=False, inhibits=(REFUSED,)).say(second + 7, armed=False)
    found = of(flight, 60)
    assert found.sentence == "CANNOT ARM: it was never armed in 60 s; “PreArm: GPS 1: Bad fix” 4 times."
    assert found.members()["state"] == "CANNOT_ARM"


def test_a_drive_without_a_fault_is_ready() -> None:
    flight = Flight().say(0, armed=False).say(5).say(30, armed=False)
    assert of(flight, 40).sentence == "READY: one drive of 25 s in MANUAL, no fault."
    assert of(Flight().say(0, armed=False).say(5), 30).state.word == "ARMED"


def test_a_parked_log_is_parked() -> None:
    assert of(Flight().say(0, armed=False), 60).sentence == "PARKED: it was never armed in 60 s, no fault."


def test_a_lost_link_is_told() -> None:
    assert of(Flight().say(0).lose(10).say(20), 30).sentence == "LOST from 08:00:10 to 08:00:20."


def test_a_sentence_is_bounded() -> None:
    found = of(Flight().say(0).say(5, errors=(error(4001, "CRASH", "x" * 500),)), 10)
    assert len(found.sentence) <= LONGEST
    assert "lasts to the end of the log" in found.sentence
