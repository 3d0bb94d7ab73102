"""The time-dependent cases of the rules: each test is a sequence of messages."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.vehicle import ExpectedVehicle
from mav_robot_status.interface import LinkState, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink import definitions as mav

from .driver import (
    ACTIVE,
    AHRS,
    BATTERY,
    CRITICAL,
    FITTED,
    GYRO,
    MOTORS,
    PREARM,
    STANDBY,
    SUB,
    Flight,
    copter,
    px4,
    rover,
)

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
CRASH = "Crash: Disarming: AngErr=42>30, Accel=0.5<3.0"
PX4_MISSION, PX4_RTL = 4 << 16 | 4 << 24, 4 << 16 | 5 << 24


def flying(**how: Any) -> Flight:
    """A copter in the air, well after boot."""
    flight = copter(**how)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE, mode=4).wait(2)
    assert flight.code == 0
    return flight


def px4_flying() -> Flight:
    flight = px4()
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE, mode=PX4_MISSION).wait(2)
    assert flight.code == 0
    return flight


def test_fields_keep_their_values_until_the_heartbeat_times_out_and_return_with_it() -> None:
    flight = flying()
    before = flight.status
    assert before.drives_powered is TRUE
    flight.stop()
    assert flight.wait(3.5) == [before]
    assert flight.wait(0.001)[-1] == RobotStatus()
    assert flight.inhibits.keys() == {"LINK_STALE"}
    flight.wait(0.5)
    flight.hb()
    assert flight.status == before
    assert flight.detail.link is LinkState.CONNECTED


def test_heartbeats_of_a_ground_station_and_a_gimbal_change_nothing_and_do_not_refresh_the_timeout() -> None:
    flight = flying()
    before = flight.status
    flight.stream("gcs", lambda: mav.Heartbeat(0, 6, 8, 0, 4, 3), ids=(255, 190))
    flight.stream("same ids", lambda: mav.Heartbeat(0, 6, 8, 0, 4, 3))
    flight.stream("gimbal", lambda: mav.Heartbeat(0, 26, 8, 0, 4, 3), ids=(1, 154))
    assert flight.wait(5) == [before]
    assert len(list(flight.hw.vehicles)) == 1
    flight.stop("heartbeat").wait(3.6)
    assert flight.status == RobotStatus(in_error=FALSE)
    assert flight.inhibits.keys() == {"HEARTBEAT_LATE"}
    flight.stop("sys_status", "version").wait(3.6)
    assert flight.inhibits.keys() == {"HEARTBEAT_LATE"}  # the frames with the same ids are news
    flight.stop("same ids").wait(3.6)
    flight.stream("same ids", lambda: mav.Heartbeat(0, 6, 8, 0, 4, 3)).wait(3.6)  # and no heartbeat of the vehicle
    assert flight.status == RobotStatus()
    assert flight.inhibits.keys() == {"LINK_STALE"}


def test_a_companion_alone_is_not_a_vehicle() -> None:
    flight = Flight(slots=(ExpectedVehicle(1),), streams=False)
    flight.stream("companion", lambda: mav.Heartbeat(0, 18, 8, 128, 4, 3))
    flight.wait(5)
    handle = flight.hw.handles.get_handle("industrial_robot_status_handle")
    assert (handle.status, handle.detail.link) == (RobotStatus(), LinkState.NEVER_SEEN)
    assert flight.tracked is None


def test_two_vehicles_have_two_handles_and_the_loss_of_one_does_not_change_the_other() -> None:
    flight = flying(slots=())
    flight.stream("second", lambda: mav.Heartbeat(4, 10, 3, 129, 4, 3), ids=(2, 1))
    flight.wait(2)
    second = flight.hw.find(2, 1)
    assert second is not None
    name = "industrial_robot_status_handle"
    assert flight.hw.handles.get_names() == [name, f"{name}/2.1"]
    other = second.handle.status
    assert other.drives_powered is TRUE
    flight.stop("heartbeat", "sys_status", "version").wait(4)
    assert flight.status == RobotStatus()
    assert second.handle.status == other


def test_a_reboot_while_armed_drops_the_latches_raises_5004_and_requests_messages_again() -> None:
    flight = rover().hb(armed=True, state=ACTIVE)
    flight.reboot(uptime_s=800).stream("system_time", flight.system_time)
    flight.text("Crash: Going to HOLD", 0)
    flight.wait(100)
    assert flight.codes == [4001]
    asked = len(flight.asks)
    flight.wait(10)
    assert len(flight.asks) == asked
    flight.reboot(uptime_s=1.2).wait(3.1)
    assert flight.codes == [5004]
    flight.wait(4)
    again = flight.asks[asked:]
    assert again
    assert all(type(ask) is mav.CommandLong and ask.command in (511, 512) for ask in again)
    flight.hb(armed=False).wait(1)
    assert flight.codes == [5004]
    flight.hb(armed=True)
    assert flight.codes == []


def test_a_crash_stays_until_the_next_arming() -> None:
    flight = flying().text(CRASH, 0)
    assert flight.code == 4001
    flight.hb(armed=False, state=STANDBY)
    assert {status.error_code for status in flight.wait(60)} == {4001}
    flight.hb(armed=True)
    assert (flight.code, flight.status.in_error) == (0, FALSE)


def test_a_cleared_text_ends_a_failsafe() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=CRITICAL).text("Radio Failsafe")
    assert flight.code == 2001
    flight.wait(3)
    flight.text("Radio Failsafe Cleared", 6).hb(state=ACTIVE)
    assert (flight.code, flight.status.in_error) == (0, FALSE)


def test_a_failsafe_without_a_cleared_text_ends_two_seconds_after_state_critical() -> None:
    flight = flying().text("Radio Failsafe")
    assert {status.error_code for status in flight.wait(1)} == {2001}
    flight.hb(state=CRITICAL)
    assert {status.error_code for status in flight.wait(10)} == {2001}
    flight.hb(state=ACTIVE)
    assert {status.error_code for status in flight.wait(1.99)} == {2001}
    flight.wait(0.02)
    assert flight.code == 0


def test_state_critical_alone_is_2000_until_a_text_names_the_failsafe() -> None:
    flight = flying().hb(state=CRITICAL)
    flight.wait(3)
    assert flight.codes == [2000]
    flight.text("GCS Failsafe")
    assert flight.codes == [2002]


def test_a_text_without_its_second_chunk_is_classified_by_its_start_after_two_seconds() -> None:
    flight = flying().chunk(7, 0, CRASH.ljust(50, "."), 0)
    assert {status.error_code for status in flight.wait(1.99)} == {0}
    flight.wait(0.1)
    assert flight.code == 4001


def test_a_chunk_without_the_start_of_its_text_is_dropped() -> None:
    flight = flying().chunk(7, 1, CRASH, 0)
    assert {status.error_code for status in flight.wait(5)} == {0}
    assert flight.vehicle.state is not None
    assert flight.vehicle.state.texts == ()


def test_a_tab_at_the_end_of_a_px4_text_is_ignored() -> None:
    flight = px4_flying().chunk(4, 0, "Failsafe activated\t", 2).hb(state=CRITICAL)
    assert [(error.code, error.text) for error in flight.detail.errors] == [(2000, "Failsafe activated")]


@pytest.mark.parametrize(("assume", "expected"), [(False, UNKNOWN), (True, FALSE)])
def test_arming_makes_a_released_stop_unknown_unless_an_option_says_otherwise(assume: bool, expected: TriState) -> None:
    flight = copter(options=HardwareOptions(estop_assume_visible=assume))
    flight.wait(5)
    assert flight.status.e_stopped is FALSE
    flight.hb(armed=True)
    assert flight.status.e_stopped is expected


@pytest.mark.parametrize("assume", [False, True])
def test_a_stop_by_rc_switch_blocks_the_drives_and_is_not_an_error(assume: bool) -> None:
    flight = flying(options=HardwareOptions(estop_assume_visible=assume))
    flight.text("RC7: MotorEStop HIGH", 6)
    stopped = flight.status
    assert (stopped.e_stopped, stopped.drives_powered, stopped.motion_possible) == (TRUE, FALSE, FALSE)
    assert (stopped.in_error, stopped.error_code) == (FALSE, 0)
    flight.wait(60)
    assert flight.status.e_stopped is TRUE
    flight.text("RC7: MotorEStop LOW", 6)
    assert (flight.status.e_stopped, flight.status.drives_powered) == (FALSE, TRUE)


def test_a_bit_is_an_error_after_two_faulty_messages_and_not_after_one() -> None:
    flight = flying()
    flight.set(health=flight.health & ~GYRO)
    seen = flight.wait(1)
    flight.set(health=flight.health | GYRO)
    seen += flight.wait(3)
    assert {status.error_code for status in seen} == {0}
    flight.set(health=flight.health & ~GYRO)
    flight.wait(2)
    assert flight.codes == [3000]
    flight.set(health=flight.health | GYRO)
    flight.wait(1)
    assert flight.codes == []


def test_in_error_is_unknown_without_sys_status() -> None:
    flight = copter()
    flight.wait(15)
    assert (flight.status.in_error, flight.status.e_stopped) == (FALSE, FALSE)
    flight.stop("sys_status")
    assert {status.in_error for status in flight.wait(5)} == {FALSE}
    flight.wait(1)
    assert (flight.status.in_error, flight.status.e_stopped) == (UNKNOWN, UNKNOWN)
    assert "SYS_STATUS_MISSING" in flight.inhibits
    flight.text(CRASH, 0)
    assert (flight.status.in_error, flight.code) == (TRUE, 4001)


def test_the_speed_of_a_rover_is_judged_with_hysteresis() -> None:
    flight = rover().hb(armed=True, state=ACTIVE)
    speed = 0.0
    flight.stream("position", lambda: mav.LocalPositionNed(flight.boot_ms, speed, 0, 0), hz=10)

    def drive(at: float) -> None:
        nonlocal speed
        speed = at
        flight.send(mav.LocalPositionNed(flight.boot_ms, at, 0, 0))

    drive(0.10)
    flight.wait(2)
    assert flight.status.in_motion is FALSE
    drive(0.20)
    assert {status.in_motion for status in flight.wait(2)} == {FALSE}
    drive(0.35)
    assert {status.in_motion for status in flight.wait(0.2)} == {FALSE}
    flight.wait(0.15)
    assert flight.status.in_motion is TRUE
    drive(0.20)
    assert {status.in_motion for status in flight.wait(2)} == {TRUE}
    drive(0.10)
    assert {status.in_motion for status in flight.wait(0.9)} == {TRUE}
    flight.wait(0.15)
    assert flight.status.in_motion is FALSE


def test_a_leak_lasts_45_seconds_after_its_last_text() -> None:
    flight = Flight(vehicle_type=SUB)
    flight.wait(12)
    for _ in range(4):
        flight.text("Leak Detected", 2)
        assert {status.error_code for status in flight.wait(20)} == {2010}
    assert {status.error_code for status in flight.wait(24.9)} == {2010}
    flight.wait(0.2)
    assert flight.code == 0


def test_a_px4_event_counts_while_armed_unless_it_answers_an_operator() -> None:
    flight = px4_flying().event(0x42)
    assert {status.error_code for status in flight.wait(9.9)} == {7002}
    flight.wait(0.2)
    assert flight.code == 0
    assert flight.event(0x62).code == 0
    flight.hb(armed=False, state=STANDBY)
    assert flight.event(0x22).code == 0


def test_an_event_with_the_protocol_log_level_is_ignored() -> None:
    assert px4_flying().event(0x88).codes == []


def test_an_unknown_text_of_high_severity_counts_for_ten_seconds_while_armed() -> None:
    flight = flying()
    assert flight.text("Something bad", 3).code == 0
    assert flight.text("Something bad", 2).code == 6002
    assert {status.error_code for status in flight.wait(9.9)} == {6002}
    flight.wait(0.2)
    assert flight.code == 0
    flight.hb(armed=False, state=STANDBY)
    assert flight.text("Something bad", 2).code == 0


def test_a_cleared_glitch_is_not_an_error_at_any_severity() -> None:
    flight = flying()
    assert flight.text("GPS Glitch cleared", 2).code == 0
    assert flight.text("GPS Glitch or Compass error", 2).code == 2008
    assert flight.text("GPS Glitch cleared", 2).codes == []


def test_failing_arming_checks_are_readiness_and_never_an_error() -> None:
    flight = copter().set(health=FITTED)
    for _ in range(20):
        flight.text("PreArm: Compass not calibrated", 2)
        seen = flight.wait(30)
        assert {(status.in_error, status.error_code) for status in seen} == {(FALSE, 0)}
        assert flight.inhibits["PREARM_FAILING"] == "PreArm: Compass not calibrated"


def test_our_own_texts_are_not_attributed_to_the_autopilot() -> None:
    flight = flying()
    before = flight.status
    flight.text("RS: MANUAL, stopped", 2, ids=(1, 192))
    assert flight.wait(3) == [before]


def test_a_battery_fault_just_after_boot_is_not_an_error() -> None:
    flight = copter().reboot().set(health=FITTED & ~BATTERY | PREARM)
    flight.stream("system_time", flight.system_time)
    seen = flight.wait(5)
    flight.set(health=FITTED | PREARM)
    seen += flight.wait(30)
    assert {status.error_code for status in seen} == {0}
    flight.set(health=FITTED & ~BATTERY | PREARM)
    flight.wait(3)
    assert flight.codes == [3025]


def test_a_stop_in_flight_is_never_false_after_disarming_even_if_the_arming_check_is_still_healthy() -> None:
    flight = flying().stop("sys_status")
    flight.hb(armed=False, state=STANDBY)
    seen = flight.wait(0.5)
    flight.send(flight.sys_status())
    seen += flight.wait(0.5)
    flight.set(health=FITTED).text("PreArm: Motors Emergency Stopped", 2).stream("sys_status", flight.sys_status)
    assert {status.e_stopped for status in seen} == {UNKNOWN}
    assert {status.e_stopped for status in flight.wait(10)} == {TRUE}
    flight.set(health=FITTED | PREARM)
    flight.wait(1)
    assert flight.status.e_stopped is TRUE
    flight.wait(1)
    assert flight.status.e_stopped is FALSE


class Outputs:
    """The motor outputs and the throttle of a vehicle as two streams."""

    def __init__(self, flight: Flight, values: list[int], climb: float = 0.0) -> None:
        self.values, self.throttle, self.speed, self.climb = values, 0, 0.0, climb
        flight.stream("vfr_hud", self._hud, hz=2).stream("outputs", self._outputs, hz=2)

    def _hud(self) -> mav.VfrHud:
        return mav.VfrHud(self.speed, self.climb, self.throttle)

    def _outputs(self) -> mav.ServoOutputRaw:
        padded = (self.values + [0] * 16)[:16]
        return mav.ServoOutputRaw._make((*padded[:8], 0, *padded[8:]))

    def set(self, values: list[int], throttle: int) -> None:
        self.values, self.throttle = values, throttle


def test_outputs_at_their_stop_value_under_full_throttle_show_the_stop_of_a_copter() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.wait(5)
    assert flight.status.e_stopped is FALSE
    outputs.set([1000] * 4, 100)
    outputs.climb = -3.0
    flight.wait(0.55)
    assert {status.e_stopped for status in flight.wait(0.9)} == {UNKNOWN}
    flight.wait(0.1)
    stopped = flight.status
    assert (stopped.e_stopped, stopped.drives_powered, stopped.motion_possible) == (TRUE, FALSE, FALSE)
    flight.set(health=FITTED).hb(armed=False, state=STANDBY)
    outputs.set([1000] * 4, 0)
    assert FALSE not in {status.e_stopped for status in flight.wait(5)}
    flight.text("PreArm: Motors Emergency Stopped", 2)
    assert flight.status.e_stopped is TRUE


def test_the_throttle_channel_shows_the_stop_of_a_rover_and_its_end() -> None:
    flight = rover()
    outputs = Outputs(flight, [1500, 0, 1500])
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0.0, 0.0, 0.0), hz=2)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE, mode=15)
    outputs.set([1500, 0, 1655], 31)
    outputs.speed = 2.0
    flight.wait(5)
    assert flight.status.e_stopped is FALSE
    outputs.set([1500, 0, 1500], 58)
    flight.wait(0.55)
    assert {status.e_stopped for status in flight.wait(0.9)} == {UNKNOWN}
    flight.wait(0.1)
    assert flight.status.e_stopped is TRUE
    outputs.throttle, outputs.speed = 81, 0.1
    assert {status.e_stopped for status in flight.wait(5)} == {TRUE}
    outputs.set([1500, 0, 1904], 80)
    flight.wait(0.5)
    assert flight.status.e_stopped is FALSE


def driving(mode: int, values: list[int], throttle: int) -> tuple[Flight, Outputs]:
    """An armed rover on assumed channels, for 5 s."""
    flight = rover()
    outputs = Outputs(flight, [1500, 0, 1500])
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE, mode=mode)
    outputs.set(values, throttle)
    flight.wait(5)
    return flight, outputs


def test_without_attitude_an_assumed_throttle_channel_at_rest_does_not_show_a_stop() -> None:
    """A rover with a motor on each side turns about the side that stands still."""
    flight, outputs = driving(15, [1655, 0, 1655], 31)
    outputs.set([1655, 0, 1500], 31)
    assert {status.e_stopped for status in flight.wait(5)} == {FALSE, UNKNOWN}


def test_a_rover_that_comes_to_rest_while_vfr_hud_is_lost_is_not_stopped() -> None:
    flight, outputs = driving(0, [1500, 0, 1655], 40)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0.0, 0.0, 0.0), hz=2).wait(5)
    flight.stop("vfr_hud")
    outputs.set([1500, 0, 1500], 0)
    seen = flight.wait(10)
    assert TRUE not in {status.e_stopped for status in seen}
    assert FALSE not in {status.drives_powered for status in seen}


def test_a_px4_that_becomes_not_ready_has_not_rebooted() -> None:
    flight = px4()
    flight.wait(15)
    assert "PREARM_FAILING" not in flight.inhibits
    flight.set(health=FITTED).hb(state=0)
    seen = flight.wait(5)
    assert flight.inhibits.keys() == {"DISARMED", "PREARM_FAILING"}
    flight.set(health=FITTED | PREARM).hb(state=STANDBY)
    seen += flight.wait(5)
    assert "PREARM_FAILING" not in flight.inhibits
    assert {status.in_error for status in seen} == {FALSE}
    assert flight.vehicle.boots == 0


def test_a_px4_failsafe_is_an_error_exactly_while_the_state_shows_it() -> None:
    flight = px4_flying().chunk(1, 0, "Failsafe activated: entering Hold for 5 seconds\t", 2)
    flight.hb(state=CRITICAL)
    seen = flight.wait(5)
    flight.chunk(2, 0, "Failsafe activated\t", 2).hb(mode=PX4_RTL)
    seen += flight.wait(5)
    assert {(status.in_error, status.error_code) for status in seen} == {(TRUE, 2000)}
    flight.hb(state=ACTIVE)
    assert {(status.in_error, status.error_code) for status in flight.wait(5)} == {(FALSE, 0)}


def test_a_refusal_in_two_chunks_is_one_text_and_not_an_error() -> None:
    flight = px4().set(health=FITTED)
    flight.wait(15)
    flight.chunk(9, 0, "Arming denied: Resolve system health failures firs", 2).chunk(9, 1, "t\t", 2)
    assert flight.inhibits["PREARM_FAILING"] == "Arming denied: Resolve system health failures first"
    assert {status.error_code for status in flight.wait(5)} == {0}


@pytest.mark.parametrize(
    ("vehicle", "state", "mode"),
    [(rover, 2, 16), (copter, 1, 0), (copter, ACTIVE, 0)],
    ids=["rover", "copter 4.7", "copter 4.5"],
)
def test_a_reboot_while_disarmed_is_detected_and_is_not_an_error(vehicle: Any, state: int, mode: int) -> None:
    flight = vehicle()
    flight.stream("system_time", flight.system_time)
    flight.text("WDG: T3 SL0 FL0", 2)
    flight.wait(100)
    assert flight.codes == [5003]
    asked = len(flight.asks)
    flight.stop()
    seen = flight.wait(1.2)
    flight.reboot().resume().stream("system_time", flight.system_time)
    flight.hb(state=state, mode=mode)
    seen += flight.wait(2)
    flight.hb(state=STANDBY, mode=0)
    seen += flight.wait(20)
    assert flight.vehicle.boots == 1
    assert flight.codes == []
    assert {status.error_code for status in seen} == {0, 5003}
    assert RobotStatus() not in seen
    assert len(flight.asks) > asked


def test_internal_errors_last_until_the_reboot() -> None:
    flight = flying()
    flight.stream("system_time", flight.system_time)
    flight.set(internal_errors=0x400)
    flight.wait(2)
    assert flight.codes == [5001]
    assert {status.error_code for status in flight.wait(60)} == {5001}
    flight.hb(armed=False, state=STANDBY).wait(5)
    flight.set(internal_errors=0).reboot()
    flight.wait(3)
    assert flight.codes == []


def test_a_battery_failsafe_does_not_make_a_critical_battery_low_again() -> None:
    flight = flying().hb(state=CRITICAL)
    flight.text("Battery 1 is low 10.50V used 1500 mAh").text("Battery Failsafe")
    assert flight.codes == [2003]
    flight.wait(20)
    flight.text("Battery 1 is critical 10.10V used 2100 mAh").text("Battery Failsafe")
    assert flight.code == 2004
    flight.wait(20)
    assert flight.code == 2004


def test_an_inav_that_reports_itself_as_ardupilot_is_recognised_by_its_first_sys_status() -> None:
    flight = rover(streams=False).hb(mode=4, armed=True, state=ACTIVE)
    assert (flight.status.mode, flight.detail.vehicle.flight_mode) == (RobotMode.AUTO, "HOLD")
    flight.set(present=0x0101000F, enabled=0x0101000F, health=0x0101000F)
    flight.send(flight.sys_status())
    assert (flight.status.mode, flight.detail.vehicle.flight_mode) == (RobotMode.MANUAL, "ACRO")


def test_the_safety_switch_is_a_stop_and_not_an_error() -> None:
    """Not in the list: the only stop that SYS_STATUS shows, from boot until the switch is pressed."""
    flight = copter().set(enabled=FITTED & ~MOTORS | PREARM, health=FITTED)
    flight.wait(12)
    assert (flight.status.e_stopped, flight.status.in_error) == (TRUE, FALSE)
    assert {"E_STOPPED", "SAFETY_SWITCH"} <= flight.inhibits.keys()
    flight.set(enabled=FITTED | PREARM, health=FITTED | PREARM)
    flight.wait(2)
    assert flight.status.e_stopped is FALSE


def test_the_estimator_of_a_booting_rover_is_not_an_error() -> None:
    """Not in the list: AHRS is unhealthy for 20 s after every boot, and counts only while armed."""
    flight = rover().reboot().set(health=FITTED & ~AHRS | PREARM)
    flight.stream("system_time", flight.system_time)
    assert {status.error_code for status in flight.wait(30)} == {0}
    flight.hb(armed=True, state=ACTIVE)
    assert flight.codes == [3021]
