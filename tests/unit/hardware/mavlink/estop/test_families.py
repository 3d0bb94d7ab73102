"""A stop counts only if the vehicle obeys it. In a recording ArduSub accepts an e-stop and keeps driving."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.estop import outputs
from mav_robot_status.hardware.mavlink.estop.messages import overheard
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import VehicleState, begin
from mav_robot_status.hardware.mavlink.subjects import HANDLERS
from mav_robot_status.interface import Detail, TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import derived

OPTIONS = HardwareOptions()
START = Instant(100.0, 1_800_000_000_000_000)
STOPPED_BY_SWITCH = mav.Statustext(6, b"RC7: MotorEStop HIGH", 0, 0)
STOP = mav.CommandLong(31.0, 2.0, 0, 0, 0, 0, 0, 218, 1, 1, 0)
ACCEPTED = mav.CommandAck(218, 0, 0, 0, 255, 190)
SUB, QUADROTOR, GROUND_ROVER, FIXED_WING, BLIMP = 12, 2, 10, 1, 7


def hear(state: VehicleState, message: Any, now: Instant) -> None:
    HANDLERS[type(message)](state, message, now, OPTIONS)


def armed(vehicle_type: int) -> VehicleState:
    return begin(mav.Heartbeat(0, vehicle_type, 3, 209, 4, 3), START)


def after(state: VehicleState, message: Any, seconds: float = 0.0) -> VehicleState:
    hear(state, message, later(START, seconds))
    return state


def after_the_command(state: VehicleState) -> VehicleState:
    overheard(state, STOP, (255, 190), START)
    return after(state, ACCEPTED)


def e_stopped(state: VehicleState) -> TriState:
    return derived(state, Detail(), later(START, 1.0), OPTIONS).status.e_stopped


@pytest.mark.parametrize("vehicle_type", [QUADROTOR, GROUND_ROVER, FIXED_WING])
def test_an_effective_stop_counts(vehicle_type: int) -> None:
    assert e_stopped(after(armed(vehicle_type), STOPPED_BY_SWITCH)) is TriState.TRUE
    assert e_stopped(after_the_command(armed(vehicle_type))) is TriState.TRUE


@pytest.mark.parametrize("vehicle_type", [SUB, BLIMP])
def test_a_vehicle_that_does_not_stop_is_not_reported_stopped(vehicle_type: int) -> None:
    assert e_stopped(after(armed(vehicle_type), STOPPED_BY_SWITCH)) is TriState.UNKNOWN
    assert e_stopped(after_the_command(armed(vehicle_type))) is TriState.UNKNOWN


def telemetry(rpm: int) -> mav.EscTelemetry1To4:
    return mav.EscTelemetry1To4(bytes(8), bytes(8), bytes(8), rpm.to_bytes(2, "little") * 4, bytes(8), bytes(4))


def test_a_motor_at_rest_is_not_evidence_of_a_stop() -> None:
    turning = after(armed(QUADROTOR), telemetry(4000))
    assert e_stopped(turning) is TriState.FALSE
    assert e_stopped(after(turning, telemetry(0), 0.5)) is TriState.UNKNOWN


def test_a_propeller_that_may_windmill_is_not_evidence() -> None:
    assert e_stopped(after(armed(FIXED_WING), telemetry(4000))) is TriState.UNKNOWN


@pytest.mark.parametrize(("throttle_us", "expected"), [(1500, TriState.UNKNOWN), (1650, TriState.FALSE)])
def test_motors_that_turn_while_their_outputs_are_at_stop_may_only_coast(throttle_us: int, expected: TriState) -> None:
    rover = after(armed(GROUND_ROVER), telemetry(900))
    values = (0,) * 2 + (throttle_us,) + (0,) * 13
    rover.watch = outputs.Watch(stop={3: 1500}, driven=throttle_us != 1500, at=START.mono, values=values)
    assert e_stopped(rover) is expected
