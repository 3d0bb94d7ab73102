"""The fake autopilot runs the applet: its reports and their times, and how a stop is commanded."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.testing import Action, Scenario, arducopter, arduplane, ardurover, step, with_applet
from mav_robot_status.testing.commands import answer
from mav_robot_status.testing.vehicle_model import VehicleModel

ROVER = with_applet(ardurover.READY)
MOTOR_ESTOP, LOW, HIGH = 31, 0, 2
ACCEPTED, UNSUPPORTED = 0, 3


class Command:
    """A received DO_AUX_FUNCTION."""

    command, target_system, target_component = 218, 1, 1

    def __init__(self, function: float, position: float) -> None:
        self.param1, self.param2 = function, position

    def get_type(self) -> str:
        return "COMMAND_LONG"

    def get_srcSystem(self) -> int:
        return 255

    def get_srcComponent(self) -> int:
        return 190


def at(mono: float) -> Instant:
    return Instant(mono, round(mono * 1e6))


def heard(scenario: Scenario) -> VehicleModel:
    """A vehicle that has received a message."""
    model = VehicleModel(scenario, 0.0)
    model.peer_seen = True
    return model


def reports(model: VehicleModel, until: float) -> list[tuple[float, float]]:
    """Seconds since the boot, and value, of each RS_STOP until a time."""
    sent = [out.message for out in model.run(at(until))]
    found = [m for m in sent if m.get_type() == "NAMED_VALUE_FLOAT"]
    assert all(m.name == "RS_STOP" for m in found)
    return [(m.time_boot_ms / 1000, m.value) for m in found]


def test_it_reports_once_a_second_and_at_once_on_a_change() -> None:
    model = heard(ROVER)
    assert reports(model, 2.4) == [(1.0, 0), (2.0, 0)]
    model.do(step(0.0, "", emergency_stop=True))
    assert reports(model, 3.5) == [(2.4, 1), (3.4, 1)]
    model.do(step(0.0, "", safety_switch=True))
    assert reports(model, 3.5) == [(3.5, 3)]
    model.do(step(0.0, "", emergency_stop=False))
    assert reports(model, 3.5) == [(3.5, 2)]


def test_a_vehicle_without_the_applet_reports_nothing() -> None:
    model = heard(ardurover.RC_ESTOP)
    assert reports(model, 20.0) == []


def test_nothing_is_reported_on_a_link_that_the_autopilot_has_heard_nothing_on() -> None:
    assert reports(VehicleModel(ROVER._replace(streams={}), 0.0), 5.0) == []


def test_the_script_can_be_stopped_and_started() -> None:
    model = heard(ROVER)
    model.do(step(0.0, "", applet=False))
    assert reports(model, 3.5) == []
    model.do(step(0.0, "", applet=True))
    assert reports(model, 4.5) == [(4.0, 0)]


def test_a_reboot_is_reported_as_safe_and_the_applet_runs_after_it() -> None:
    model = heard(ROVER)
    model.do(step(0.0, "", emergency_stop=True, action=Action.REBOOT))
    assert reports(model, 0.0) == [(0.0, 1), (0.0, 3)]
    model.run(at(1.3))
    model.peer_seen = True
    assert reports(model, 3.3) == [(1.0, 0), (2.0, 0)]


@pytest.mark.parametrize(("position", "stopped"), [(HIGH, True), (LOW, False)])
def test_a_stop_is_commanded_as_an_auxiliary_function(position: float, stopped: bool) -> None:
    model = heard(ROVER)
    model.do(step(0.0, "", emergency_stop=not stopped))
    model.run(at(0.5))
    command: Any = Command(MOTOR_ESTOP, position)
    answer(model, command)
    sent = [out.message for out in model.run(at(0.5))]
    assert model.state.emergency_stop is stopped
    assert [m.value for m in sent if m.get_type() == "NAMED_VALUE_FLOAT"] == [float(stopped)]
    assert [m.result for m in sent if m.get_type() == "COMMAND_ACK"] == [ACCEPTED]


def test_other_auxiliary_functions_are_not_supported() -> None:
    model = heard(ROVER)
    command: Any = Command(30, HIGH)
    answer(model, command)
    assert not model.state.emergency_stop
    assert [m.result for o in model.run(at(0.0)) if (m := o.message).get_type() == "COMMAND_ACK"] == [UNSUPPORTED]


def test_a_copter_of_4_2_reports_the_switch_without_its_channel() -> None:
    model = heard(arducopter.RC_ESTOP_BARE)
    sent = [out.message for out in model.run(at(11.0))] + [out.message for out in model.run(at(20.0))]
    texts = [m.text for m in sent if m.get_type() == "STATUSTEXT"]
    assert [text for text in texts if "MotorEStop" in text] == ["MotorEStop HIGH", "MotorEStop LOW"]


def test_only_the_motor_output_shows_the_stop_of_a_plane_in_flight() -> None:
    flight = arduplane.ESTOP._replace(streams={36: 1.0, 74: 1.0})
    model = heard(flight)
    model.run(at(14.5))
    held = [out.message for out in model.run(at(20.0))]
    assert {m.servo3_raw for m in held if m.get_type() == "SERVO_OUTPUT_RAW"} == {1000}
    assert {m.throttle for m in held if m.get_type() == "VFR_HUD"} == {100}
    assert not [m for m in held if m.get_type() == "STATUSTEXT"]
    assert model.state.armed
    model.run(at(24.0))
    released = [out.message for out in model.run(at(25.5))]
    assert {m.servo3_raw for m in released if m.get_type() == "SERVO_OUTPUT_RAW"} == {2000}
