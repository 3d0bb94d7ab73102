from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, GENERIC, INAV, PX4, Autopilot
from mav_robot_status.hardware.mavlink.autopilots.sensor_weights import Weight
from mav_robot_status.hardware.mavlink.facts import Deadline
from mav_robot_status.hardware.mavlink.faults import rule, sensors
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import begin
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink.definitions import Heartbeat, SysStatus

SPECIFIED = (ARDUPILOT, PX4, INAV, GENERIC)
NOW = Instant(1000.0, 1_800_000_000_000_000)


def masks(present: int, enabled: int, health: int, *extended: int) -> SysStatus:
    return SysStatus._make((present, enabled, health, 0, 0, *(extended or (0, 0, 0))))


@pytest.mark.parametrize("profile", SPECIFIED, ids=[profile.name for profile in SPECIFIED])
def test_every_bit_has_the_specified_weight(profile: Autopilot) -> None:
    hard = {0, 1, 2, 3, 20, 25, 30}
    soft = {4, 5, 6, 7, 8, 16, 17, 18, 19, 21, 22, 24, 26, 27, 29}
    if profile in (ARDUPILOT, PX4):
        soft |= {10, 11, 12, 13, 14}
    if profile is ARDUPILOT:
        soft -= {22}  # unhealthy during every normal plane flight of the recordings
    if profile is PX4:
        hard, soft = hard | {15}, soft - {16}
    weights = profile.sensors.weights
    assert {bit for bit, weight in weights.items() if weight is Weight.HARD} == hard
    assert {bit for bit, weight in weights.items() if weight is Weight.SOFT} == soft


@pytest.mark.parametrize("profile", SPECIFIED, ids=[profile.name for profile in SPECIFIED])
def test_a_faulty_bit_is_enabled_and_unhealthy_and_present_unless_px4_says_so(profile: Autopilot) -> None:
    assert sensors.faulty_mask(masks(1, 1, 0), profile) == 1
    assert sensors.faulty_mask(masks(1, 0, 0), profile) == 0
    assert sensors.faulty_mask(masks(1, 1, 1), profile) == 0
    assert sensors.faulty_mask(masks(0, 1, 0), profile) == (1 if profile is PX4 else 0)


def test_the_extended_word_counts_from_bit_32() -> None:
    assert sensors.faulty_mask(masks(0, 0, 0, 2, 2, 0), ARDUPILOT) == 1 << 33


def test_a_fault_counts_after_two_messages_or_a_second_and_a_half() -> None:
    state = begin(Heartbeat(0, 2, 0, 1, 3, 3), NOW)
    state.booted = NOW.mono - 60

    def counted(seconds: float) -> list[int]:
        return [fault.bit for fault in rule.faults(state, Deadline(NOW.mono + seconds), HardwareOptions())]

    state.faults = sensors.heard_faults(sensors.NO_FAULTS, 1, NOW)
    assert counted(1.4) == []
    assert counted(1.5) == [0]
    state.faults = sensors.heard_faults(state.faults, 1, later(NOW, 0.25))
    assert counted(0.25) == [0]
    assert state.faults[0].since == NOW


def test_one_healthy_message_restarts_the_fault_count() -> None:
    faults = sensors.heard_faults(sensors.NO_FAULTS, 0b11, NOW)
    faults = sensors.heard_faults(faults, 0b10, later(NOW, 1))
    faults = sensors.heard_faults(faults, 0b11, later(NOW, 2))
    assert faults[0].messages == 1
    assert faults[1].messages == 3
    assert sensors.heard_faults(faults, 0, NOW) == {}


def test_a_soft_fault_counts_only_while_armed_an_extended_one_always_an_unlisted_one_never() -> None:
    mask = 1 << 5 | 1 << 9 | 1 << 33 | 1 << 50
    faults = sensors.heard_faults(sensors.heard_faults(sensors.NO_FAULTS, mask, NOW), mask, NOW)
    assert [bit for bit, *_ in sensors.counting(faults, ARDUPILOT, None, True)] == [5, 33]
    assert [bit for bit, *_ in sensors.counting(faults, ARDUPILOT, None, False)] == [33]


def test_px4_shows_readiness_in_the_health_mask_only() -> None:
    in_health = masks(0xF, 0xF, 0xF | sensors.PREARM_CHECK)
    everywhere = masks(*[sensors.PREARM_CHECK] * 3)
    assert sensors.readiness(in_health, PX4) is TriState.TRUE
    assert sensors.readiness(in_health, ARDUPILOT) is TriState.UNKNOWN
    assert sensors.readiness(everywhere, ARDUPILOT) is TriState.TRUE
    unhealthy = everywhere._replace(onboard_control_sensors_health=0)
    assert [sensors.readiness(unhealthy, profile) for profile in (ARDUPILOT, PX4)] == [TriState.FALSE] * 2


def test_the_safety_switch_shows_as_outputs_that_are_present_and_not_enabled() -> None:
    outputs = sensors.MOTOR_OUTPUTS
    assert sensors.safety_switch_on(masks(outputs, 0, 0))
    assert not sensors.safety_switch_on(masks(outputs, outputs, 0))
    assert not sensors.safety_switch_on(masks(0, 0, 0))


def test_zero_masks_are_ignored() -> None:
    assert sensors.is_empty(masks(0, 0, 0))
    assert not sensors.is_empty(masks(1, 0, 0))
