"""Tests of the headline."""

from __future__ import annotations

from itertools import product
from typing import Any

from mav_robot_status.language import Headline, headline

STAMP = "2026-11-20T14:03:20.000000Z"


def line(**members: Any) -> dict[str, Any]:
    """A parked rover: disarmed and healthy."""
    parked = {
        "stamp": STAMP,
        "mode": "MANUAL",
        "e_stopped": False,
        "drives_powered": False,
        "motion_possible": False,
        "in_motion": False,
        "in_error": False,
        "error_code": 0,
        "errors": [],
        "inhibits": [{"name": "DISARMED", "text": None, "since": STAMP}],
        "vehicle": {"flight_mode": "HOLD"},
        "link": {"state": "CONNECTED", "heartbeat_age": 0.4},
    }
    return {**parked, **members}


LIVE: dict[str, Any] = {"motion_possible": True, "drives_powered": True, "mode": "AUTO", "inhibits": []}
LOST: dict[str, Any] = {
    **dict.fromkeys(("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")),
    "mode": "UNKNOWN",
    "inhibits": [{"name": "LINK_STALE", "text": None, "since": STAMP}],
    "link": {"state": "LOST", "heartbeat_age": 10.0},
}


def spoken(found: Headline) -> str:
    return " ".join(one.plain(lambda at: at[11:19]) for one in found.sentences)


def error(name: str, text: str | None = None, code: int = 4001) -> dict[str, Any]:
    return {"in_error": True, "errors": [{"code": code, "name": name, "text": text, "since": STAMP}]}


def test_a_parked_healthy_robot_is_calm() -> None:
    found = headline(line())
    assert (found.word, found.tone) == ("PARKED", "calm")
    assert spoken(found) == "Parked: it is disarmed."
    ready = headline(line(vehicle={"flight_mode": "HOLD", "can_arm": True}))
    assert (ready.word, ready.tone) == ("READY", "calm")
    assert found.step == ready.step == "To drive, arm it."


def test_the_cause_comes_first_with_the_words_of_the_autopilot_and_the_next_step() -> None:
    failing = {"name": "PREARM_FAILING", "text": "GPS 1: Bad fix", "since": STAMP}
    found = headline(line(inhibits=[failing, *line()["inhibits"]]))
    assert (found.word, found.tone) == ("CANNOT ARM", "warning")
    assert spoken(found) == "Cannot arm: “GPS 1: Bad fix”. Disarmed."
    assert found.step == "Wait for a fix or check the antenna."
    crashed = headline(line(**error("CRASH", "Crash: Going to HOLD")))
    assert (crashed.word, crashed.tone) == ("CRASHED", "alarm")
    assert spoken(crashed) == "Crashed: “Crash: Going to HOLD”. Disarmed."


def test_three_robots_that_cannot_move_have_three_words() -> None:
    failing = {"name": "PREARM_FAILING", "text": "GPS 1: Bad fix", "since": STAMP}
    lines = line(), line(inhibits=[failing, *line()["inhibits"]]), line(**error("CRASH"))
    assert [headline(one).word for one in lines] == ["PARKED", "CANNOT ARM", "CRASHED"]


def test_a_loss_says_when_it_was_last_heard_and_what_it_was() -> None:
    found = headline(line(**LOST), line(**LIVE, in_motion=True))
    assert found.word == "LOST"
    assert spoken(found) == "Last heard 14:03:10: armed, moving, AUTO. It may be moving."
    assert spoken(headline(line(**LOST), line())) == "Last heard 14:03:10: disarmed, still, MANUAL. It may be moving."


def test_a_loss_without_an_age_began_when_the_last_line_was_heard() -> None:
    lost = line(**{**LOST, "link": {"state": "LOST", "heartbeat_age": None}})
    assert spoken(headline(lost, line(**LIVE))).startswith("Last heard 14:03:19: ")
    assert spoken(headline(lost)) == "It may be moving."


def group(**members: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The lines of a group and of its members: it may move if one may."""
    may = any(one["motion_possible"] is not False for one in members.values())
    return line(members=list(members), motion_possible=may, e_stopped=None, inhibits=[]), members


def test_a_group_says_of_each_member_what_it_is() -> None:
    stop = {"name": "E_STOPPED", "text": None, "since": STAMP}
    whole, members = group(base=line(e_stopped=True, inhibits=[stop]), arm=line(**LIVE))
    found = headline(whole, None, members)
    assert found.sentences[0].text == "base is stopped; arm is READY and may move"
    assert (found.word, found.tone) == ("ARMED", "alarm")
    assert found.step.startswith("Find out why the emergency stop is engaged")
    lost, members = group(base=line(), arm=line(**LOST))
    assert headline(lost, None, members).sentences[0].text == "arm is LOST and may move; base is PARKED"


def test_a_stop_of_one_member_is_never_that_of_the_group() -> None:
    stop = {"name": "E_STOPPED", "text": None, "since": STAMP}
    stopped = line(e_stopped=True, inhibits=[stop])
    whole = line(members=["base", "arm"], e_stopped=True)  # a site may configure a group so
    assert headline(whole, None, {"base": stopped, "arm": line(**LIVE)}).word == "ARMED"
    assert headline(whole, None, {"base": stopped, "arm": stopped}).word == "EMERGENCY STOP"
    assert headline({**whole, "drives_powered": True}).word != "EMERGENCY STOP"


def test_a_group_whose_members_are_not_here_says_what_its_line_says_of_them() -> None:
    whole = {**LIVE, "members": ["base", "arm"], "e_stopped": None, "ready": False}
    found = headline(line(**whole, not_ready=[{"handle": "base", "why": "E_STOPPED"}]))
    assert found.sentences[0].text == "base is stopped; arm is READY and may move"
    assert (found.word, found.tone) == ("ARMED", "alarm")
    reasons = ("DISARMED", "MOTION_UNKNOWN", "BATTERY_LOW", "LINK_STALE")
    not_ready = [{"handle": name, "why": why} for name, why in zip("abcd", reasons, strict=True)]
    found = headline(line(**LIVE, members=list("abcde"), ready=False, not_ready=not_ready))
    assert found.sentences[0].text == (
        "a is not ready: it is disarmed; b is UNKNOWN and may move; c is not ready: the battery is low; "
        "d is LOST and may move; e is READY and may move"
    )


def test_of_a_moving_robot_nothing_says_that_it_cannot_move() -> None:
    assert spoken(headline(line(in_motion=True))).startswith("It ignores motion commands: it is disarmed.")


def test_a_robot_that_moves_with_an_error_is_moving_in_the_tone_of_an_alarm() -> None:
    found = headline(line(**LIVE, in_motion=True, **error("BATTERY_CRITICAL", "Battery 1 critical")))
    assert (found.word, found.tone) == ("MOVING", "alarm")
    assert spoken(found).startswith("The battery is nearly empty: “Battery 1 critical”. A program drives it (HOLD).")


def test_of_a_group_with_a_member_that_may_move_nothing_says_that_it_is_stopped() -> None:
    for stopped, possible in product((True, False, None), (True, None)):
        found = headline(line(members=["a", "b"], e_stopped=stopped, motion_possible=possible))
        assert found.word not in ("EMERGENCY STOP", "PARKED", "READY"), (stopped, possible)


def test_a_mode_that_is_in_no_table_says_so() -> None:
    found = headline(line(**{**LIVE, "mode": "UNKNOWN"}, vehicle={"flight_mode": "CMODE(77)"}))
    assert spoken(found).endswith("Mode 77 is not in our tables: pilot or program, unknown.")


def test_two_autopilots_with_one_id_are_a_conflict_that_names_the_id() -> None:
    found = headline(line(**LIVE, system=7, **error("SYSTEM_ID_CONFLICT", None, 9002)))
    assert found.word == "CONFLICT"
    assert spoken(found).startswith("Two autopilots use system id 7.")


def test_one_cause_is_one_error() -> None:
    both = [{"code": 2003, "name": "BATTERY_LOW", "text": None}, {"code": 3025, "name": "SENSOR_BATTERY", "text": None}]
    found = headline(line(in_error=True, errors=both))
    assert spoken(found) == "The battery is low. Disarmed."


def test_an_error_without_a_cause_is_a_fault() -> None:
    found = headline(line(**LIVE, in_error=True, error_code=17))
    assert found.word == "FAULT"
    assert spoken(found).startswith("Error 17: no reason was reported.")


def test_without_a_link_no_word_says_that_it_is_safe() -> None:
    for state, stopped in product(("LOST", "NEVER_SEEN", "", None), (True, False, None)):
        found = headline(line(link={"state": state}, e_stopped=stopped, in_motion=False))
        assert found.word in ("LOST", "NOT HEARD")


def test_any_members_of_a_line_have_a_headline() -> None:
    odd: tuple[Any, ...] = (None, True, 3, "x", [], [3], {}, {"state": 7})
    for name, value in product(line(), odd):
        assert headline(line(**{name: value})).word, (name, value)
        assert headline(line(**LOST) | {name: value}, line(**{name: value})).word, (name, value)


def test_a_robot_that_cannot_move_and_may_still_roll_is_not_called_still() -> None:
    assert "Whether it moves is unknown." in spoken(headline(line(in_motion=None)))
    assert "Whether it moves is unknown." in spoken(headline(line(in_motion=None, e_stopped=True)))
    assert "unknown" not in spoken(headline(line()))


def test_a_stopped_robot_that_moves_is_the_first_problem() -> None:
    found = headline(line(**LIVE, in_motion=True, e_stopped=True))
    assert (found.word, found.tone) == ("MOVING", "alarm")
    assert found.rank < headline(line(**LOST)).rank
