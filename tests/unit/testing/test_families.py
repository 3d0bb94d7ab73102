"""The status of the vehicles without a recording with known truth, each in a scenario.

A line is: mode | e_stopped, drives_powered, motion_possible, in_motion, in_error | error_code; ? is unknown.
"""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import RobotMode
from mav_robot_status.testing import (
    BY_NAME,
    arduboat,
    arduplane,
    ardusub,
    betaflight,
    blimp,
    inav,
    px4,
    px4_vtol,
    quadplane,
    tracker,
)
from mav_robot_status.testing import other_firmwares as rows
from mav_robot_status.testing.firmware import Firmware, base_mode, not_armable, sensors, system_status
from mav_robot_status.testing.messages import available_modes
from mav_robot_status.testing.scenarios import MODULES
from tests.pymavlink_dialect import (
    MAVLink_command_ack_message,
    MAVLink_command_long_message,
    MAVLink_event_message,
)

from .screening import Screening

FIRMWARES = [value for value in vars(rows).values() if isinstance(value, Firmware)]


@pytest.mark.parametrize("firmware", FIRMWARES, ids=lambda f: f.name)
def test_the_boot_leads_from_booting_to_ready(firmware: Firmware) -> None:
    state = firmware.booting
    assert not_armable(state)
    for step in firmware.boot:
        state = state._replace(**step.changes)
    assert state == firmware.ready


SAID: list[tuple[str, Firmware, dict[str, Any], int, int]] = [
    ("plane MANUAL disarmed", rows.ARDUPLANE, {}, 81, 3),
    ("plane INITIALISING", rows.ARDUPLANE, {"custom_mode": 16}, 17, 2),
    ("plane TAKEOFF armed on the runway", rows.ARDUPLANE, {"custom_mode": 13, "armed": True}, 217, 3),
    ("plane FBWA in flight", rows.ARDUPLANE, {"custom_mode": 5, "armed": True, "landed_state": 2}, 209, 4),
    ("plane RC lost while disarmed", rows.ARDUPLANE, {"custom_mode": 15, "failsafe": True}, 89, 5),
    ("quadplane QLAND in flight", rows.QUADPLANE, {"custom_mode": 20, "armed": True, "landed_state": 2}, 209, 4),
    ("quadplane QRTL disarmed", rows.QUADPLANE, {"custom_mode": 21}, 89, 3),
    ("sub MANUAL disarmed", rows.ARDUSUB, {}, 81, 3),
    ("sub POSHOLD armed", rows.ARDUSUB, {"custom_mode": 16, "armed": True}, 217, 4),
    ("sub SURFACE armed", rows.ARDUSUB, {"custom_mode": 9, "armed": True}, 209, 4),
    ("boat LOITER armed", rows.ARDUBOAT, {"custom_mode": 5, "armed": True}, 137, 4),
    ("boat HOLD disarmed", rows.ARDUBOAT, {"custom_mode": 4}, 1, 3),
    ("tracker AUTO armed", rows.TRACKER, {"custom_mode": 10, "armed": True}, 153, 4),
    ("blimp MANUAL armed on the ground", rows.BLIMP, {"armed": True}, 209, 3),
    ("INAV rover ACRO armed", rows.INAV_ROVER, {"armed": True}, 209, 4),
    ("INAV rover without mapping", rows.INAV_ROVER, {"custom_mode": 23, "failsafe": True}, 81, 3),
    ("INAV quad returns", rows.INAV_QUAD, {"custom_mode": 6, "armed": True, "failsafe": True}, 217, 5),
    ("Betaflight Acro armed", rows.BETAFLIGHT, {"armed": True}, 192, 4),
    ("Betaflight Failsafe", rows.BETAFLIGHT, {"custom_mode": 7}, 80, 3),
]


@pytest.mark.parametrize("row", SAID, ids=[row[0] for row in SAID])
def test_a_state_is_reported_as_by_real_firmware(row: tuple[str, Firmware, dict[str, Any], int, int]) -> None:
    _, firmware, changes, expected_base_mode, expected_status = row
    state = firmware.ready._replace(**changes)
    assert (base_mode(firmware, state), system_status(firmware, state)) == (expected_base_mode, expected_status)


@pytest.mark.parametrize(
    ("firmware", "masks"),
    [
        (rows.ARDUPLANE, (0x1361FC3F,) * 3),
        (rows.ARDUSUB, (0x1330FD2F,) * 3),
        (rows.INAV_ROVER, (0x0101000F,) * 3),
        (rows.BETAFLIGHT, (0xBC0F, 0xBC0F, 0x0F)),
    ],
    ids=lambda value: value.name if isinstance(value, Firmware) else "",
)
def test_only_an_autopilot_with_prearm_checks_reports_them(firmware: Firmware, masks: Any) -> None:
    assert sensors(firmware, firmware.ready, prearm_ok=True) == masks


def test_available_modes_are_listed_all_or_one_by_one() -> None:
    everything = [m.to_dict() for m in available_modes(rows.BETAFLIGHT, 0)]
    assert [m["mode_name"] for m in everything][:3] == ["Acro", "Angle", "Horizon"]
    assert {m["number_modes"] for m in everything} == {len(everything)} == {8}
    assert [m.to_dict() for m in available_modes(rows.BETAFLIGHT, 4)] == [everything[3]]
    assert everything[3]["mode_index"] == 4
    assert available_modes(rows.BETAFLIGHT, 9) == available_modes(rows.ARDUSUB, 0) == []


def test_every_family_has_a_scenario_without_steps() -> None:
    assert all(f"{module.__name__.rpartition('.')[2]}/ready" in BY_NAME for module in MODULES)


# -- ArduPilot Plane ---------------------------------------------------------------------------------------------------


def test_an_initialising_plane_has_no_mode_and_cannot_move() -> None:
    boot = Screening(arduplane.BOOT)
    assert boot.at(0.5) == "? | ? F F ? ? | 0"
    assert {"DISARMED", "INITIALISING", "SYS_STATUS_MISSING"} == boot.inhibits.keys()
    assert boot.at(5.0) == "MANUAL | ? F F F F | 0"
    assert {"DISARMED", "PREARM_FAILING"} == boot.inhibits.keys()
    assert boot.at(12.0) == "MANUAL | F F F F F | 0"
    assert {"DISARMED"} == boot.inhibits.keys()


def test_a_plane_flown_by_hand() -> None:
    flight = Screening(arduplane.MANUAL)
    assert flight.at(5.5) == "MANUAL | ? T T F F | 0"
    assert flight.detail.vehicle.state == "STANDBY"
    assert flight.at(11.0) == "MANUAL | ? T T T F | 0"
    assert flight.at(14.5) == "MANUAL | ? T T F F | 0"
    assert flight.at(20.0) == "MANUAL | F F F F F | 0"


def test_loiter_of_a_plane_is_a_program() -> None:
    flight = Screening(arduplane.AUTO)
    assert flight.at(11.5) == "AUTO | ? T T T F | 0"
    assert flight.flight_mode == "LOITER"
    assert flight.at(15.0) == "AUTO | ? T T T F | 0"
    assert flight.at(24.0) == "AUTO | F F F F F | 0"


def test_the_radio_failsafe_of_a_plane_from_short_to_long_to_off() -> None:
    flight = Screening(arduplane.RC_FAILSAFE)
    assert flight.at(14.0) == "MANUAL | ? T T T F | 0"
    assert flight.at(15.5) == "AUTO | ? T T T T | 2001"
    assert flight.flight_mode == "CIRCLE"
    assert flight.at(27.0) == "AUTO | ? T T T T | 2001"
    assert flight.flight_mode == "RTL"
    assert flight.at(29.5) == "AUTO | ? T T T F | 0"
    assert flight.at(31.1) == "MANUAL | ? T T T F | 0"


def test_a_crashed_plane_is_in_error_until_it_is_armed_again() -> None:
    flight = Screening(arduplane.CRASH)
    assert flight.at(17.5) == "AUTO | ? F F F T | 4001"
    assert {"DISARMED", "EMERGENCY"} == flight.inhibits.keys()
    assert flight.at(29.0) == "MANUAL | F F F F T | 4001"
    assert {"DISARMED"} == flight.inhibits.keys()
    assert flight.at(31.5) == "MANUAL | ? T T F F | 0"


def test_a_terminated_plane_is_stopped_until_it_reboots() -> None:
    flight = Screening(arduplane.TERMINATION)
    assert flight.at(16.0) == "AUTO | T F F T T | 1002"
    assert flight.inhibits["TERMINATION"] == "Terminating due to GCS request"
    assert {"DISARMED", "E_STOPPED", "TERMINATION", "PREARM_FAILING"} == flight.inhibits.keys()
    assert flight.at(21.5) == "AUTO | T F F F T | 1002"
    assert flight.at(25.0) == "MANUAL | ? F F ? ? | 0"  # a reboot forgets the streams
    assert flight.at(40.0) == "MANUAL | F F F F F | 0"


def test_missing_terrain_data_are_not_an_error() -> None:
    assert Screening(arduplane.NO_TERRAIN_DATA).at(14.0) == "AUTO | ? T T T F | 0"


# -- ArduPilot QuadPlane -----------------------------------------------------------------------------------------------


def test_a_quadplane_on_rotors_and_on_wings() -> None:
    flight = Screening(quadplane.VTOL)
    assert flight.at(5.5) == "MANUAL | ? T T F F | 0"
    assert flight.at(11.0) == "MANUAL | ? T T T F | 0"
    assert flight.flight_mode == "QLOITER"
    assert flight.at(17.0) == "MANUAL | ? T T T F | 0"
    assert flight.at(20.0) == "AUTO | ? T T T F | 0"
    assert flight.at(29.0) == "AUTO | ? T T T F | 0"
    assert flight.flight_mode == "QRTL"
    assert flight.at(31.9) == "AUTO | ? T T F F | 0"
    assert flight.at(36.0) == "AUTO | F F F F F | 0"


def test_a_quadplane_that_calls_itself_airborne_while_disarmed_is_not_in_motion() -> None:
    flight = Screening(quadplane.QHOVER_DISARMED)
    assert flight.at(6.0) == "MANUAL | F F F F F | 0"
    assert (flight.flight_mode, flight.detail.vehicle.state) == ("QHOVER", "ACTIVE")


def test_qland_is_a_program_and_cannot_be_armed() -> None:
    flight = Screening(quadplane.QLAND)
    assert flight.at(4.5) == "MANUAL | ? T T T F | 0"
    assert flight.at(8.0) == "AUTO | ? T T T F | 0"
    assert flight.at(16.0) == "AUTO | ? F F F F | 0"
    assert flight.inhibits["PREARM_FAILING"] == "PreArm: QLAND mode not armable"


# -- ArduPilot Sub -----------------------------------------------------------------------------------------------------


def test_a_dive() -> None:
    dive = Screening(ardusub.DIVE)
    assert dive.at(8.0) == "MANUAL | ? T T T F | 0"
    assert dive.at(11.0) == "MANUAL | ? T T F F | 0"
    assert dive.at(15.0) == "MANUAL | ? T T F F | 0"
    assert dive.flight_mode == "POSHOLD"
    assert dive.at(19.0) == "AUTO | ? T T T F | 0"
    assert dive.at(25.0) == "AUTO | ? T T T F | 0"
    assert dive.flight_mode == "SURFACE"
    assert dive.at(35.0) == "MANUAL | F F F F F | 0"


def test_a_leak_is_an_error_until_45_seconds_after_the_last_text() -> None:
    dive = Screening(ardusub.LEAK)
    assert dive.at(15.0) == "AUTO | ? T T T T | 2010"
    assert dive.detail.vehicle.state == "ACTIVE"
    assert dive.at(96.9) == "MANUAL | ? T T F T | 2010"
    assert [error.text for error in dive.detail.errors] == ["Leak Detected"]
    assert dive.at(97.1) == "MANUAL | ? T T F F | 0"


def test_a_lost_joystick_is_an_error_until_the_state_is_normal() -> None:
    dive = Screening(ardusub.PILOT_LOST)
    assert dive.at(12.1) == "MANUAL | ? T T F T | 2001"
    assert dive.at(19.9) == "MANUAL | ? T T F T | 2001"
    assert dive.at(23.1) == "MANUAL | ? T T F F | 0"


def test_without_a_landed_state_a_sub_at_rest_is_at_rest() -> None:
    dive = Screening(ardusub.READY)
    assert dive.at(6.0) == "MANUAL | ? F F F F | 0"
    assert dive.at(600.0) == "MANUAL | F F F F F | 0"


# -- ArduPilot Boat ----------------------------------------------------------------------------------------------------


def test_a_boat_moves_when_it_drifts_and_not_when_it_is_rolled() -> None:
    boat = Screening(arduboat.DRIFT)
    assert boat.at(6.9) == "MANUAL | ? T T T F | 0"
    assert boat.at(10.0) == "AUTO | ? T T F F | 0"
    assert boat.at(14.0) == "AUTO | ? T T F F | 0"
    assert boat.at(18.0) == "AUTO | ? T T T F | 0"
    assert boat.at(22.0) == "AUTO | ? T T T F | 0"
    assert boat.flight_mode == "HOLD"
    assert boat.at(28.0) == "AUTO | F F F T F | 0"


def test_a_lost_ground_station_of_a_boat_is_the_failsafe_that_the_boat_reports() -> None:
    boat = Screening(arduboat.GCS_FAILSAFE)
    assert boat.at(8.5) == "AUTO | ? T T T F | 0"
    assert boat.at(12.0) == "AUTO | ? T T F T | 2002"
    assert boat.flight_mode == "HOLD"
    assert boat.at(17.0) == "AUTO | ? T T F F | 0"
    assert boat.at(20.0) == "AUTO | ? T T T F | 0"


# -- ArduPilot AntennaTracker and Blimp --------------------------------------------------------------------------------


def test_a_tracker_moves_by_turning() -> None:
    antenna = Screening(tracker.TRACKING)
    assert antenna.at(7.5) == "AUTO | ? T T T F | 0"
    assert antenna.flight_mode == "SCAN"
    assert antenna.at(11.0) == "AUTO | ? T T F F | 0"
    assert antenna.at(15.0) == "AUTO | ? T T T F | 0"
    assert antenna.at(19.0) == "AUTO | ? T T F F | 0"
    assert antenna.flight_mode == "STOP"
    assert antenna.at(21.0) == "MANUAL | ? T T F F | 0"


def test_the_safety_switch_of_a_tracker_is_a_stop() -> None:
    antenna = Screening(tracker.SAFETY_SWITCH)
    assert antenna.at(5.5).startswith("AUTO | ? T T")
    assert antenna.at(8.0).startswith("AUTO | T F F")
    assert {"DISARMED", "E_STOPPED", "SAFETY_SWITCH"} <= antenna.inhibits.keys()
    assert antenna.at(14.0).startswith("AUTO | ? T T")
    assert antenna.status.error_code == 0


def test_a_blimp_in_manual_and_in_automatic_modes() -> None:
    flight = Screening(blimp.FLIGHT)
    assert flight.at(5.5) == "MANUAL | ? T T F F | 0"
    assert flight.at(11.0) == "MANUAL | ? T T T F | 0"
    assert flight.flight_mode == "LOITER"
    assert flight.at(15.0) == "AUTO | ? T T T F | 0"
    assert flight.at(19.0) == "AUTO | ? T T T F | 0"
    assert flight.flight_mode == "LAND"
    assert flight.at(26.0) == "AUTO | F F F F F | 0"


def test_a_blimp_without_radio_lands() -> None:
    flight = Screening(blimp.RC_FAILSAFE)
    assert flight.at(8.5) == "MANUAL | ? T T T F | 0"
    assert flight.at(12.0) == "AUTO | ? T T T T | 2001"
    assert flight.at(17.0) == "AUTO | ? T T T F | 0"


def test_a_user_can_declare_the_class_of_a_mode() -> None:
    """An old Blimp has MANUAL and LAND the other way round."""
    overrides = {"blimp": {0: RobotMode.MANUAL, 1: RobotMode.AUTO}, "plane": {12: RobotMode.MANUAL}}
    options = HardwareOptions(mode_overrides=overrides)  # type: ignore[arg-type]
    old = Screening(blimp.FLIGHT, options)
    assert old.at(5.5) == "AUTO | ? T T F F | 0"
    assert old.at(11.0) == "MANUAL | ? T T T F | 0"  # LOITER, as in the table
    assert old.at(19.0) == "MANUAL | ? T T T F | 0"
    assert old.vehicle.handle.evidence["mode"].rule == "mode_overrides"


# -- PX4 ---------------------------------------------------------------------------------------------------------------


def test_a_px4_vtol_on_its_wings_and_on_its_rotors() -> None:
    flight = Screening(px4_vtol.TRANSITION)
    assert flight.at(2.5) == "MANUAL | F F F F F | 0"
    assert flight.at(4.5) == "AUTO | F T T F F | 0"
    assert flight.flight_mode == "AUTO.VTOL_TAKEOFF"
    assert flight.at(10.0) == "AUTO | F T T T F | 0"
    assert flight.at(14.0) == "AUTO | F T T T F | 0"
    assert flight.at(20.0) == "MANUAL | F T T T F | 0"
    assert flight.at(30.0) == "MANUAL | F F F F F | 0"


def test_the_kill_switch_of_a_vtol() -> None:
    flight = Screening(px4_vtol.KILL)
    assert flight.at(16.0) == "AUTO | T F F T T | 1001"
    assert flight.inhibits["TERMINATION"] == "Kill engaged"
    assert flight.at(22.0) == "AUTO | T F F F T | 1001"
    assert flight.at(25.0) == "AUTO | F F F F F | 0"


def event(log_levels: int, sequence: int) -> MAVLink_event_message:
    return MAVLink_event_message(0, 0, 1 << 24, 1000, sequence, log_levels, [0] * 40)


def test_an_event_is_an_error_for_ten_seconds_unless_it_answers_the_operator() -> None:
    flight = Screening(px4.MANUAL)
    flight.at(2.5)
    assert flight.receive(event(0x42, 1)) == "MANUAL | F F F F F | 0"  # disarmed: readiness
    flight.at(9.0)
    assert flight.receive(event(0x62, 2)) == "MANUAL | F T T T F | 0"
    assert flight.receive(event(0x42, 3)) == "MANUAL | F T T T T | 7002"
    assert flight.at(18.9).endswith("T | 7002")
    assert flight.at(19.1).endswith("F | 0")


# -- INAV and Betaflight -----------------------------------------------------------------------------------------------


def test_a_rover_of_inav_counts_its_modes_as_a_plane() -> None:
    drive = Screening(inav.DRIVE)
    assert drive.at(2.5) == "MANUAL | ? F F ? F | 0"  # a speed of zero means unknown
    assert drive.at(7.5) == "MANUAL | ? T T T F | 0"
    assert drive.flight_mode == "ACRO"
    assert drive.at(10.5) == "MANUAL | ? T T T F | 0"
    assert drive.flight_mode == "FLY_BY_WIRE_A"
    assert drive.at(13.5) == "AUTO | ? T T T F | 0"
    assert drive.at(16.9) == "AUTO | ? T T ? F | 0"
    assert drive.at(18.5) == "MANUAL | ? F F ? F | 0"


def test_a_rover_of_inav_without_remote_control_has_no_mode() -> None:
    drive = Screening(inav.RC_LOST)
    assert drive.at(5.5) == "MANUAL | ? T T ? F | 0"
    assert drive.at(11.5) == "? | ? F F ? F | 0"
    assert {"DISARMED"} == drive.inhibits.keys()
    assert drive.at(14.5) == "MANUAL | ? F F ? F | 0"


def test_inav_is_calibrating_at_boot() -> None:
    drive = Screening(inav.BOOT)
    assert drive.at(2.0) == "MANUAL | ? F F ? F | 0"
    assert {"DISARMED", "CALIBRATING"} == drive.inhibits.keys()
    drive.at(5.0)
    assert {"DISARMED"} == drive.inhibits.keys()


def test_a_quad_of_inav_returns_home_without_remote_control() -> None:
    flight = Screening(inav.RETURN_TO_HOME)
    assert flight.at(8.5) == "MANUAL | ? T T T F | 0"
    assert flight.at(12.0) == "AUTO | ? T T T T | 3016"
    assert flight.flight_mode == "RTL"
    assert flight.at(17.0) == "MANUAL | ? T T T F | 0"


def test_a_betaflight_flown_by_hand() -> None:
    flight = Screening(betaflight.MANUAL)
    assert flight.at(2.5) == "MANUAL | ? F F F F | 0"
    assert flight.flight_mode is None  # base_mode has no CUSTOM_MODE flag
    assert flight.at(5.0) == "MANUAL | ? T T ? F | 0"  # at rest, or in the air? It has no landed state
    assert flight.flight_mode == "Acro"
    assert flight.at(9.0) == "MANUAL | ? T T T F | 0"
    assert flight.at(16.0) == "MANUAL | ? F F F F | 0"


def test_the_standard_modes_that_a_betaflight_lists_win_over_its_base_mode() -> None:
    flight = Screening(betaflight.AUTOPILOT)
    assert flight.at(5.0) == "MANUAL | ? T T ? F | 0"
    assert flight.at(10.0) == "AUTO | ? T T T F | 0"
    assert flight.flight_mode == "Autopilot"
    assert flight.vehicle.handle.evidence["mode"].rule == "AVAILABLE_MODES.standard_mode MISSION"
    assert flight.at(14.0) == "MANUAL | ? T T ? F | 0"
    assert flight.flight_mode == "Pos Hold"
    assert flight.at(18.0) == "AUTO | ? T T T F | 0"
    assert flight.vehicle.handle.evidence["mode"].rule == "AVAILABLE_MODES.standard_mode SAFE_RECOVERY"


def test_without_its_modes_a_betaflight_has_the_mode_of_its_base_mode() -> None:
    silent = betaflight.AUTOPILOT._replace(firmware=betaflight.AUTOPILOT.firmware._replace(modes=()))
    flight = Screening(silent)
    assert flight.at(10.0) == "MANUAL | ? T T T F | 0"
    assert flight.flight_mode is None


def test_the_current_mode_counts_while_it_is_fresh_and_of_this_mode() -> None:
    flight = Screening(betaflight.AUTOPILOT)
    flight.at(7.0)
    flight.command(512, 436)
    assert flight.at(7.1) == "AUTO | ? T T T F | 0"
    assert flight.vehicle.handle.evidence["mode"].rule == "CURRENT_MODE.standard_mode MISSION"
    flight.at(11.6)
    assert flight.vehicle.handle.evidence["mode"].rule == "AVAILABLE_MODES.standard_mode POSITION_HOLD"


def test_the_failsafe_of_a_betaflight_disarms_it() -> None:
    flight = Screening(betaflight.FAILSAFE)
    assert flight.at(8.0) == "AUTO | ? F F F F | 0"
    assert flight.flight_mode == "Failsafe"
    assert flight.at(14.0) == "MANUAL | ? F F F F | 0"


# -- commands of other peers  -----------------------------------------------------------------------------------------

GROUND_STATION = (255, 190)
LOW, HIGH = 0.0, 2.0


def aux_function(position: float) -> MAVLink_command_long_message:
    """MAV_CMD_DO_AUX_FUNCTION: the motor emergency stop."""
    return MAVLink_command_long_message(1, 1, 218, 0, 31.0, position, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_stop_that_a_ground_station_commands_is_known_when_the_plane_has_accepted_it() -> None:
    accepted = MAVLink_command_ack_message(218, 0, 0, 0, *GROUND_STATION)
    flight = Screening(arduplane.AUTO)
    assert flight.at(14.0) == "AUTO | ? T T T F | 0"
    assert flight.receive(aux_function(HIGH), GROUND_STATION) == "AUTO | ? ? ? T F | 0"
    assert flight.receive(accepted) == "AUTO | T F F T F | 0"
    assert {"E_STOPPED"} == flight.inhibits.keys()
    assert flight.at(17.0) == "AUTO | ? ? ? T F | 0"  # it flies on under power
    flight.receive(aux_function(LOW), GROUND_STATION)
    assert flight.receive(accepted) == "AUTO | F T T T F | 0"
