"""An e-stop that a vehicle does not honour is none: ArduSub was recorded accepting one and driving on."""

from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware import outputs
from mav_robot_status.hardware.derive import derive
from mav_robot_status.hardware.hearing import hear, overheard
from mav_robot_status.hardware.memory import Memory, begin
from mav_robot_status.hardware.options import HardwareOptions
from mav_robot_status.interface import Detail, TriState
from mav_robot_status.mavlink import definitions as mav

OPTIONS = HardwareOptions()
START = Instant(100.0, 1_800_000_000_000_000)
STOPPED_BY_SWITCH = mav.Statustext(6, b"RC7: MotorEStop HIGH", 0, 0)
STOP = mav.CommandLong(31.0, 2.0, 0, 0, 0, 0, 0, 218, 1, 1, 0)
ACCEPTED = mav.CommandAck(218, 0, 0, 0, 255, 190)
SUB, QUADROTOR, GROUND_ROVER, FIXED_WING, BLIMP = 12, 2, 10, 1, 7


def armed(vehicle_type: int) -> Memory:
    return begin(mav.Heartbeat(0, vehicle_type, 3, 209, 4, 3), START)


def e_stopped(memory: Memory) -> TriState:
    return derive(memory, (1, 1), Detail(), later(START, 1.0), OPTIONS).status.e_stopped


@pytest.mark.parametrize("vehicle_type", [QUADROTOR, GROUND_ROVER, FIXED_WING])
def test_a_stop_that_is_honoured_counts(vehicle_type: int) -> None:
    assert e_stopped(hear(armed(vehicle_type), STOPPED_BY_SWITCH, START, OPTIONS)) is TriState.TRUE
    asked = overheard(armed(vehicle_type), STOP, (255, 190), START)
    assert e_stopped(hear(asked, ACCEPTED, START, OPTIONS)) is TriState.TRUE


@pytest.mark.parametrize("vehicle_type", [SUB, BLIMP])
def test_a_live_vehicle_that_does_not_stop_is_not_called_stopped(vehicle_type: int) -> None:
    assert e_stopped(hear(armed(vehicle_type), STOPPED_BY_SWITCH, START, OPTIONS)) is TriState.UNKNOWN
    asked = overheard(armed(vehicle_type), STOP, (255, 190), START)
    assert e_stopped(hear(asked, ACCEPTED, START, OPTIONS)) is TriState.UNKNOWN


def telemetry(rpm: int) -> mav.EscTelemetry1To4:
    return mav.EscTelemetry1To4(bytes(8), bytes(8), bytes(8), rpm.to_bytes(2, "little") * 4, bytes(8), bytes(4))


def test_a_motor_that_no_longer_turns_is_no_evidence() -> None:
    turning = hear(armed(QUADROTOR), telemetry(4000), START, OPTIONS)
    assert e_stopped(turning) is TriState.FALSE
    assert e_stopped(hear(turning, telemetry(0), later(START, 0.5), OPTIONS)) is TriState.UNKNOWN


def test_a_propeller_that_the_wind_may_turn_is_no_evidence() -> None:
    assert e_stopped(hear(armed(FIXED_WING), telemetry(4000), START, OPTIONS)) is TriState.UNKNOWN


@pytest.mark.parametrize(("throttle_us", "expected"), [(1500, TriState.UNKNOWN), (1650, TriState.FALSE)])
def test_motors_that_turn_while_their_outputs_are_at_stop_may_only_coast(throttle_us: int, expected: TriState) -> None:
    rover = hear(armed(GROUND_ROVER), telemetry(900), START, OPTIONS)
    values = (0,) * 2 + (throttle_us,) + (0,) * 13
    watch = outputs.Watch(stop={3: 1500}, driven=throttle_us != 1500, at=START.mono, values=values)
    assert e_stopped(rover._replace(watch=watch)) is expected
