from __future__ import annotations

import json

from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    LinkState,
    NotReady,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers.mqtt.lines import event_of, line_of, members_of, unknown

BEFORE = RobotStatus(mode=RobotMode.MANUAL, in_error=TriState.FALSE), Detail(1, 1)
AFTER = (
    RobotStatus(mode=RobotMode.AUTO, in_error=TriState.TRUE, error_code=3),
    Detail(1, 1, errors=(ErrorCause(3, "BATTERY", None, 0),), vehicle=Vehicle(flight_mode="AUTO")),
)
MSG = RobotStatusMsg("rover", 1_000_000, *AFTER, 0.5)
OLD, NEW = members_of(RobotStatusMsg("rover", 0, *BEFORE, 0.5)), members_of(MSG)


def test_a_status_is_the_native_line() -> None:
    line = json.loads(line_of(MSG, 4))
    assert (line["seq"], line["handle"], line["mode"], line["link"]["heartbeat_age"]) == (4, "rover", "AUTO", 0.5)


def test_an_event_has_an_id_and_the_changed_members_only() -> None:
    event = event_of(MSG, OLD, NEW, "r1", "abcd", 9)
    assert (event["id"], event["session"], event["seq"], event["robot"]) == ("abcd-9", "abcd", 9, "r1")
    assert event["stamp"] == "1970-01-01T00:00:01.000000Z"
    assert event["changed"].keys() == {"mode", "in_error", "error_code", "errors", "vehicle.flight_mode"}
    assert event["changed"]["error_code"] == {"old": 0, "new": 3}
    assert event["changed"]["errors"]["old"] == []


def test_a_member_of_a_group_that_is_not_ready_any_more_is_an_event() -> None:
    ready = MSG._replace(detail=MSG.detail._replace(members=("base", "arm")))
    stopped = ready._replace(detail=ready.detail._replace(not_ready=(NotReady("arm", "E_STOPPED"),)))
    changed = event_of(stopped, members_of(ready), members_of(stopped), "robot", "abcd", 1)["changed"]
    assert changed == {
        "ready": {"old": True, "new": False},
        "not_ready": {"old": [], "new": [{"handle": "arm", "why": "E_STOPPED"}]},
    }


def test_the_first_event_has_all_members() -> None:
    changed = event_of(MSG, {}, NEW, "r1", "abcd", 1)["changed"]
    assert {change["old"] for change in changed.values()} == {None}
    assert changed["link.state"]["new"] == LinkState.CONNECTED.value


def test_a_robot_without_a_live_status_keeps_only_its_identity() -> None:
    left = unknown(json.loads(line_of(MSG, 4)), "now", "why")
    assert (left["system"], left["mode"], left["in_error"], left["errors"]) == (1, "UNKNOWN", None, [])
    assert (left["vehicle"]["flight_mode"], left["link"]["state"]) == (None, "LOST")
    assert left["inhibits"] == [{"name": "LINK_STALE", "text": "why", "since": "now"}]
    assert unknown({}, "now", None)["link"]["state"] == "NEVER_SEEN"


def test_a_group_without_a_live_status_keeps_its_members() -> None:
    group = MSG._replace(detail=MSG.detail._replace(members=("base", "arm")))
    left = unknown(json.loads(line_of(group, 4)), "now", "why")
    assert (left["members"], left["ready"]) == (["base", "arm"], False)
    assert left["not_ready"] == [{"handle": "base", "why": "LINK_STALE"}, {"handle": "arm", "why": "LINK_STALE"}]
    for other in ({}, {"members": 7}, json.loads(line_of(MSG, 4))):
        assert "members" not in unknown(other, "now", "why")
