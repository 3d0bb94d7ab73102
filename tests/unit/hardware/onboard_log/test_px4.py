"""The meaning of PX4's topics, one story each."""

from __future__ import annotations

from typing import Any

from mav_robot_status.interface import RobotMode, TriState
from tests.onboard_logs import ulog

from .logs import at

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN


def log(*records: tuple[Any, ...], nav_state: int = 4, failsafe: bool = False, until: float = 12.0) -> bytes:
    """A log with a status every half second."""
    status = [
        (1 + n / 2, "vehicle_status", nav_state, 2, 1, 1, failsafe, True, 0, 4) for n in range(int((until - 1) * 2))
    ]
    return ulog(*sorted([*status, *records], key=lambda one: float(one[0])), start=1)


def armed(at_: float, value: bool, *, kill: bool = False, termination: bool = False) -> tuple[Any, ...]:
    return at_, "actuator_armed", value, False, kill, termination


def test_armed_by_whom() -> None:
    data = log(
        armed(2, False), (4, "vehicle_command", 400, 255, True), armed(4, True),
        (4, "L", "[commander] Armed by external command"), armed(8, False), (8.1, "L", "Disarmed by landing"),
    )  # fmt: skip
    off, on, landed = at(data, 3, 5, 9)
    assert (off.status.drives_powered, on.status.drives_powered, landed.status.drives_powered) == (FALSE, TRUE, FALSE)
    assert on.why["armed"] == "armed by ground station 255 [message “Armed by external command”]"
    assert landed.why["armed"] == "disarmed by landing [message “Disarmed by landing”]"
    assert (off.detail.vehicle.type, off.detail.vehicle.firmware, off.detail.vehicle.can_arm) == (
        "QUADROTOR", "1.15.0", True,
    )  # fmt: skip


def test_without_a_text_the_status_says_why() -> None:
    (said,) = at(log(armed(2, True), armed(4, False)), 5)
    assert said.why["armed"] == "disarmed by an external command [vehicle_status.latest_disarming_reason 4]"


def test_the_kill_switch_is_a_stop_and_a_termination() -> None:
    data = log(armed(2, True), armed(4, True, kill=True), armed(8, False))
    before, killed, released = at(data, 3, 5, 9)
    assert (before.status.e_stopped, killed.status.e_stopped, released.status.e_stopped) == (FALSE, TRUE, FALSE)
    assert (killed.status.drives_powered, killed.status.error_code) == (FALSE, 1001)
    assert killed.why["e_stopped"] == "emergency stop by the kill switch [actuator_armed.kill]"
    assert released.status.in_error is FALSE


def test_a_termination_is_named() -> None:
    (said,) = at(log(armed(2, True, termination=True)), 3)
    assert said.inhibits == {"E_STOPPED", "TERMINATION"}


def test_an_actuator_test_drives_a_motor_and_a_kill_ends_it() -> None:
    data = log(armed(1, False), (3, "actuator_test", 0.5, 5000, 101, 1), armed(6, False, kill=True))
    assert [said.status.drives_powered for said in at(data, 2, 4, 7)] == [FALSE, TRUE, FALSE]
    data = log(armed(1, False), (3, "actuator_test", 0.5, 2000, 101, 1))
    assert at(data, 9)[0].status.drives_powered is FALSE


def test_modes() -> None:
    found = {n: at(log(nav_state=n), 3)[0] for n in (0, 3, 14, 23, 99)}
    assert [said.detail.vehicle.flight_mode for said in found.values()] == [
        "MANUAL", "AUTO.MISSION", "OFFBOARD", "AUTO.EXTERNAL1", "NAV(99)",
    ]  # fmt: skip
    assert found[0].status.mode is RobotMode.MANUAL
    assert found[99].status.mode is RobotMode.UNKNOWN


def test_a_failsafe_is_named_by_the_flag_that_was_raised_last() -> None:
    flags = [(1.2, "failsafe_flags", False, True), (4, "failsafe_flags", True, True)]
    (said,) = at(log(armed(1.1, True), *flags, failsafe=True), 6)
    assert said.errors[0] in (2000, 2001)
    data = ulog(
        armed(1, True), (1, "failsafe_flags", False, False), (3, "failsafe_flags", True, False),
        (3.2, "L", "[failsafe] Failsafe activated"), (3.3, "vehicle_status", 5, 2, 1, 1, False, True, 0, 0),
        (3.9, "vehicle_status", 5, 2, 1, 1, False, True, 0, 0), start=1,
    )  # fmt: skip
    (said,) = at(data, 4)
    assert said.detail.errors[0].code == 2001
    assert said.detail.errors[0].text == "Failsafe activated"


def test_airborne_landed_and_drifting() -> None:
    fast = [(1 + n / 4, "vehicle_local_position", 1.0, 0.0, 0.0, True, True) for n in range(40)]
    data = log(
        armed(1, True), (1, "vehicle_land_detected", True, False), (4, "vehicle_land_detected", False, False), *fast
    )
    on_ground, flying = at(data, 3.5, 5)
    assert (on_ground.status.in_motion, flying.status.in_motion) == (UNKNOWN, TRUE)
    still = [(1 + n / 4, "vehicle_local_position", 0.0, 0.0, 0.0, True, True) for n in range(40)]
    data = log(armed(1, False), (1, "vehicle_land_detected", True, False), *still)
    assert at(data, 5)[0].status.in_motion is FALSE


def test_a_log_without_the_topics_says_nothing() -> None:
    (said,) = at(ulog((1, "sensor_gps", 0), (1.5, "sensor_gps", 0), names=["sensor_gps"], start=1), 1.6)
    assert all(getattr(said.status, name) is UNKNOWN for name in ("e_stopped", "drives_powered", "in_error"))
