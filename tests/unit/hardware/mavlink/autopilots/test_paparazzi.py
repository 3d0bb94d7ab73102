"""Paparazzi: the messages of its firmware and the status that follows from them."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.autopilots import announced_as
from mav_robot_status.hardware.mavlink.autopilots.paparazzi import PAPARAZZI
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.requests.message_intervals import wanted_of
from mav_robot_status.interface import RobotMode, TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import PLANE, QUAD, Flight

PPZ = 9
FOUR_SENSORS = 0xF
MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN


def paparazzi(vehicle_type: int = QUAD) -> Flight:
    return Flight(PPZ, vehicle_type).set(present=FOUR_SENSORS, enabled=FOUR_SENSORS, health=FOUR_SENSORS)


def test_it_is_recognised_by_its_number() -> None:
    assert announced_as(PPZ) is PAPARAZZI


@pytest.mark.parametrize(
    ("vehicle_type", "base_mode", "custom_mode", "expected"),
    [
        (PLANE, 0x41, 0, (MANUAL, "MANUAL")),
        (PLANE, 0x51, 0, (MANUAL, "AUTO1")),
        (PLANE, 0x05, 0, (AUTO, "AUTO2")),
        (PLANE, 0x0D, 0, (AUTO, "HOME")),
        (PLANE, 0x01, 0, (UNKNOWN, "CMODE(0)")),
        (QUAD, 0x41, 0, (MANUAL, "RATE")),
        (QUAD, 0x51, 0, (MANUAL, "ATTITUDE")),
        (QUAD, 0x05, 0, (AUTO, "HOME")),
        (QUAD, 0x05, 15, (AUTO, "NAV")),
        (QUAD, 0x08, 15, (AUTO, "GUIDED")),
        (QUAD, 0x01, 0, (UNKNOWN, "CMODE(0)")),
    ],
)
def test_the_base_mode_flags_give_the_mode(
    vehicle_type: int, base_mode: int, custom_mode: int, expected: tuple[RobotMode, str]
) -> None:
    flight = paparazzi(vehicle_type).hb(flags=base_mode, mode=custom_mode, armed=True, state=4)
    assert (flight.status.mode, flight.detail.vehicle.flight_mode) == expected


def test_a_constant_sys_status_is_not_evidence_of_no_error() -> None:
    flight = paparazzi()
    flight.wait(15)
    assert flight.status.in_error is TriState.UNKNOWN
    assert "SYS_STATUS_MISSING" not in flight.inhibits
    assert flight.hb(armed=True, state=4).status.e_stopped is TriState.UNKNOWN


def test_without_a_valid_attitude_nobody_knows_whether_the_throttle_is_live() -> None:
    flight = paparazzi(PLANE).hb(armed=True, state=4)
    flight.wait(2)
    flight.hb(armed=False, state=2).wait(3)
    assert (flight.status.drives_powered, flight.status.motion_possible) == (TriState.UNKNOWN, TriState.UNKNOWN)
    assert "DISARMED" not in flight.inhibits
    flight.hb(armed=False, state=3).wait(3)
    assert (flight.status.drives_powered, flight.status.motion_possible) == (TriState.FALSE, TriState.FALSE)
    assert "DISARMED" in flight.inhibits


def test_a_speed_of_zero_is_not_evidence_of_standstill() -> None:
    flight = paparazzi().hb(armed=True, state=4)
    flight.stream("local", lambda: mav.LocalPositionNed(flight.boot_ms, 0.0, 0.0, 0.0), hz=4)
    flight.wait(5)
    found = [flight.status.in_motion]
    flight.stop("local").stream("local", lambda: mav.LocalPositionNed(flight.boot_ms, 2.0, 0.0, 0.0), hz=4)
    flight.wait(2)
    found.append(flight.status.in_motion)
    assert found == [TriState.UNKNOWN, TriState.TRUE]


def test_no_messages_are_requested() -> None:
    assert all(wanted_of(PAPARAZZI, family, True) == () for family in Family)
