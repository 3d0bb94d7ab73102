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


def test_a_parked_healthy_robot_is_calm() -> None:
    found = headline(line())
    assert (found.word, found.tone) == ("CANNOT MOVE", "calm")
    assert spoken(found) == "Cannot move: disarmed."


def test_a_reason_comes_with_the_words_of_the_autopilot_and_the_next_step() -> None:
    failing = {"name": "PREARM_FAILING", "text": "GPS 1: Bad fix", "since": STAMP}
    found = headline(line(inhibits=[failing, *line()["inhibits"]]))
    assert found.tone == "warning"
    assert spoken(found).startswith("Cannot move: disarmed, it cannot be armed. The autopilot says “GPS 1: Bad fix”.")
    assert found.step == "Wait for a fix or check the antenna."


def test_a_loss_says_since_when_and_the_last_known_state() -> None:
    found = headline(line(**LOST), line(**LIVE, in_motion=True))
    assert found.word == "LOST"
    assert spoken(found) == "Unknown since 14:03:10. It may be moving. Last known: AUTO, moving."
    assert "not possible" not in spoken(found)


def test_a_loss_without_an_age_began_when_the_last_line_was_heard() -> None:
    lost = line(**{**LOST, "link": {"state": "LOST", "heartbeat_age": None}})
    assert spoken(headline(lost, line(**LIVE))).startswith("Unknown since 14:03:19.")
    assert spoken(headline(lost)) == "Nothing is known. It may be moving."


def test_a_lost_member_is_no_reason_why_a_group_cannot_move() -> None:
    stale = {"name": "LINK_STALE", "text": None, "since": STAMP, "handle": "uR5"}
    found = headline(line(members=["base", "uR5"], inhibits=[{**line()["inhibits"][0], "handle": "base"}, stale]))
    assert spoken(found).startswith("Cannot move: base: disarmed. Another member may move: look at each. uR5: ")
    unsure = headline(line(members=["base", "uR5"], motion_possible=None, inhibits=[stale]))
    assert "uR5: its autopilot is not heard" in spoken(unsure)


def test_a_group_that_is_stopped_in_part_names_the_members_that_are() -> None:
    group = {**LIVE, "members": ["base", "arm"], "e_stopped": None, "ready": False}
    found = headline(line(**group, not_ready=[{"handle": "base", "why": "E_STOPPED"}]))
    assert (found.word, found.tone, found.rank) == ("CAN MOVE", "alarm", 0)
    assert spoken(found).startswith("base is stopped; arm is ready and may move.")
    lost = {"handle": "arm", "why": "LINK_STALE"}
    both = headline(
        line(**{**group, "motion_possible": None}, not_ready=[{"handle": "base", "why": "E_STOPPED"}, lost])
    )
    assert both.word == "STOPPED IN PART"
    assert spoken(both) == "base is stopped; arm is not heard and may move."


def test_a_group_is_stopped_if_every_member_is() -> None:
    not_ready = [{"handle": name, "why": "E_STOPPED"} for name in ("base", "arm")]
    found = headline(line(members=["base", "arm"], e_stopped=True, ready=False, not_ready=not_ready))
    assert (found.word, spoken(found)) == ("EMERGENCY STOP", "Cannot move: disarmed.")


def test_a_group_of_an_older_gateway_does_not_say_which_member_may_move() -> None:
    stop = {"name": "E_STOPPED", "text": None, "since": STAMP, "handle": "arm"}
    found = headline(line(members=["base", "arm"], e_stopped=True, inhibits=[stop]))
    assert found.word == "STOPPED IN PART"
    assert spoken(found).endswith("Another member may move: look at each.")


def test_each_member_that_is_not_ready_is_named_with_its_reason() -> None:
    reasons = ("DISARMED", "MOTION_UNKNOWN", "BATTERY_LOW", "LINK_STALE")
    not_ready = [{"handle": name, "why": why} for name, why in zip("abcd", reasons, strict=True)]
    found = headline(line(**LIVE, members=list("abcde"), ready=False, not_ready=not_ready))
    assert spoken(found).startswith(
        "a is not ready: disarmed; b may be able to move; c is not ready: the battery is low; "
        "d is not heard and may move; e is ready and may move."
    )


def test_of_a_moving_robot_nothing_says_that_it_cannot_move() -> None:
    assert spoken(headline(line(in_motion=True))).startswith("It executes no motion command: disarmed.")


def test_an_error_is_an_alarm_whatever_else_is_so() -> None:
    error = {"code": 2004, "name": "BATTERY_CRITICAL", "text": "Battery 1 critical", "since": STAMP}
    found = headline(line(**LIVE, in_motion=True, in_error=True, errors=[error]))
    assert (found.word, found.tone) == ("MOVING", "alarm")
    assert "“Battery 1 critical”" in spoken(found)


def test_of_a_group_nothing_says_that_nothing_of_it_moves() -> None:
    for stopped, possible in product((True, False, None), repeat=2):
        found = headline(line(members=["a", "b"], e_stopped=stopped, motion_possible=possible))
        assert found.word not in ("EMERGENCY STOP", "CANNOT MOVE")


def test_without_a_link_no_word_says_that_it_is_safe() -> None:
    for state, stopped in product(("LOST", "NEVER_SEEN", "", None), (True, False, None)):
        found = headline(line(link={"state": state}, e_stopped=stopped, in_motion=False))
        assert found.word in ("LOST", "NOT HEARD")


def test_any_members_of_a_line_have_a_headline() -> None:
    odd: tuple[Any, ...] = (None, True, 3, "x", [], [3], {}, {"state": 7})
    group = {"members": ["a", "b"], "ready": False, "not_ready": [{"handle": "a", "why": "E_STOPPED"}]}
    for name, value in product(group, (*odd, [{"handle": ["a"], "why": ["x"]}], [{}])):
        assert headline(line(**group) | {name: value}).word, (name, value)
        assert headline(line(**LIVE, **group) | {name: value}).word, (name, value)
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
