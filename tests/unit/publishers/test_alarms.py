"""Tests of the events, and of what waits for a person."""

from __future__ import annotations

from typing import Any

from mav_robot_status.publishers.alarms import MOST_EVENTS, MOST_PENDING, Alarms, name_of

LIVE: dict[str, Any] = {
    "handle": "rover",
    "drives_powered": True,
    "motion_possible": True,
    "e_stopped": False,
    "in_motion": False,
    "errors": [],
    "inhibits": [],
    "link": {"state": "CONNECTED"},
}
STOPPED = {**LIVE, "e_stopped": True, "motion_possible": False, "drives_powered": False}
LOST = {**LIVE, "e_stopped": None, "link": {"state": "LOST"}}
REFUSED = {
    **STOPPED,
    "e_stopped": False,
    "inhibits": [{"name": "PREARM_FAILING", "text": "PreArm: GPS 1: Bad fix"}],
}


def crashed(text: str = "Crash: Going to HOLD") -> dict[str, Any]:
    return {**LIVE, "in_error": True, "errors": [{"code": 4001, "name": "CRASH", "text": text}]}


def played(*lines: dict[str, Any]) -> Alarms:
    alarms = Alarms()
    for at, line in enumerate(lines):
        alarms.take("rover", line, f"12:00:0{at % 10}", at)
    return alarms


def told(alarms: Alarms) -> list[tuple[str, str, str]]:
    return [(one.word, one.what, one.why) for one in alarms.events]


def test_a_trouble_begins_and_ends() -> None:
    assert told(played(LIVE, STOPPED, STOPPED, LIVE)) == [
        ("EMERGENCY STOP", "begins", "engaged"),
        ("EMERGENCY STOP", "ends", "released, now ARMED"),
    ]


def test_a_stop_of_which_nothing_is_known_is_not_called_released() -> None:
    assert told(played(STOPPED, {**LIVE, "e_stopped": None}))[-1][2].startswith("unknown whether it is released")


def test_a_loss_ends_nothing() -> None:
    assert told(played(crashed(), LOST, crashed(), LIVE)) == [
        ("CRASHED", "begins", "Going to HOLD"),
        ("LOST", "begins", "nothing heard"),
        ("LOST", "ends", "heard again, now CRASHED"),
        ("CRASHED", "ends", "Going to HOLD ended, now ARMED"),
    ]


def test_an_alarm_waits_for_a_person_even_if_it_ends() -> None:
    alarms = played(STOPPED, LIVE)
    assert [one.word for one in alarms.pending.values()] == ["EMERGENCY STOP"]
    assert not alarms.acknowledge("other", "12:01:00", 7)
    assert alarms.acknowledge("rover", "12:01:00", 7)
    assert not alarms.pending
    assert told(alarms)[-1][:2] == ("EMERGENCY STOP", "acknowledged")
    assert (alarms.version, alarms.events[-1].stamp) == (7, "12:01:00")


def test_what_was_acknowledged_and_happens_again_waits_again() -> None:
    alarms = played(STOPPED)
    alarms.acknowledge(None, "12:01:00", 2)
    for at, line in enumerate((LIVE, STOPPED), 3):
        alarms.take("rover", line, "12:02:00", at)
    assert len(alarms.pending) == 1


def test_a_robot_that_cannot_arm_has_an_event_and_waits_for_nobody() -> None:
    alarms = played(REFUSED)
    assert told(alarms) == [("CANNOT ARM", "begins", "GPS 1: Bad fix")]
    assert not alarms.pending


def test_of_a_group_its_members_tell() -> None:
    assert not played({**STOPPED, "members": ["base"]}).events


def test_events_are_bounded_and_the_last_ones_stay() -> None:
    alarms = Alarms()
    for at in range(1000):
        alarms.take(f"robot-{at}", STOPPED, "12:00:00", at)
    assert (len(alarms.events), len(alarms.pending)) == (MOST_EVENTS, MOST_PENDING)
    assert alarms.events[-1].handle == "robot-999"
    alarms.forget("robot-999", 1000)
    assert len(alarms.pending) == MOST_PENDING - 1
    assert alarms.version == 1000


def test_a_robot_has_the_name_that_the_page_gives_it() -> None:
    default = "industrial_robot_status_handle"
    assert name_of(default, {"system": 3}) == name_of(f"{default}/3.1", {"system": 3}) == "System 3"
    assert name_of("rover", {"system": 3, "vehicle": {"name": "Rover A"}}) == "Rover A"
    assert name_of("rover", {"vehicle": None}) == "rover"
