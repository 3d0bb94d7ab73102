from __future__ import annotations

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, INAV, PX4
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.state.vehicle_state import begin
from mav_robot_status.mavlink.definitions import Heartbeat

NOW = Instant(1000.0, 1_800_000_000_000_000)


def test_a_state_starts_with_a_heartbeat_and_has_the_type_of_the_vehicle() -> None:
    state = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW)
    assert (state.profile, state.family) == (ARDUPILOT, Family.ROVER)
    assert state.heartbeats.armed
    assert (state.booted, state.has_clock) == (NOW.mono, False)
    state.show(INAV)
    assert (state.profile, state.shown) == (INAV, INAV)


def test_a_state_that_becomes_another_keeps_nothing() -> None:
    state, other = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW), begin(Heartbeat(0, 2, 12, 1, 3, 3), NOW)
    state.become(other)
    assert state == other
    assert (state.profile, state.family) == (PX4, Family.COPTER)
