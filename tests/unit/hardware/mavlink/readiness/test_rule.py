"""Why a vehicle cannot be armed: every reason of ArduPilot, and when each ends."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.enumerations import MAV_CMD_RUN_PREARM_CHECKS

from ..driver import ACTIVE, ARDUPILOT, FITTED, PREARM, PX4, QUAD, STANDBY, Flight, copter, px4

RUN = MAV_CMD_RUN_PREARM_CHECKS


def not_ready(**how: Any) -> Flight:
    """A disarmed copter whose checks fail."""
    flight = copter(**how).set(health=FITTED)
    flight.wait(2)
    return flight


def reasons(flight: Flight) -> list[str | None]:
    return [inhibit.text for inhibit in flight.detail.inhibits if inhibit.name == "PREARM_FAILING"]


def burst(flight: Flight, *words: str, prefix: str = "PreArm") -> Flight:
    for word in words:
        flight.text(f"{prefix}: {word}", 2)
    return flight


def asked(flight: Flight) -> int:
    """How often it was asked to run its checks."""
    return sum(isinstance(ask, mav.CommandLong) and ask.command == RUN for ask in flight.asks)


def test_every_reason_of_a_burst_is_an_inhibit_with_a_beginning_of_its_own() -> None:
    flight = not_ready()
    assert reasons(flight) == [None]
    burst(flight, "Accels inconsistent", "GPS 1: Bad fix").wait(30)
    burst(flight, "Accels inconsistent", "GPS 1: Bad fix", "Compass not calibrated")
    assert reasons(flight) == [
        "PreArm: Accels inconsistent",
        "PreArm: GPS 1: Bad fix",
        "PreArm: Compass not calibrated",
    ]
    begun = [inhibit.since_us for inhibit in flight.detail.inhibits if inhibit.text]
    assert begun[0] == begun[1] == begun[2] - 30_000_000


def test_reasons_end_one_by_one_without_any_message() -> None:
    flight = burst(not_ready(), "Accels inconsistent", "AHRS: waiting for home")
    flight.wait(24)
    burst(flight, "Need Position Estimate").wait(0.9)
    assert len(reasons(flight)) == 3
    flight.stop().wait(0.2)
    assert reasons(flight) == ["PreArm: Need Position Estimate"]


def test_passing_checks_end_every_reason() -> None:
    flight = burst(not_ready(), "Accels inconsistent", "GPS 1: Bad fix")
    flight.set(health=FITTED | PREARM).wait(1)
    assert reasons(flight) == []
    flight.set(health=FITTED).wait(1)
    assert reasons(flight) == [None]


def test_arming_ends_every_reason() -> None:
    flight = burst(not_ready(), "Accels inconsistent", "GPS 1: Bad fix")
    flight.hb(armed=True, state=ACTIVE).wait(3)
    flight.hb(armed=False, state=STANDBY).wait(3)
    assert reasons(flight) == [None]


def test_a_reboot_ends_every_reason() -> None:
    flight = not_ready().stream("time", lambda: flight.system_time())
    burst(flight, "Accels inconsistent", "GPS 1: Bad fix").wait(3)
    flight.reboot().wait(3)
    assert flight.vehicle.boots == 1
    assert reasons(flight) == [None]


def test_a_long_link_loss_ends_every_reason() -> None:
    flight = burst(not_ready(), "Accels inconsistent", "GPS 1: Bad fix")
    flight.stop().wait(31)
    flight.resume().wait(2)
    assert reasons(flight) == [None]


def test_reasons_are_shown_only_while_the_checks_fail() -> None:
    flight = copter()
    flight.wait(2)
    burst(flight, "Accels inconsistent")
    assert reasons(flight) == []


def test_a_refused_motor_test_is_no_reason_not_to_arm() -> None:
    flight = burst(not_ready(), "Accels inconsistent")
    flight.text("MotorTest: Emergency Stopped", 2)
    assert reasons(flight) == ["PreArm: Accels inconsistent"]
    assert flight.status.e_stopped is TriState.TRUE


def test_a_flood_of_reasons_is_bounded() -> None:
    flight = not_ready()
    for number in range(60):
        flight.text(f"PreArm: {chr(33 + number)}", 2)
        assert len(reasons(flight)) <= 16


def test_the_latest_text_of_px4_is_the_only_one() -> None:
    flight = px4().set(health=FITTED)
    flight.wait(2)
    flight.text("Preflight Fail: Compass 0 fault", 2).text("Preflight Fail: No manual control input", 2).wait(200)
    assert reasons(flight) == ["Preflight Fail: No manual control input"]


def test_a_safety_switch_in_a_text_of_px4_is_an_inhibit_of_its_own() -> None:
    flight = px4().set(health=FITTED)
    flight.wait(2)
    flight.text("Preflight Fail: Press safety button first", 2)
    assert "SAFETY_SWITCH" in flight.inhibits
    flight.text("Preflight Fail: Compass 0 fault", 2)
    assert "SAFETY_SWITCH" not in flight.inhibits


# -- asking ------------------------------------------------------------------------------------------------------------


def test_an_ardupilot_that_is_not_ready_is_asked_once_why() -> None:
    flight = not_ready()
    flight.wait(120)
    assert asked(flight) == 1
    flight.set(health=FITTED | PREARM).wait(10)
    flight.set(health=FITTED).wait(60)
    assert asked(flight) == 1


def test_it_is_asked_again_after_a_link_loss_and_after_a_reboot() -> None:
    flight = not_ready().stream("time", lambda: flight.system_time())
    flight.wait(10)
    flight.stop().wait(5)
    flight.resume().stream("time", lambda: flight.system_time()).wait(10)
    assert asked(flight) == 2
    flight.reboot().wait(20)
    assert flight.vehicle.boots == 1
    assert asked(flight) == 3


def test_it_is_asked_again_on_a_new_connection() -> None:
    flight = not_ready()
    flight.wait(10)
    flight.hw.reconnected([(1, 1)], flight.clock.now().mono)
    flight.wait(10)
    assert asked(flight) == 2


def test_a_text_of_the_boot_is_no_second_boot() -> None:
    flight = not_ready()
    flight.wait(5)
    flight.text("ArduPilot Ready", 6).wait(10)
    assert asked(flight) == 1


@pytest.mark.parametrize(
    ("autopilot", "armed", "health"),
    [(ARDUPILOT, True, FITTED), (ARDUPILOT, False, FITTED | PREARM), (PX4, True, FITTED), (0, False, FITTED)],
)
def test_no_other_vehicle_is_asked(autopilot: int, armed: bool, health: int) -> None:
    flight = Flight(autopilot, QUAD).set(health=health).hb(armed=armed, state=ACTIVE if armed else STANDBY)
    flight.wait(30)
    assert asked(flight) == 0


def test_a_vehicle_on_a_passive_link_is_not_asked() -> None:
    flight = Flight(ARDUPILOT, QUAD).set(health=FITTED)
    due = flight.hw.due_requests
    flight.hw.due_requests = lambda now, *_: due(now, {(1, 1)})  # type: ignore[method-assign]
    flight.wait(30)
    assert flight.asks == []


def test_a_vehicle_that_another_sender_says_is_armed_is_not_asked() -> None:
    from ..driver import frame_of

    flight = copter()
    flight.wait(5)
    armed = flight.heartbeat()._replace(base_mode=129)
    for _ in range(40):
        flight.hw.on_frame(frame_of(armed), flight.clock.now(), "another way")
        flight.set(health=FITTED).wait(0.5)
    assert asked(flight) == 0
