from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.autopilots import AUTOPILOTS
from mav_robot_status.hardware.mavlink.autopilots.sensor_weights import EXTENDED_BITS, SOFT
from mav_robot_status.hardware.mavlink.faults import causes
from mav_robot_status.hardware.mavlink.faults.causes import CAUSES
from mav_robot_status.hardware.mavlink.faults.latches import NO_LATCHES, announce, clear, lasting
from mav_robot_status.hardware.mavlink.heartbeat.state import HeartbeatHistory, first_heartbeat, next_heartbeat
from mav_robot_status.mavlink.definitions import SENSOR_NAMES, Heartbeat

from ..driver import ACTIVE, CRITICAL

NOW = Instant(1000.0, 1_800_000_000_000_000)

NAMES = {
    1001: "FLIGHT_TERMINATION", 1002: "TERMINATION_ANNOUNCED", 2000: "FAILSAFE", 2001: "RC_LOST", 2002: "GCS_LOST",
    2003: "BATTERY_LOW", 2004: "BATTERY_CRITICAL", 2005: "ESTIMATOR", 2006: "TERRAIN", 2007: "TRAFFIC", 2008: "GPS",
    2009: "GEOFENCE", 2010: "LEAK", 2011: "PRESSURE", 2012: "TEMPERATURE", 2013: "DEPTH_SENSOR",
    2014: "BATTERY_FAULT", 2015: "OFFBOARD_LOST", 2016: "MISSION", 4000: "EMERGENCY", 4001: "CRASH",
    4002: "HARD_LANDING", 4003: "THRUST_LOSS", 4004: "PARACHUTE", 4005: "YAW_IMBALANCE", 4006: "ATTITUDE_FAILURE",
    4007: "ESC_FAILURE", 5001: "INTERNAL_ERROR", 5002: "CONFIGURATION", 5003: "WATCHDOG_RESET",
    5004: "REBOOT_WHILE_ARMED", 6000: "TEXT_EMERGENCY", 6001: "TEXT_ALERT", 6002: "TEXT_CRITICAL", 7000: "EVENT_0",
    7001: "EVENT_1", 7002: "EVENT_2", 9001: "LINK_LOST", 9002: "SYSTEM_ID_CONFLICT",
}  # fmt: skip
ORDER = [
    1001, 1002, 4001, 4006, 4003, 4004, 4002, 4000, 2010, 2004, 2005, 2001, 2002, 2003, 2006, 2007, 2008, 2009, 2011,
    2012, 2013, 4005, 5001, 5002, 5003, 5004, 2000, 4007, 2014, 2015, 2016, 9002, 9001,
]  # fmt: skip


def heartbeats(*beats: tuple[float, bool, int]) -> HeartbeatHistory:
    """The history after these heartbeats: (seconds from NOW, armed, state)."""
    made: HeartbeatHistory | None = None
    for seconds, armed, state in beats:
        beat, at = Heartbeat(0, 2, 3, 0x81 if armed else 1, state, 3), later(NOW, seconds)
        made = first_heartbeat(beat, at) if made is None else next_heartbeat(made, beat, at, True)
    assert made is not None
    return made


FLYING = heartbeats((0, True, ACTIVE))


def announced(code: int, hold: float = 10.0, after: float = 0.0, at: HeartbeatHistory = FLYING) -> bool:
    """Whether a cause announced at NOW lasts `after` seconds."""
    return code in lasting(announce(NO_LATCHES, code, "words", NOW), at, (), NOW.mono + after, hold)


def test_every_code_has_the_name_of_the_specification() -> None:
    assert {code: cause.name for code, cause in CAUSES.items() if not 3000 <= code < 4000} == NAMES
    assert {code: CAUSES[code].name for code in range(3000, 3031)} == {
        3000 + bit: f"SENSOR_{SENSOR_NAMES[bit]}" for bit in range(31)
    }
    assert CAUSES[3100].name == "SENSOR_RECOVERY_SYSTEM"
    assert CAUSES[3105].name == "SENSOR_5"


def test_codes_fit_a_signed_16_bit_word() -> None:
    assert all(0 < code < 1 << 15 for code in CAUSES)


def test_the_causes_have_the_order_of_the_specification() -> None:
    assert [CAUSES[code].priority for code in ORDER] == list(range(1, len(ORDER) + 1))
    for base, numbers, priority in ((3000, range(31), 100), (3100, range(32), 200), (6000, range(3), 400),
                                    (7000, range(3), 500)):  # fmt: skip
        assert [CAUSES[base + n].priority for n in numbers] == [priority + n for n in numbers]


def test_no_two_causes_have_the_same_priority_even_where_a_soft_sensor_comes_later() -> None:
    soft = {bit for profile in AUTOPILOTS for bit, weight in profile.sensors.weights.items() if weight is SOFT}
    priorities = [cause.priority for cause in CAUSES.values()]
    priorities += [CAUSES[3000 + bit].priority + causes.SOFT_AFTER for bit in soft]
    assert len(priorities) == len(set(priorities))


def test_every_sensor_that_can_be_faulty_has_a_code() -> None:
    bits = {3000 + bit for profile in AUTOPILOTS for bit in profile.sensors.weights}
    assert bits | {3100 + bit for bit in EXTENDED_BITS} <= CAUSES.keys()


@pytest.mark.parametrize(
    ("code", "hold"),
    [(2008, 60), (2009, 30), (2010, 45), (2011, 65), (2012, 65), (2013, 30), (4003, 30), (4005, 30), (5002, 15),
     (6000, 10), (6002, 10), (7000, 10), (7002, 10), (9002, 10)],
)  # fmt: skip
def test_a_cause_with_a_hold_time_expires(code: int, hold: float) -> None:
    assert announced(code, after=hold - 0.1)
    assert not announced(code, after=hold)


def test_the_hold_time_of_unclassified_texts_is_an_option() -> None:
    assert announced(6001, hold=60.0, after=59.0)
    assert not announced(6001, hold=0.0)


@pytest.mark.parametrize("code", [1002, 4001, 4002, 4004, 4006, 5001, 5003, 5004])
def test_a_cause_without_a_hold_time_does_not_expire(code: int) -> None:
    assert announced(code, after=10_000)


@pytest.mark.parametrize("code", range(2001, 2008))
def test_a_failsafe_ends_two_seconds_after_critical_and_not_before_five(code: int) -> None:
    assert announced(code, after=4.9)
    assert not announced(code, after=5.0)
    in_failsafe = heartbeats((0, True, ACTIVE), (1, True, CRITICAL))
    assert announced(code, after=1000, at=in_failsafe)
    over = next_heartbeat(in_failsafe, Heartbeat(0, 2, 3, 0x81, ACTIVE, 3), later(NOW, 20), True)
    assert announced(code, after=21.9, at=over)
    assert not announced(code, after=22.0, at=over)


def test_a_failsafe_ends_five_seconds_after_disarming_if_the_state_just_left_critical() -> None:
    down = heartbeats((0, True, CRITICAL), (1, False, CRITICAL), (6, False, ACTIVE))
    assert not announced(2001, after=6.1, at=down)
    assert announced(2001, after=6.1, at=heartbeats((0, True, CRITICAL), (2, False, CRITICAL), (6, False, ACTIVE)))


def test_a_repetition_prolongs_a_cause_and_keeps_its_start_time() -> None:
    again = announce(announce(NO_LATCHES, 2010, "Leak Detected", NOW), 2010, "Leak Detected", later(NOW, 20))
    assert (again[2010].since, again[2010].last) == (NOW, NOW.mono + 20)


def test_a_low_battery_does_not_replace_a_critical_one_but_prolongs_it() -> None:
    worse = announce(NO_LATCHES, 2004, "Battery 1 is critical", NOW)
    after = announce(worse, 2003, "Battery Failsafe", later(NOW, 1))
    assert after.keys() == {2004}
    assert (after[2004].text, after[2004].last) == ("Battery 1 is critical", NOW.mono + 1)


def test_clearing_removes_the_given_codes() -> None:
    both = announce(announce(NO_LATCHES, 2001, "a", NOW), 2002, "b", NOW)
    assert clear(both, (2001, 2009)).keys() == {2002}
