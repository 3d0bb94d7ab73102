from __future__ import annotations

import io
import json
from importlib.resources import files
from typing import Any

import jsonschema  # type: ignore[import-untyped]

from mav_robot_status.clock import Instant
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    PublisherContext,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers import board as boards
from mav_robot_status.publishers.board import Board, BoardPublisher
from mav_robot_status.publishers.json_lines import native, native_body

from .port import Port, msg

MANUAL, AUTO = RobotStatus(mode=RobotMode.MANUAL), RobotStatus(mode=RobotMode.AUTO)


def changes(board: Board, handle: str = "robot") -> list[tuple[str, Any, Any]]:
    return [(t.name, t.value, t.before) for t in board.entries[handle].transitions]


def test_an_entry_is_the_native_line() -> None:
    detail = Detail(1, 1, (ErrorCause(2001, "RADIO", "Radio Failsafe", 5),), (Inhibit("DISARMED", None, 7),))
    message = RobotStatusMsg("robot", 1_000_000, MANUAL._replace(in_error=TriState.TRUE, error_code=2001), detail, 0.25)
    board = Board()
    board.update(message, 1.0)
    whole = board.entries["robot"].whole()
    assert whole == json.loads(native(message, 0, native_body("robot", message.status, detail)))
    schema = json.loads((files("mav_robot_status") / "data" / "robot_status.schema.json").read_text())
    jsonschema.validate(whole, schema)


def test_the_members_of_a_group_follow_it_once_and_the_others_come_after() -> None:
    board = Board()
    for handle, detail in {
        "a": Detail(1, 1),
        "b": Detail(2, 1),
        "arm": Detail(),
        "other": Detail(),
        "robot": Detail(2, 192, members=("b", "arm", "absent")),
        "second": Detail(3, 192, members=("arm", "a")),
    }.items():
        board.update(msg(MANUAL, detail, handle), 1.0)
    assert [entry.line["handle"] for entry in board] == ["robot", "b", "arm", "second", "a", "other"]


def test_members_of_a_hostile_line_are_no_error() -> None:
    board = Board()
    for handle, members in {"a": "b", "b": [["a"], 7, None, "a", "b"], "c": {"a": 1}, "d": 7}.items():
        board.update_line(handle, {"members": members}, 1.0)
    assert [entry.line["handle"] for entry in board] == ["b", "a", "c", "d"]


def test_the_same_inhibit_of_two_members_is_two_changes() -> None:
    board = Board()
    inhibits = (Inhibit("E_STOPPED", "the button", 7, "arm"), Inhibit("E_STOPPED", None, 7, "rover"))
    board.update(msg(MANUAL, Detail(1, 192, inhibits=inhibits, members=("rover", "arm"))), 1.0)
    board.update(msg(MANUAL, Detail(1, 192, inhibits=inhibits[1:], members=("rover", "arm"))), 2.0)
    assert [value for name, value, _ in changes(board) if name == "inhibit"] == [
        {"name": "E_STOPPED", "text": "the button", "handle": "arm", "begins": True},
        {"name": "E_STOPPED", "text": None, "handle": "rover", "begins": True},
        {"name": "E_STOPPED", "text": "the button", "handle": "arm", "begins": False},
    ]


def test_seq_counts_lines_and_the_version_counts_changes() -> None:
    board = Board()
    for at in range(3):
        board.update(msg(MANUAL)._replace(unix_us=at), at)
    entry = board.entries["robot"]
    assert (entry.whole()["seq"], entry.version, board.version) == (2, 1, 1)
    assert (entry.began, entry.at, entry.stamp) == (0, 2, "1970-01-01T00:00:00.000002Z")
    board.update(msg(AUTO), 3)
    assert (entry.version, board.version) == (2, 2)


def test_an_entry_has_the_version_of_the_board_at_its_last_change() -> None:
    board = Board()
    for handle in ("a", "b", "c"):
        board.update(msg(MANUAL, handle=handle), 0)
    board.update(msg(AUTO, handle="a"), 1)
    assert {handle: entry.version for handle, entry in board.entries.items()} == {"a": 4, "b": 2, "c": 3}


def test_of_several_causes_with_one_name_the_first_is_the_transition() -> None:
    board = Board()
    board.update(msg(MANUAL), 0)
    twice = (Inhibit("PREARM_FAILING", "No fix", 0), Inhibit("PREARM_FAILING", "No sticks", 0))
    board.update(msg(MANUAL, Detail(1, 1, inhibits=twice)), 1)
    begins = [value for name, value, _ in changes(board) if name == "inhibit"]
    assert begins == [{"name": "PREARM_FAILING", "text": "No fix", "begins": True}]


def test_a_change_is_a_transition_with_the_previous_value() -> None:
    board = Board()
    board.update(msg(MANUAL), 0)
    first = changes(board)
    assert ("mode", "MANUAL", None) in first
    assert ("link", "CONNECTED", None) in first
    detail = Detail(1, 1, vehicle=Vehicle(flight_mode="GUIDED"), inhibits=(Inhibit("DISARMED", "no", 0),))
    board.update(msg(AUTO, detail), 1)
    assert changes(board)[len(first) :] == [
        ("mode", "AUTO", "MANUAL"),
        ("flight_mode", "GUIDED", None),
        ("inhibit", {"name": "DISARMED", "text": "no", "begins": True}, None),
    ]
    board.update(msg(AUTO, detail._replace(inhibits=(), link=LinkState.LOST)), 2)
    assert changes(board)[-1] == ("link", "LOST", "CONNECTED")  # nobody knows whether it is armed
    board.update(msg(AUTO, detail._replace(inhibits=())), 3)
    assert changes(board)[-2:] == [
        ("link", "CONNECTED", "LOST"),
        ("inhibit", {"name": "DISARMED", "text": "no", "begins": False}, None),
    ]


def test_a_loss_ends_no_error_and_the_last_line_before_it_is_kept() -> None:
    board, error = Board(), ErrorCause(2001, "RADIO", "Radio Failsafe", 5)
    lost = Detail(1, 1, inhibits=(Inhibit("LINK_STALE", None, 9),), link=LinkState.LOST)
    for at, detail in enumerate((Detail(1, 1, (error,)), lost, Detail(1, 1, (error,)), Detail(1, 1))):
        board.update(msg(AUTO, detail)._replace(unix_us=at), at)
    assert [value["begins"] for name, value, _ in changes(board) if name in ("error", "inhibit")] == [True, False]
    last = board.entries["robot"].last
    assert last is not None
    assert (last["stamp"], last["errors"][0]["name"], last["link"]["heartbeat_age"]) == (
        "1970-01-01T00:00:00.000000Z",
        "RADIO",
        0.1,
    )


def test_an_error_of_a_member_that_is_not_heard_does_not_end() -> None:
    board, members = Board(), ("rover", "arm")
    error, stale = ErrorCause(2001, "RADIO", None, 5, "rover"), Inhibit("LINK_STALE", None, 9, "rover")
    board.update(msg(AUTO, Detail(1, 192, (error,), members=members)), 0)
    board.update(msg(AUTO, Detail(1, 192, inhibits=(stale,), members=members)), 1)
    assert [value for name, value, _ in changes(board) if name == "error"] == [
        {"name": "RADIO", "text": None, "handle": "rover", "begins": True}
    ]


def test_a_line_can_come_with_the_last_one_before_a_loss() -> None:
    board = Board()
    board.update_line("robot", {"link": {"state": "LOST"}}, 1.0, {"mode": "AUTO"})
    assert board.entries["robot"].last == {"mode": "AUTO"}


def test_several_reasons_of_one_name_begin_and_end_together_with_the_first_text() -> None:
    board = Board()
    gps, compass = Inhibit("PREARM_FAILING", "GPS", 0), Inhibit("PREARM_FAILING", "Compass", 0)
    for at, inhibits in enumerate(((), (gps, compass), (compass,), ())):
        board.update(msg(MANUAL)._replace(detail=Detail(1, 1, inhibits=inhibits)), at)
    assert [value for name, value, _ in changes(board) if name == "inhibit"] == [
        {"name": "PREARM_FAILING", "text": "GPS", "begins": True},
        {"name": "PREARM_FAILING", "text": "Compass", "begins": False},
    ]


def test_transitions_are_bounded_in_age_and_number() -> None:
    board = Board()
    for at in range(2000):
        board.update(msg(AUTO if at % 2 else MANUAL), at / 100)
    entry = board.entries["robot"]
    assert [t.name for t in entry.transitions].count("mode") == boards.MOST_TRANSITIONS
    board.update(msg(AUTO._replace(in_error=TriState.FALSE)), 19.99 + boards.KEPT + 1)
    assert [t.name for t in entry.transitions] == ["in_error"]


def test_a_field_is_known_since_its_oldest_kept_change_and_a_busy_one_displaces_no_other() -> None:
    board, count = Board(), 700
    for at in range(count):
        board.update(msg(AUTO if at % 2 else MANUAL), at / 10)
    entry = board.entries["robot"]
    since = entry.kept_since()
    assert since["mode"] == next(t.at for t in entry.transitions if t.name == "mode") > 0.0
    assert since["in_error"] == since["link"] == entry.began == 0.0
    assert [t.name for t in entry.transitions].count("in_error") == 1


def test_the_events_of_the_robots_are_on_the_board_and_an_acknowledgement_is_a_change() -> None:
    board, now = Board(), Instant(5.0, 5_000_000)
    board.update(msg(AUTO._replace(e_stopped=TriState.TRUE)), 0.0)
    assert [(one.word, one.what) for one in board.alarms.events] == [("EMERGENCY STOP", "begins")]
    version = board.version
    board.acknowledge("robot", now)
    assert (board.version, len(board.alarms.pending)) == (version + 1, 0)
    board.acknowledge("robot", now)
    assert board.version == version + 1


def test_the_number_of_handles_is_bounded() -> None:
    board = Board()
    for number in range(boards.MOST_HANDLES + 3):
        board.update_line(f"robot{number}", {}, 0)
    assert (len(board.entries), board.refused) == (boards.MOST_HANDLES, 3)


def test_the_same_line_from_another_process_makes_the_same_entry() -> None:
    message = msg(AUTO, Detail(1, 1, inhibits=(Inhibit("DISARMED", None, 7),)))
    here, there = Board(), Board()
    here.update(message, 1.0)
    there.update_line("robot", json.loads(native(message, 40, native_body("robot", AUTO, message.detail))), 1.0)
    assert there.entries["robot"].whole() == here.entries["robot"].whole()
    assert changes(there) == changes(here)


def test_any_content_of_a_line_of_another_process_is_accepted() -> None:
    board = Board()
    lines: list[dict[str, Any]] = [
        {}, {"link": 3}, {"errors": {"a": 1}}, {"errors": [1, {"name": []}]}, {"vehicle": []}, {"mode": ["x"]},
        {"system": "1", "component": []}, {"system": 1, "component": {}}, {"handle": {}}, {"stamp": None},
    ]  # fmt: skip
    for number, line in enumerate(lines):
        board.update_line("robot", line, number)
        board.update_line(f"robot{number}", line, number)
    assert len(list(board)) == len(lines) + 1
    assert all(json.dumps(entry.whole()) for entry in board)


def test_entries_are_in_order_of_system_and_those_without_ids_are_last() -> None:
    board = Board()
    for handle, system in (("x", None), ("b", 2), ("c", 10), ("a", 2)):
        board.update(msg(AUTO, Detail(system, None if system is None else 1), handle), 0)
    assert [entry.line["handle"] for entry in board] == ["a", "b", "c", "x"]


def test_the_publisher_puts_messages_on_its_board() -> None:
    publisher = BoardPublisher(PublisherContext({}, Port(), io.StringIO()))
    publisher.publish(msg(MANUAL))
    publisher.publish(msg(AUTO))
    assert not publisher.board.entries
    publisher.service(Instant(5.0, 0))
    assert publisher.board.entries["robot"].line["mode"] == "AUTO"
    assert publisher.board.entries["robot"].at == 5.0
    publisher.close()
