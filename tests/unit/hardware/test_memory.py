from __future__ import annotations

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.identity import Family, Stack
from mav_robot_status.hardware.memory import begin, observed
from mav_robot_status.hardware.observation import heard
from mav_robot_status.mavlink.definitions import ExtendedSysState, Heartbeat

NOW = Instant(1000.0, 1_800_000_000_000_000)


def test_a_memory_begins_with_a_heartbeat_and_knows_what_kind_of_vehicle_it_is() -> None:
    memory = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW)
    assert (memory.stack, memory.family) == (Stack.ARDUPILOT, Family.ROVER)
    assert memory._replace(impostor=True).stack is Stack.INAV
    assert memory.pulse.armed
    assert memory.boot.at == NOW.mono


def test_what_is_observed_replaces_only_its_own_kind() -> None:
    before = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW)
    landed = heard(ExtendedSysState(0, 1), NOW.mono, None)
    after = observed(before, extended_sys_state=landed)
    assert after.observation == before.observation._replace(extended_sys_state=landed)
    assert before.observation.extended_sys_state is None
