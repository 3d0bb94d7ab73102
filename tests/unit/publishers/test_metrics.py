"""Metrics in the text format of Prometheus."""

from __future__ import annotations

import re

import pytest

from mav_robot_status import __version__
from mav_robot_status.interface import (
    ConnectionMetrics,
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    Metrics,
    PublisherMetrics,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers.metrics import CONNECTION, GATEWAY, PREFIX, PUBLISHER, VEHICLE, exposition

YES, NO, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
STATUS = RobotStatus(
    mode=RobotMode.AUTO,
    e_stopped=NO,
    drives_powered=YES,
    motion_possible=NO,
    in_motion=UNKNOWN,
    in_error=YES,
    error_code=2001,
)
DETAIL = Detail(
    1,
    1,
    (ErrorCause(2001, "RC_LOST", "Radio failsafe on", 0), ErrorCause(2004, "BATTERY_CRITICAL", None, 0)),
    (Inhibit("DISARMED", None, 0),),
    Vehicle("ARDUPILOTMEGA", "GROUND_ROVER", "AUTO", 10, "ACTIVE"),
)
ROVER = RobotStatusMsg("rover", 0, STATUS, DETAIL, 0.25)
ROBOT = RobotStatusMsg(
    "robot",
    0,
    RobotStatus(motion_possible=NO),
    Detail(
        1,
        192,
        inhibits=(Inhibit("E_STOPPED", "the button", 0, "arm"), Inhibit("E_STOPPED", None, 0, "rover")),
        vehicle=Vehicle(type="GROUP"),
        members=("rover", "arm"),
    ),
    0.25,
)
UNHEARD = RobotStatusMsg("boat", 0, RobotStatus(), Detail(link=LinkState.NEVER_SEEN), None)
LINK = ConnectionMetrics("udp:0.0.0.0:14550", False, 1, 100, 2, {0: 3, 74: 4}, 5, 6, 7, 8, 9, 10)
OF_ROVER = 'handle="rover",system="1",component="1"'


def samples(*vehicles: RobotStatusMsg, **others: object) -> dict[str, str]:
    """The samples by name and labels, without the prefix."""
    text = exposition(Metrics(vehicles, **others))  # type: ignore[arg-type]
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    found = dict(line.rsplit(" ", 1) for line in lines)
    assert len(found) == len(lines), "a series stands there twice"
    return {series.removeprefix(PREFIX): value for series, value in found.items()}


def test_the_fields_are_the_numbers_of_industrial_msgs() -> None:
    found = samples(ROVER)
    names = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error", "error_code")
    assert [found[f"{name}{{{OF_ROVER}}}"] for name in names] == ["2", "0", "1", "0", "-1", "1", "2001"]


def test_a_connected_vehicle_is_up_and_its_heartbeat_has_an_age() -> None:
    found = samples(ROVER)
    assert found[f"link_up{{{OF_ROVER}}}"] == "1"
    assert found[f"heartbeat_age_seconds{{{OF_ROVER}}}"] == "0.25"


def test_a_lost_vehicle_is_not_up_and_its_age_still_grows() -> None:
    found = samples(ROVER._replace(detail=DETAIL._replace(link=LinkState.LOST), heartbeat_age=90.0))
    assert found[f"link_up{{{OF_ROVER}}}"] == "0"
    assert found[f"heartbeat_age_seconds{{{OF_ROVER}}}"] == "90"


def test_each_active_cause_and_reason_is_a_series_and_no_other() -> None:
    found = samples(ROVER)
    causes = {series for series in found if series.startswith(("error{", "inhibit{"))}
    assert causes == {
        f'error{{{OF_ROVER},code="2001",cause="RC_LOST"}}',
        f'error{{{OF_ROVER},code="2004",cause="BATTERY_CRITICAL"}}',
        f'inhibit{{{OF_ROVER},reason="DISARMED"}}',
    }
    assert not [series for series in samples(UNHEARD) if series.startswith(("error{", "inhibit{"))]


def test_several_reasons_of_one_name_are_one_series() -> None:
    inhibits = (*DETAIL.inhibits, Inhibit("PREARM_FAILING", "GPS", 0), Inhibit("PREARM_FAILING", "Compass", 0))
    page = samples(ROVER._replace(detail=DETAIL._replace(inhibits=inhibits)))
    assert [series for series in page if "PREARM_FAILING" in series] == [
        f'inhibit{{{OF_ROVER},reason="PREARM_FAILING"}}'
    ]


def test_a_reason_that_is_there_twice_is_one_series() -> None:
    twice = (Inhibit("PREARM_FAILING", "No fix", 0), Inhibit("PREARM_FAILING", "No sticks", 0))
    found = samples(ROVER._replace(detail=DETAIL._replace(inhibits=twice)))
    assert found[f'inhibit{{{OF_ROVER},reason="PREARM_FAILING"}}'] == "1"


@pytest.mark.parametrize(("can_arm", "value"), [(True, "1"), (False, "0"), (None, None)])
def test_can_arm_is_a_number_while_it_is_known(can_arm: bool | None, value: str | None) -> None:
    found = samples(ROVER._replace(detail=DETAIL._replace(vehicle=DETAIL.vehicle._replace(can_arm=can_arm))))
    assert found.get(f"can_arm{{{OF_ROVER}}}") == value


def test_a_text_of_an_autopilot_is_never_a_label() -> None:
    assert "Radio failsafe" not in exposition(Metrics((ROVER,)))


def test_a_vehicle_without_a_heartbeat_has_no_age_and_no_info() -> None:
    found = samples(UNHEARD)
    of_boat = 'handle="boat",system="",component=""'
    assert found[f"link_up{{{of_boat}}}"] == "0"
    assert found[f"mode{{{of_boat}}}"] == "-1"
    assert not [series for series in found if series.startswith(("heartbeat_age", "vehicle_info"))]


def test_a_connection_counts_frames_and_errors() -> None:
    of_link = 'connection="udp:0.0.0.0:14550",role="vehicle"'
    assert {s: v for s, v in samples(connections=(LINK,)).items() if s.startswith("connection")} == {
        f"connection_frames_total{{{of_link}}}": "100",
        f"connection_lost_frames_total{{{of_link}}}": "2",
        f'connection_crc_errors_total{{{of_link},message_id="0"}}': "3",
        f'connection_crc_errors_total{{{of_link},message_id="74"}}': "4",
        f"connection_unknown_frames_total{{{of_link}}}": "5",
        f"connection_incompatible_frames_total{{{of_link}}}": "6",
        f"connection_garbage_bytes_total{{{of_link}}}": "7",
        f"connection_dropped_total{{{of_link}}}": "8",
        f"connection_unasked_bytes_total{{{of_link}}}": "9",
        f"connection_held_back_total{{{of_link}}}": "10",
        f"connection_peers{{{of_link}}}": "1",
    }


def test_two_connections_with_the_same_name_are_added_because_a_series_must_be_unique() -> None:
    found = samples(connections=(LINK, LINK, LINK._replace(is_out=True)))
    assert found['connection_frames_total{connection="udp:0.0.0.0:14550",role="vehicle"}'] == "200"
    assert found['connection_frames_total{connection="udp:0.0.0.0:14550",role="out"}'] == "100"


def test_a_publisher_has_the_length_of_its_queue_and_its_drops() -> None:
    found = samples(publishers=(PublisherMetrics("json", 1, 3, 4), PublisherMetrics("json", 2, 0, 0)))
    assert found['publisher_queued_messages{publisher="json",number="1"}'] == "3"
    assert found['publisher_dropped_messages_total{publisher="json",number="1"}'] == "4"
    assert found['publisher_dropped_messages_total{publisher="json",number="2"}'] == "0"


def test_a_group_is_another_series_than_its_vehicle_and_names_its_members() -> None:
    found = samples(ROVER, ROBOT)
    of_robot = 'handle="robot",system="1",component="192"'
    assert found[f"motion_possible{{{of_robot}}}"] == "0"
    assert found[f'inhibit{{{of_robot},reason="E_STOPPED",member="arm"}}'] == "1"
    assert found[f'inhibit{{{of_robot},reason="E_STOPPED",member="rover"}}'] == "1"
    assert [series for series in found if series.startswith("group_member")] == [
        f'group_member{{{of_robot},member="rover"}}',
        f'group_member{{{of_robot},member="arm"}}',
    ]
    assert not [series for series in found if series.startswith(f"vehicle_info{{{of_robot}")]


def test_a_gateway_without_a_recording_has_no_series_for_it() -> None:
    assert samples(record_dropped=0)["record_dropped_frames_total"] == "0"
    assert not [series for series in samples() if series.startswith("record")]


def test_a_gateway_without_vehicles_still_has_its_build_info() -> None:
    assert samples() == {f'build_info{{version="{__version__}"}}': "1"}


def test_a_label_with_quotes_backslashes_and_line_ends_is_escaped() -> None:
    text = exposition(Metrics((ROVER._replace(handle='a"b\\c\nd'),)))
    assert 'handle="a\\"b\\\\c\\nd"' in text


def test_large_counters_keep_every_digit() -> None:
    big = LINK._replace(frames=123_456_789_012_345)
    assert "123456789012345" in samples(connections=(big,)).values()


def test_every_family_has_one_header_and_consecutive_lines() -> None:
    ready = ROVER._replace(detail=DETAIL._replace(vehicle=DETAIL.vehicle._replace(can_arm=True)))
    text = exposition(Metrics((ready, UNHEARD, ROBOT), (LINK,), (PublisherMetrics("json", 1, 0, 0),), 0))
    heads = re.findall(r"^# HELP (\S+) .+\n# TYPE \1 (gauge|counter)\n\1[{ ]", text, re.MULTILINE)
    assert [name.removeprefix(PREFIX) for name, _ in heads] == [
        family.name for family in (*GATEWAY, *VEHICLE, *CONNECTION, *PUBLISHER)
    ]
    assert text.count("# TYPE") == len(heads)
    assert text.endswith("\n")
