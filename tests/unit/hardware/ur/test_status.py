"""Every row of the table that turns the values of a UR controller into a status."""

from __future__ import annotations

import math
from itertools import product
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.tcp_arm import Values
from mav_robot_status.hardware.ur.status import MODES, Context, Joints, Sample, sample_of, values_of
from mav_robot_status.interface import Detail, RobotMode, TriState, validate

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
ANY: Final = Context(UNKNOWN, "AUTOMATIC", RobotMode.UNKNOWN, "5.11.1")
RUNNING: Final = Sample(7, 0b11, 0b1, (0.0,) * 6)
POWER_OFF, POWER_ON, IDLE, BACKDRIVE = 3, 4, 5, 6


def of(sample: Sample, context: Context = ANY, before: Detail | None = None, unix_us: int = 5) -> Values:
    return values_of(sample, context, before or Detail(), unix_us, 1.0)


def test_a_running_arm_can_move() -> None:
    status, detail, _ = of(RUNNING)
    assert status[:4] == (RobotMode.AUTO, FALSE, TRUE, TRUE)
    assert (status.in_error, status.error_code, detail.inhibits) == (FALSE, 0, ())
    assert tuple(detail.vehicle)[:6] == ("UNIVERSAL_ROBOTS", "ARM", "AUTOMATIC", None, "RUNNING", "5.11.1")


@pytest.mark.parametrize(
    ("bit", "e_stopped", "code", "name"),
    [
        (2, FALSE, 8001, "PROTECTIVE_STOP"),
        (4, FALSE, 0, "SAFEGUARD_STOP"),
        (5, TRUE, 0, "E_STOPPED"),
        (6, TRUE, 0, "E_STOPPED"),
        (7, TRUE, 0, "E_STOPPED"),
        (8, FALSE, 8002, "SAFETY_VIOLATION"),
        (9, FALSE, 8003, "SAFETY_FAULT"),
        (10, FALSE, 8004, "SAFETY_STOP"),
    ],
)
def test_each_stop_of_the_safety_bits_stops_the_arm(bit: int, e_stopped: TriState, code: int, name: str) -> None:
    status, detail, _ = of(RUNNING._replace(safety_bits=1 << bit))
    assert (status.e_stopped, status.motion_possible) == (e_stopped, FALSE)
    assert (status.in_error, status.error_code) == (TriState.of(code != 0), code)
    assert [inhibit.name for inhibit in detail.inhibits] == [name]


@pytest.mark.parametrize(
    ("safety", "expected"),
    [(0, UNKNOWN), (0b1, TRUE), (0b10, TRUE), (0b1001, TRUE), (0x8, UNKNOWN), (0x800, UNKNOWN), (0x1000, UNKNOWN)],
)
def test_it_can_move_only_if_the_safety_system_says_normal_or_reduced(safety: int, expected: TriState) -> None:
    status, detail, _ = of(RUNNING._replace(safety_bits=safety))
    assert (status.motion_possible, detail.inhibits) == (expected, ())


@pytest.mark.parametrize("safety", [0, 0x1000])
def test_safety_bits_that_say_nothing_rule_out_no_stop_and_no_error(safety: int) -> None:
    status = of(RUNNING._replace(safety_bits=safety)).status
    assert (status.e_stopped, status.in_error) == (UNKNOWN, UNKNOWN)


@pytest.mark.parametrize("safety_status", [None, *range(1, 14)])
def test_a_safety_status_that_contradicts_the_bits_makes_them_doubtful(safety_status: int | None) -> None:
    status = of(RUNNING._replace(safety_status=safety_status)).status
    assert status.motion_possible is (TRUE if safety_status in (None, 1, 2) else UNKNOWN)
    assert status.e_stopped is (UNKNOWN if safety_status in (6, 7) else FALSE)
    assert of(RUNNING._replace(safety_status=safety_status, safety_bits=1 << 7)).status.e_stopped is TRUE


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_a_power_bit_that_contradicts_the_robot_mode_makes_the_power_unknown(mode: int) -> None:
    on, off, untold = (of(RUNNING._replace(robot_mode=mode, robot_bits=bits)).status for bits in (0b1, 0b10, None))
    assert (on.drives_powered, off.drives_powered, untold.drives_powered) == (UNKNOWN, FALSE, FALSE)
    assert {on.motion_possible, off.motion_possible, untold.motion_possible} == {FALSE}


@pytest.mark.parametrize("bit", [2, 4, 5, 6, 7, 8, 9])
def test_a_stop_due_to_safety_is_not_an_error_beside_the_stop_that_explains_it(bit: int) -> None:
    alone, both = (of(RUNNING._replace(safety_bits=bits)).status for bits in (1 << bit, 1 << bit | 1 << 10))
    assert both == alone


@pytest.mark.parametrize("mode", MODES)
def test_each_robot_mode_but_running_is_an_inhibit(mode: int) -> None:
    status, detail, _ = of(RUNNING._replace(robot_mode=mode))
    assert detail.vehicle.state == MODES[mode]
    assert status.motion_possible is TriState.of(mode == 7)
    assert bool(detail.inhibits) is (mode != 7)
    assert status.drives_powered is (UNKNOWN if mode in (0, 1, 2, 3) else TRUE)


@pytest.mark.parametrize("mode", [POWER_ON, IDLE])
def test_an_arm_with_engaged_brakes_is_powered(mode: int) -> None:
    status, detail, _ = of(RUNNING._replace(robot_mode=mode))
    assert status.drives_powered is TRUE
    assert [inhibit.name for inhibit in detail.inhibits] == ["BRAKES_ENGAGED"]


def test_a_mode_of_a_later_version_is_its_number() -> None:
    _, detail, _ = of(RUNNING._replace(robot_mode=9))
    assert detail.vehicle.state == "9"
    assert [(inhibit.name, inhibit.text) for inhibit in detail.inhibits] == [("NOT_RUNNING", "robot_mode 9")]


def test_without_power_it_cannot_move() -> None:
    status, detail, _ = of(RUNNING._replace(robot_bits=0b10))
    assert (status.drives_powered, status.motion_possible) == (FALSE, FALSE)
    assert [inhibit.name for inhibit in detail.inhibits] == ["POWER_OFF"]


@pytest.mark.parametrize(
    ("sample", "operational", "assumed", "expected"),
    [
        (RUNNING, "AUTOMATIC", "UNKNOWN", "AUTO"),
        (RUNNING, "MANUAL", "UNKNOWN", "MANUAL"),
        (RUNNING, None, "UNKNOWN", "UNKNOWN"),
        (RUNNING, None, "AUTO", "AUTO"),
        (RUNNING, None, "MANUAL", "MANUAL"),
        (RUNNING, "MANUAL", "AUTO", "MANUAL"),
        (RUNNING._replace(robot_bits=0b101), "AUTOMATIC", "UNKNOWN", "MANUAL"),
        (RUNNING._replace(robot_mode=BACKDRIVE), "AUTOMATIC", "UNKNOWN", "MANUAL"),
        (Sample(), "AUTOMATIC", "UNKNOWN", "AUTO"),
    ],
)
def test_a_person_with_the_arm_in_hand_beats_the_operational_mode(
    sample: Sample, operational: str | None, assumed: str, expected: str
) -> None:
    context = ANY._replace(operational=operational, assumed=RobotMode[assumed])
    assert of(sample, context).status.mode.name == expected


def test_values_that_the_controller_does_not_know_are_unknown() -> None:
    status, detail, _ = of(Sample())
    assert status[1:] == (UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, 0)
    assert detail.inhibits == ()
    assert of(RUNNING._replace(safety_bits=None)).status.motion_possible is UNKNOWN
    assert of(RUNNING._replace(robot_mode=None)).status.motion_possible is UNKNOWN
    assert of(RUNNING._replace(robot_bits=None)).status.motion_possible is UNKNOWN
    assert of(Sample(safety_bits=1 << 7)).status.motion_possible is FALSE
    assert sample_of({"robot_mode": 7, "safety_status_bits": 1}) == Sample(7, None, 1, None)


def test_a_stop_keeps_the_time_of_its_beginning() -> None:
    stopped = RUNNING._replace(safety_bits=1 << 2)
    first = of(stopped, unix_us=5).detail
    again = of(stopped, before=first, unix_us=9).detail
    assert (again.errors[0].since_us, again.inhibits[0].since_us) == (5, 5)


def motion(*samples: tuple[float, float]) -> TriState:
    """The motion after (time, joint speed) samples."""
    joints = Joints()
    for at, speed in samples:
        joints.heard((0.0, speed, 0.0), at)
    return joints.value


def test_joints_move_after_a_tenth_of_a_second_and_rest_after_half_a_second() -> None:
    assert motion((0, 0.011)) is UNKNOWN
    assert motion((0, 0.011), (0.1, -0.011)) is TRUE
    assert motion((0, 0.0), (0.4, 0.0)) is UNKNOWN
    assert motion((0, 0.0), (0.5, 0.0049)) is FALSE
    assert motion((0, 0.02), (0.1, 0.02), (0.2, 0.007), (9, 0.007)) is TRUE
    assert motion((0, 0.0), (0.5, 0.0), (0.6, 0.007), (9, 0.007)) is FALSE
    assert motion((0, 0.02), (0.1, 0.02), (0.2, 0.0), (0.6, 0.0)) is TRUE
    assert motion((0, 0.02), (0.05, 0.0), (0.1, 0.02)) is UNKNOWN


@pytest.mark.parametrize("speeds", [None, (0.0, math.nan), (math.inf,)])
def test_joint_speeds_that_are_not_numbers_end_what_was_known(speeds: tuple[float, ...] | None) -> None:
    joints = Joints()
    joints.heard((0.5,), 0)
    assert joints.heard((0.5,), 1) is TRUE
    assert joints.heard(speeds, 2) is UNKNOWN
    assert joints.heard((0.5,), 3) is UNKNOWN


optional_bits = st.none() | st.integers(0, 0x1FFF)


@given(
    st.none() | st.integers(-2, 9),
    optional_bits,
    optional_bits,
    st.none() | st.integers(0, 14),
    st.sampled_from(TriState),
)
def test_every_status_of_an_arm_is_valid(
    mode: int | None, bits: int | None, safety: int | None, safety_status: int | None, moving: TriState
) -> None:
    status, detail, evidence = of(Sample(mode, bits, safety, None, safety_status), ANY._replace(moving=moving))
    assert validate(status, detail, stops_cut_power=False) is None
    if status.motion_possible is FALSE:
        assert detail.inhibits
    assert all(one.rule for one in evidence.values())


def test_no_combination_of_stops_lets_the_arm_move() -> None:
    for one, other in product(range(12), repeat=2):
        safety = 1 << one | 1 << other
        stops = {one, other} & {2, 4, 5, 6, 7, 8, 9, 10}
        expected = FALSE if stops else TRUE if {one, other} & {0, 1} else UNKNOWN
        assert of(RUNNING._replace(safety_bits=safety)).status.motion_possible is expected
