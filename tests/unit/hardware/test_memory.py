from __future__ import annotations

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.identity import Family, Stack
from mav_robot_status.hardware.memory import begin
from mav_robot_status.mavlink.definitions import Heartbeat

NOW = Instant(1000.0, 1_800_000_000_000_000)


def test_a_memory_begins_with_a_heartbeat_and_knows_what_kind_of_vehicle_it_is() -> None:
    memory = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW)
    assert (memory.stack, memory.family) == (Stack.ARDUPILOT, Family.ROVER)
    assert memory.pulse.armed
    assert memory.boot.at == NOW.mono
    memory.unmask()
    assert (memory.stack, memory.impostor) == (Stack.INAV, True)


def test_a_memory_that_becomes_another_keeps_nothing() -> None:
    memory, other = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW), begin(Heartbeat(0, 2, 12, 1, 3, 3), NOW)
    memory.become(other)
    assert memory == other
    assert (memory.stack, memory.family) == (Stack.PX4, Family.COPTER)
