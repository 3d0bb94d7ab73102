from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware import sensors
from mav_robot_status.hardware.identity import Stack
from mav_robot_status.hardware.sensors import Weight
from mav_robot_status.mavlink.definitions import SysStatus

NOW = Instant(1000.0, 1_800_000_000_000_000)
STACKS = list(Stack)


def masks(present: int, enabled: int, health: int, *extended: int) -> SysStatus:
    return SysStatus._make((present, enabled, health, 0, 0, *(extended or (0, 0, 0))))


@pytest.mark.parametrize("stack", STACKS, ids=[stack.name for stack in STACKS])
def test_every_bit_weighs_what_the_specification_says(stack: Stack) -> None:
    hard = {0, 1, 2, 3, 20, 25, 30}
    soft = {4, 5, 6, 7, 8, 16, 17, 18, 19, 21, 22, 24, 26, 27, 29}
    if stack in (Stack.ARDUPILOT, Stack.PX4):
        soft |= {10, 11, 12, 13, 14}
    if stack is Stack.ARDUPILOT:
        soft -= {22}  # the recordings show it unhealthy through every good plane flight
    if stack is Stack.PX4:
        hard, soft = hard | {15}, soft - {16}
    weights = sensors.WEIGHTS[stack]
    assert {bit for bit, weight in weights.items() if weight is Weight.HARD} == hard
    assert {bit for bit, weight in weights.items() if weight is Weight.SOFT} == soft


@pytest.mark.parametrize("stack", STACKS, ids=[stack.name for stack in STACKS])
def test_a_faulty_bit_is_enabled_and_unhealthy_and_present_unless_px4_says_so(stack: Stack) -> None:
    assert sensors.faulty_mask(masks(1, 1, 0), stack) == 1
    assert sensors.faulty_mask(masks(1, 0, 0), stack) == 0
    assert sensors.faulty_mask(masks(1, 1, 1), stack) == 0
    assert sensors.faulty_mask(masks(0, 1, 0), stack) == (1 if stack is Stack.PX4 else 0)


def test_the_extended_word_counts_from_bit_32() -> None:
    assert sensors.faulty_mask(masks(0, 0, 0, 2, 2, 0), Stack.ARDUPILOT) == 1 << 33


def test_a_fault_counts_after_two_messages_or_a_second_and_a_half() -> None:
    once = sensors.heard_faults(sensors.NO_FAULTS, 1, NOW)
    assert sensors.standing(once, Stack.OTHER, False, NOW.mono + 1.4) == []
    assert [bit for bit, *_ in sensors.standing(once, Stack.OTHER, False, NOW.mono + 1.5)] == [0]
    twice = sensors.heard_faults(once, 1, later(NOW, 0.25))
    ((bit, weight, fault),) = sensors.standing(twice, Stack.OTHER, False, NOW.mono + 0.25)
    assert (bit, weight, fault.since) == (0, Weight.HARD, NOW)


def test_a_bit_that_is_healthy_once_begins_anew() -> None:
    faults = sensors.heard_faults(sensors.NO_FAULTS, 0b11, NOW)
    faults = sensors.heard_faults(faults, 0b10, later(NOW, 1))
    faults = sensors.heard_faults(faults, 0b11, later(NOW, 2))
    assert faults[0].messages == 1
    assert faults[1].messages == 3
    assert sensors.heard_faults(faults, 0, NOW) == {}


def test_a_soft_fault_counts_only_while_armed_an_extended_one_always_an_unlisted_one_never() -> None:
    mask = 1 << 5 | 1 << 9 | 1 << 33 | 1 << 50
    faults = sensors.heard_faults(sensors.heard_faults(sensors.NO_FAULTS, mask, NOW), mask, NOW)
    assert [bit for bit, *_ in sensors.standing(faults, Stack.ARDUPILOT, True, NOW.mono)] == [5, 33]
    assert [bit for bit, *_ in sensors.standing(faults, Stack.ARDUPILOT, False, NOW.mono)] == [33]


def test_px4_tells_readiness_in_health_alone() -> None:
    in_health = masks(0xF, 0xF, 0xF | sensors.PREARM_CHECK)
    assert sensors.is_ready(in_health, Stack.PX4)
    assert not sensors.is_ready(in_health, Stack.ARDUPILOT)
    everywhere = masks(*[sensors.PREARM_CHECK] * 3)
    assert sensors.is_ready(everywhere, Stack.ARDUPILOT)
    assert not sensors.tells_readiness(in_health, Stack.ARDUPILOT)
    assert sensors.tells_readiness(masks(0xF, 0xF, 0xF), Stack.PX4)


def test_the_safety_switch_shows_as_outputs_that_are_present_and_not_enabled() -> None:
    outputs = sensors.MOTOR_OUTPUTS
    assert sensors.safety_switch_on(masks(outputs, 0, 0))
    assert not sensors.safety_switch_on(masks(outputs, outputs, 0))
    assert not sensors.safety_switch_on(masks(0, 0, 0))


def test_masks_of_zero_say_nothing() -> None:
    assert sensors.is_empty(masks(0, 0, 0))
    assert not sensors.is_empty(masks(1, 0, 0))
