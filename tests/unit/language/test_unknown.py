"""What would make an UNKNOWN field known."""

from __future__ import annotations

import pytest

from mav_robot_status.language import next_step, same_step
from mav_robot_status.language.unknown import AUTOPILOTS, OTHERWISE, TABLE, row_of


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.reason)
def test_only_an_ardupilot_is_told_to_install_its_applet(row: object, autopilot: str) -> None:
    words = row.words_for(autopilot)  # type: ignore[attr-defined]
    assert words.endswith((".", "else"))
    assert autopilot == "ArduPilot" or "applet`" not in words


def test_no_row_hides_a_later_one() -> None:
    for row in TABLE:
        assert row_of((row.fields or ("e_stopped",))[0], row.reason) is row


def test_what_rests_on_another_field_has_its_words() -> None:
    rule = "the motor outputs were held by a stop, and no release was seen"
    assert next_step("drives_powered", f"e_stopped: {rule}", "ArduPilot") == next_step("e_stopped", rule, "ArduPilot")


def test_a_request_without_an_answer_is_told() -> None:
    asked = {"GLOBAL_POSITION_INT": "Asked for 12 s ago, no answer."}
    assert next_step("in_motion", "no fresh speed", "PX4", asked).endswith("Asked for 12 s ago, no answer.")
    assert "Asked" not in next_step("in_error", "no fresh SYS_STATUS", "PX4", asked)


def test_a_reason_without_a_row_has_words_too() -> None:
    assert next_step("in_motion", "a rule of tomorrow", "PX4") == OTHERWISE


def test_fields_that_need_the_same_share_a_line() -> None:
    assert same_step({"a": "x", "b": "y", "c": "x"}) == {"x": ["a", "c"], "y": ["b"]}
