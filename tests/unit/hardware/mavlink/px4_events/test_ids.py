"""The events that are known without a table."""

from __future__ import annotations

from struct import pack

import pytest

from mav_robot_status.hardware.mavlink.faults import causes
from mav_robot_status.hardware.mavlink.px4_events.ids import (
    ARMING_SUMMARY,
    HEALTH_COMPONENTS,
    HEALTH_SUMMARY,
    component_name,
    event_id,
    failsafe_cause,
)

from ..px4_reports import event


def test_an_id_is_the_component_above_the_hash_of_the_name() -> None:
    assert ARMING_SUMMARY == 0x1A893E0
    assert HEALTH_SUMMARY == 0x11D3727
    assert event_id("commander_failsafe_enter") == 0x194CA8A
    assert event_id("commander_failsafe_enter_hold") == 0x1D11DF6


@pytest.mark.parametrize(
    ("cause", "code"),
    [
        (1, causes.RC_LOST),
        (2, causes.GCS_LOST),
        (3, causes.BATTERY_LOW),
        (4, causes.BATTERY_CRITICAL),
        (5, causes.BATTERY_CRITICAL),
        (6, causes.BATTERY_LOW),
        (0, None),
        (7, None),
        (255, None),
    ],
)
def test_a_failsafe_names_its_cause(cause: int, code: int | None) -> None:
    enter, hold = event_id("commander_failsafe_enter"), event_id("commander_failsafe_enter_hold")
    assert failsafe_cause(event(enter, 1, 1, pack("<IBB", 0, 6, cause))) == code
    assert failsafe_cause(event(hold, 1, 1, pack("<IBHB", 0, 6, 5, cause))) == code


def test_other_events_and_events_cut_short_name_no_cause() -> None:
    assert failsafe_cause(event(ARMING_SUMMARY, 1, 1, bytes([1] * 40))) is None
    assert failsafe_cause(event(event_id("commander_failsafe_enter"), 1, 1)._replace(arguments=b"\1\1")) is None


def test_a_warning_of_the_battery_names_its_cause_by_its_id() -> None:
    assert failsafe_cause(event(event_id("commander_failsafe_enter_crit_bat_warn"), 1, 1)) == causes.BATTERY_CRITICAL


def test_health_components_have_names_by_index() -> None:
    assert HEALTH_COMPONENTS.index("remote_control") == 7
    assert HEALTH_COMPONENTS.index("open_drone_id") == 30
    assert component_name(40) == "component 40"
