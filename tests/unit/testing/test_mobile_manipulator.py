from __future__ import annotations

from itertools import pairwise

from mav_robot_status.testing import FakeAutopilot, ManualClock, step
from mav_robot_status.testing.fake_arm import FakeArm
from mav_robot_status.testing.mobile_manipulator import ACTS, BASE, follow
from mav_robot_status.testing.scenario import Step

STOP = next(act.step for act in ACTS if act.arm is FakeArm.press_emergency_stop)


def test_every_act_has_a_note_of_its_own_and_they_are_in_order() -> None:
    assert len({act.step.note for act in ACTS}) == len(ACTS)
    assert all(a.step.at < b.step.at for a, b in pairwise(ACTS))
    assert BASE.steps == tuple(act.step for act in ACTS)


def test_the_arm_follows_the_story_of_the_base() -> None:
    told: list[Step] = []
    clock = ManualClock()
    with FakeArm() as arm:
        base = FakeAutopilot(BASE, on_note=follow(arm, told.append))
        powered: dict[str, bool] = {}
        while not base.finished:
            base.poll(clock.advance(0.1))
            powered[told[-1].note] = bool(arm.robot_bits & 1)
        base.close()
    assert [step.note for step in told] == [act.step.note for act in ACTS]
    (released,) = (act.step for act in ACTS if "released" in act.step.note)
    assert {step.at for step in told if not powered[step.note]} == {
        act.step.at for act in ACTS if STOP.at <= act.step.at < released.at
    }


def test_a_command_to_the_base_does_not_move_the_arm() -> None:
    told: list[Step] = []
    with FakeArm() as arm:
        on_note = follow(arm, told.append)
        on_note(STOP)
        on_note(step(0.0, "", armed=True))
        assert arm.robot_bits == 0
    assert len(told) == 2
