"""Evidence, reasons and start times. The truth table covers the fields themselves."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.readiness.rule import INHIBITS
from mav_robot_status.interface import STATES, Detail, RobotMode, TriState

from .driver import (
    ACTIVE,
    EMERGENCY,
    FITTED,
    MOTORS,
    PREARM,
    PX4,
    STANDBY,
    TERMINATED,
    Flight,
    check_invariants,
    copter,
    derived,
    px4,
)
from .truth_table import CASES, state_of

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

EVERY_OPTION = [
    HardwareOptions(),
    HardwareOptions(hover_is_motion=False, manual_blocks_motion=True, treat_hil_as_live=True),
    HardwareOptions(estop_unknown_as="false", estop_assume_visible=True, link_loss_is_error=True),
    HardwareOptions(watch_outputs=False, text_hold_s=0.0),
]


@pytest.mark.parametrize("options", EVERY_OPTION)
def test_the_invariants_hold_in_every_row_of_the_truth_table_for_any_options(options: HardwareOptions) -> None:
    for case in CASES:
        state, now = state_of(case["inputs"])
        found = derived(state, Detail(), now, options)
        check_invariants(found.status, found.detail, options)


def test_every_field_has_evidence() -> None:
    flight = copter()
    flight.wait(5)
    evidence = flight.vehicle.handle.evidence
    assert evidence.keys() == {field.name for field in STATES}
    assert all(why.rule for why in evidence.values())
    assert evidence["drives_powered"].source == "HEARTBEAT.base_mode 1"
    flight.stop().wait(5)
    assert {why.rule for why in flight.vehicle.handle.evidence.values()} == {"no frame within heartbeat_timeout"}


def test_the_bits_of_the_inhibits_are_those_of_the_specification() -> None:
    assert list(enumerate(INHIBITS)) == [
        (0, "LINK_STALE"),
        (1, "DISARMED"),
        (2, "E_STOPPED"),
        (3, "SAFETY_SWITCH"),
        (4, "PREARM_FAILING"),
        (5, "INITIALISING"),
        (6, "CALIBRATING"),
        (7, "POWERING_OFF"),
        (8, "TERMINATION"),
        (9, "EMERGENCY"),
        (10, "HIL"),
        (11, "SYS_STATUS_MISSING"),
        (12, "MODE_MANUAL"),
        (13, "STOP_UNCERTAIN"),
        (14, "SENDER_UNCERTAIN"),
        (15, "HEARTBEAT_LATE"),
    ]


@pytest.mark.parametrize(
    ("flight", "reasons"),
    [
        (copter(), {"DISARMED"}),
        (copter().set(enabled=FITTED & ~MOTORS | PREARM), {"DISARMED", "E_STOPPED", "SAFETY_SWITCH"}),
        (copter().set(health=FITTED), {"DISARMED", "PREARM_FAILING"}),
        (px4().set(health=FITTED), {"DISARMED", "PREARM_FAILING"}),
        (px4().hb(state=0), {"DISARMED", "PREARM_FAILING"}),
        (Flight(0).hb(state=0), {"DISARMED", "INITIALISING"}),
        (copter().hb(state=1), {"DISARMED", "INITIALISING", "SYS_STATUS_MISSING"}),
        (copter().hb(state=2, armed=True), {"CALIBRATING"}),
        (copter().hb(state=7, armed=True), {"POWERING_OFF"}),
        (px4().hb(state=TERMINATED, armed=True), {"E_STOPPED", "TERMINATION"}),
        (copter().hb(state=EMERGENCY, armed=True), {"EMERGENCY"}),
        (copter().hb(armed=True, flags=0x21), {"HIL"}),
        (copter(streams=False).hb(), {"DISARMED", "SYS_STATUS_MISSING"}),
        (copter(options=HardwareOptions(manual_blocks_motion=True)).hb(armed=True), {"MODE_MANUAL"}),
    ],
)
def test_each_reason_that_inhibits_motion_is_reported(flight: Flight, reasons: set[str]) -> None:
    assert flight.look().inhibits.keys() - {"SYS_STATUS_MISSING"} == reasons - {"SYS_STATUS_MISSING"}
    assert flight.status.motion_possible is not TRUE


def test_a_reason_has_the_time_of_its_start() -> None:
    flight = copter().look()
    since = {inhibit.name: inhibit.since_us for inhibit in flight.detail.inhibits}
    flight.set(health=FITTED).wait(5)
    after = {inhibit.name: inhibit.since_us for inhibit in flight.detail.inhibits}
    assert after["DISARMED"] == since["DISARMED"]
    assert after["PREARM_FAILING"] == since["DISARMED"] + 1_000_000


def test_the_px4_safety_button_is_detected_from_its_text() -> None:
    flight = px4().set(health=FITTED).text("Preflight Fail: Press safety button first\t", 2)
    assert {"SAFETY_SWITCH", "PREARM_FAILING"} <= flight.inhibits.keys()
    assert flight.status.e_stopped is FALSE


def test_options_change_the_field_they_control() -> None:
    armed = copter(options=HardwareOptions(manual_blocks_motion=True)).hb(armed=True, state=ACTIVE)
    assert (armed.status.mode, armed.status.motion_possible) == (RobotMode.MANUAL, FALSE)
    assert armed.hb(mode=4).status.motion_possible is TRUE
    assumed = copter(options=HardwareOptions(estop_unknown_as="false")).hb(armed=True, state=ACTIVE)
    assert assumed.status.e_stopped is FALSE
    live = px4(options=HardwareOptions(treat_hil_as_live=True)).hb(armed=True, state=ACTIVE, flags=0x21)
    assert live.status.drives_powered is TRUE


def test_px4_lockdown_in_hardware_in_the_loop_is_neither_a_stop_nor_an_error() -> None:
    flight = px4().hb(armed=True, state=TERMINATED, flags=0x21)
    assert (flight.status.e_stopped, flight.status.drives_powered, flight.codes) == (UNKNOWN, FALSE, [])


def test_an_announced_termination_lasts_until_it_is_aborted() -> None:
    flight = copter().hb(armed=True, state=ACTIVE).text("Terminating due to GCS request", 6)
    assert (flight.status.e_stopped, flight.codes) == (TRUE, [1002])
    assert "TERMINATION" in flight.inhibits
    flight.hb(armed=False, state=STANDBY).wait(60)
    assert flight.status.e_stopped is TRUE
    flight.text("Aborting termination due to GCS request", 6)
    assert flight.codes == []
    assert flight.status.e_stopped is not TRUE


@pytest.mark.parametrize(
    ("autopilot", "state", "expected"), [(0, TERMINATED, TRUE), (0, ACTIVE, UNKNOWN), (PX4, 4, FALSE)]
)
def test_an_autopilot_without_stop_evidence_is_unknown_except_in_termination(
    autopilot: int, state: int, expected: TriState
) -> None:
    assert Flight(autopilot).hb(armed=True, state=state).status.e_stopped is expected


def test_an_unknown_number_is_shown_as_a_number() -> None:
    flight = Flight(99, 200).hb(state=77)
    vehicle = flight.detail.vehicle
    assert (vehicle.autopilot, vehicle.type, vehicle.state) == ("99", "200", "77")
    flight.stop().wait(5)
    assert (flight.detail.vehicle.type, flight.detail.vehicle.state) == ("200", None)
