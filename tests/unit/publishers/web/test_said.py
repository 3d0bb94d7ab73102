from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.publishers.web.said import MOST_CAUSES, MOST_SENTENCES, about, said, with_words

STAMP = "2026-11-20T14:03:20.000000Z"
HEARD: dict[str, Any] = {
    "stamp": STAMP,
    "mode": "AUTO",
    "in_motion": True,
    "errors": [{"code": 2001, "name": "RADIO_FAILSAFE", "text": "Radio Failsafe", "since": STAMP}],
    "inhibits": [{"name": "DISARMED", "text": None, "since": STAMP}],
    "link": {"state": "CONNECTED", "heartbeat_age": 0.4},
}
STALE = [{"name": "LINK_STALE", "text": "the gateway is gone", "since": STAMP}]
LOST = {**HEARD, "errors": [], "inhibits": STALE, "link": {"state": "LOST", "heartbeat_age": 10.0}}
JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


def test_a_cause_has_its_words_and_keeps_its_name() -> None:
    error, inhibit = about(HEARD, None)["causes"]
    assert (error["list"], error["code"], bool(error["words"])) == ("errors", 2001, True)
    assert (error["name"], error["text"]) == ("RADIO_FAILSAFE", "Radio Failsafe")
    assert (inhibit["list"], inhibit["words"], inhibit["name"]) == ("inhibits", "it is disarmed", "DISARMED")
    assert about(HEARD, None)["last"] is None


def test_a_lost_link_is_no_reason_why_motion_is_impossible() -> None:
    found = about(LOST, HEARD)
    assert [cause["list"] for cause in found["causes"]] == ["unheard"]
    assert found["last"]["mode"] == "AUTO"
    assert found["last"]["in_motion"] is True


def test_what_is_said_is_bounded() -> None:
    many = [{"name": f"E{n}", "text": "x", "since": STAMP} for n in range(5000)]
    line = {**HEARD, "errors": many}
    assert len(about(line, None)["causes"]) == MOST_CAUSES
    assert len(said(line, None, {})["sentences"]) == MOST_SENTENCES


def test_only_a_cause_gets_words() -> None:
    assert with_words("AUTO") == "AUTO"
    assert with_words({"name": "DISARMED", "begins": True}) == {
        "name": "DISARMED",
        "begins": True,
        "words": "it is disarmed",
    }


@given(
    st.dictionaries(st.sampled_from(sorted(HEARD)), JSON),
    st.none() | st.dictionaries(st.sampled_from(sorted(HEARD)), JSON),
)
def test_any_line_of_another_process_has_words(line: dict[str, Any], last: dict[str, Any] | None) -> None:
    for whole in ({**HEARD, **line}, {**LOST, **line}, {**HEARD, "members": ["a"], **line}):
        assert json.dumps([said(whole, last, {"a": line}), about(whole, last)])
