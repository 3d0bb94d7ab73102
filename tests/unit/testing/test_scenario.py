from __future__ import annotations

import pytest

from mav_robot_status.testing import BY_NAME, DEMO, Action, Scenario, VehicleState, step
from mav_robot_status.testing.scenario import shifted


def test_step_builds_a_step() -> None:
    made = step(2.0, "armed", (6, "Throttle armed"), armed=True)
    assert made.at == 2.0
    assert made.note == "armed"
    assert made.changes == {"armed": True}
    assert [tuple(text) for text in made.texts] == [(6, "Throttle armed")]
    assert made.action is None


def test_a_misspelt_field_is_an_error_at_once() -> None:
    with pytest.raises((TypeError, ValueError), match="armd"):
        step(0.0, "", armd=True)


def test_steps_can_be_shifted() -> None:
    assert [s.at for s in shifted(2.0, (step(0.0, "a"), step(1.0, "b")))] == [2.0, 3.0]


@pytest.mark.parametrize("scenario", BY_NAME.values(), ids=BY_NAME)
def test_a_scenario_has_a_duration_and_steps_in_order(scenario: Scenario) -> None:
    times = [s.at for s in scenario.steps]
    assert times == sorted(times)
    assert scenario.title
    for s in scenario.steps:
        assert s.note
        assert "\n" not in s.note + "".join(text.text for text in s.texts)


def test_every_firmware_has_the_same_scenarios() -> None:
    common = {"ready", "boot", "prearm-failing", "manual", "auto", "rc-failsafe", "link-silence", "reboot"}
    for firmware in ("ardurover", "arducopter", "px4"):
        assert common <= {name.partition("/")[2] for name in BY_NAME if name.startswith(firmware)}
    assert {"ardurover/crash", "arducopter/crash", "ardurover/rc-estop", "arducopter/safety-switch", "px4/kill"} <= set(
        BY_NAME
    )


def test_the_demo_takes_about_half_a_minute() -> None:
    assert 28 <= DEMO.duration <= 36
    assert DEMO.steps[-1].action is Action.END
    silent = [s.at for s in DEMO.steps if s.action in (Action.SILENCE, Action.RESUME)]
    assert silent[1] - silent[0] > 4.5  # a link counts as lost after 3.5 s


def test_each_state_of_the_demo_lasts_until_the_status_has_changed() -> None:
    """PREARM_CHECK must be seen healthy twice, 2 s after the first heartbeat, before the rover is armed."""
    changes = [(s.at, s.changes) for s in DEMO.steps]
    ready = next(at for at, change in changes if change.get("prearm") == "")
    armed = next(at for at, change in changes if change.get("armed"))
    assert ready >= 2.0
    assert armed - ready >= 2.0


def test_a_vehicle_is_disarmed_and_still_by_default() -> None:
    state = VehicleState()
    assert not state.armed
    assert state.velocity == (0.0, 0.0, 0.0)
