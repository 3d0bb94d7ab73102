from __future__ import annotations

from collections import Counter

from mav_robot_status.clock import Instant
from mav_robot_status.testing import Action, Scenario, ardurover, step
from mav_robot_status.testing.firmwares import ARDUROVER
from mav_robot_status.testing.vehicle_model import CATCH_UP, VehicleModel


def scenario(*steps: object, **streams: float) -> Scenario:
    return Scenario("test", ARDUROVER, ARDUROVER.ready, steps, {1: 2.0})  # type: ignore[arg-type]


def at(mono: float) -> Instant:
    return Instant(mono, round(mono * 1e6))


def test_the_messages_do_not_depend_on_the_number_of_runs() -> None:
    story = scenario(step(1.3, "AUTO", custom_mode=10), step(2.2, "armed", armed=True))
    once = VehicleModel(story, 100.0).run(at(105.0))
    often = VehicleModel(story, 100.0)
    pieces = [out for tick in range(51) for out in often.run(at(100.0 + tick / 10))]
    assert once == pieces
    assert Counter(o.message.get_type() for o in once) == {"HEARTBEAT": 7, "SYS_STATUS": 10, "STATUSTEXT": 1}


def test_a_long_pause_is_not_followed_by_a_burst() -> None:
    model = VehicleModel(scenario(), 0.0)
    model.run(at(1.0))
    heartbeats = [o for o in model.run(at(3600.0)) if o.message.get_type() == "HEARTBEAT"]
    assert len(heartbeats) == CATCH_UP + 1


def test_speed_applies_to_the_steps_and_not_to_the_streams() -> None:
    model = VehicleModel(scenario(step(10.0, "armed", armed=True)), 0.0, speed=10.0)
    model.run(at(0.9))
    assert not model.state.armed
    sent = model.run(at(4.9))
    assert model.state.armed
    assert sum(o.message.get_type() == "HEARTBEAT" for o in sent) == 4


def test_ardupilot_reports_a_mode_change_at_once_and_arming_with_the_next_heartbeat() -> None:
    model = VehicleModel(scenario(step(1.3, "AUTO", custom_mode=10), step(1.5, "armed", armed=True)), 0.0)
    heartbeats = []
    for tick in range(21):
        heartbeats += [
            (tick / 10, o.message.base_mode) for o in model.run(at(tick / 10)) if o.message.get_type() == "HEARTBEAT"
        ]
    assert heartbeats == [(0.0, 65), (1.0, 65), (1.3, 9), (2.0, 137)]


def test_prearm_check_is_healthy_for_up_to_a_second_after_a_disarm() -> None:
    model = VehicleModel(scenario(step(0.5, "armed", armed=True)), 0.0)
    model.run(at(1.2))
    model.do(step(0.0, "", emergency_stop=True))
    model.run(at(2.2))
    model.do(step(0.0, "", armed=False))
    seen = [
        (o.message.get_type(), bool(getattr(o.message, "onboard_control_sensors_health", 0) & 1 << 28))
        for o in model.run(at(3.6))
        if o.message.get_type() in ("SYS_STATUS", "STATUSTEXT")
    ]
    assert seen == [
        ("STATUSTEXT", False),  # Throttle disarmed
        ("SYS_STATUS", True),
        ("STATUSTEXT", False),  # PreArm: Motors Emergency Stopped
        ("SYS_STATUS", False),
        ("SYS_STATUS", False),
    ]


def test_failing_checks_are_announced_again_every_thirty_seconds() -> None:
    model = VehicleModel(scenario(step(0.5, "fails", prearm="Compass not healthy")), 0.0)
    texts = []
    for second in range(70):
        texts += [(second, o.message.text) for o in model.run(at(second)) if o.message.get_type() == "STATUSTEXT"]
    assert texts == [(n, "PreArm: Compass not healthy") for n in (1, 31, 61)]


def test_frames_on_a_cut_link_use_sequence_numbers() -> None:
    model = VehicleModel(
        scenario(step(1.1, "cut", action=Action.SILENCE), step(7.1, "back", action=Action.RESUME)), 0.0
    )
    before, silent, after = model.run(at(1.05)), model.run(at(7.05)), model.run(at(8.05))
    assert not silent
    assert before[-1].seq + 1 + 6 + 12 == after[0].seq


def test_a_looping_scenario_starts_again() -> None:
    story = scenario(step(1.0, "armed", armed=True), step(2.0, "over", action=Action.END))
    model = VehicleModel(story, 0.0, loop=True)
    model.run(at(2.5))
    assert not model.state.armed
    assert not model.finished
    model.run(at(4.5))
    assert model.state.armed


def test_after_the_end_nothing_is_sent() -> None:
    model = VehicleModel(scenario(step(2.0, "over", action=Action.END)), 0.0)
    assert model.run(at(1.0))
    model.run(at(2.0))
    assert model.finished
    assert not model.run(at(20.0))


def test_each_step_is_reported_once() -> None:
    notes: list[str] = []
    VehicleModel(ardurover.MANUAL, 0.0, on_step=lambda s: notes.append(s.note)).run(at(60.0))
    assert notes == [s.note for s in ardurover.MANUAL.steps]
