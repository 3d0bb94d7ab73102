"""drives_powered and motion_possible: facts in, value out."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT
from mav_robot_status.hardware.mavlink.autopilots.paparazzi import PAPARAZZI
from mav_robot_status.hardware.mavlink.facts import Facts
from mav_robot_status.hardware.mavlink.heartbeat.rule import flight_mode
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.power import drives_powered, motion_possible
from mav_robot_status.hardware.mavlink.reason import Reason
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import enumerations as mavlink

from .driver import copter

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
SITE = HardwareOptions()
ARMED, HIL = mavlink.MAV_MODE_FLAG_SAFETY_ARMED, mavlink.MAV_MODE_FLAG_HIL_ENABLED
ACTIVE, UNINIT = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_UNINIT
TERMINATED, EMERGENCY = mavlink.MAV_STATE_FLIGHT_TERMINATION, mavlink.MAV_STATE_EMERGENCY
PLAIN, DOUBT = Reason("nothing is known of a stop"), Reason("a stop may last", doubt=True)


def facts_of(base_mode: int, state: int, *, told: bool = False, **kind: Any) -> Facts:
    """The facts of a copter whose HEARTBEAT has these fields. `told`: an arming was announced since."""
    facts = copter().look().vehicle.facts
    assert facts
    return facts._replace(
        heartbeat=facts.heartbeat._replace(base_mode=base_mode, system_status=state),
        fresh=facts.fresh._replace(arming_told=told),
        kind=facts.kind._replace(**kind),
    )


@pytest.mark.parametrize(
    ("base_mode", "state", "stopped", "why", "options", "drives", "possible"),
    [
        (ARMED, ACTIVE, FALSE, PLAIN, SITE, TRUE, TRUE),
        (ARMED, ACTIVE, UNKNOWN, PLAIN, SITE, TRUE, TRUE),
        (ARMED, ACTIVE, UNKNOWN, DOUBT, SITE, UNKNOWN, UNKNOWN),
        (ARMED, ACTIVE, TRUE, PLAIN, SITE, FALSE, FALSE),
        (0, ACTIVE, FALSE, PLAIN, SITE, FALSE, FALSE),
        (0, ACTIVE, UNKNOWN, DOUBT, SITE, FALSE, FALSE),
        (ARMED, TERMINATED, FALSE, PLAIN, SITE, FALSE, FALSE),
        (ARMED, EMERGENCY, FALSE, PLAIN, SITE, TRUE, FALSE),
        (ARMED, EMERGENCY, UNKNOWN, DOUBT, SITE, UNKNOWN, FALSE),
        (ARMED, UNINIT, FALSE, PLAIN, SITE, TRUE, UNKNOWN),
        (ARMED | HIL, ACTIVE, FALSE, PLAIN, SITE, FALSE, FALSE),
        (ARMED | HIL, ACTIVE, FALSE, PLAIN, HardwareOptions(treat_hil_as_live=True), TRUE, TRUE),
        (ARMED, ACTIVE, FALSE, PLAIN, HardwareOptions(manual_blocks_motion=True), TRUE, FALSE),
        (ARMED, ACTIVE, UNKNOWN, DOUBT, HardwareOptions(manual_blocks_motion=True), UNKNOWN, FALSE),
    ],
)
def test_power_and_possible_motion_follow_from_armed_stopped_and_the_state(
    base_mode: int,
    state: int,
    stopped: TriState,
    why: Reason,
    options: HardwareOptions,
    drives: TriState,
    possible: TriState,
) -> None:
    assert values(facts_of(base_mode, state), options, stopped, why) == (drives, possible)


def test_an_announced_arming_leaves_a_disarmed_heartbeat_in_doubt_unless_it_is_stopped() -> None:
    facts = facts_of(0, ACTIVE, told=True)
    assert values(facts, SITE, UNKNOWN, PLAIN) == (UNKNOWN, UNKNOWN)
    assert values(facts, SITE, TRUE, PLAIN) == (FALSE, FALSE)


def test_a_state_that_hides_armed_says_nothing_without_the_armed_bit() -> None:
    (state, *_) = PAPARAZZI.states.hides_armed
    assert values(facts_of(0, state, profile=PAPARAZZI), SITE, UNKNOWN, PLAIN) == (UNKNOWN, UNKNOWN)
    assert values(facts_of(ARMED, state, profile=ARDUPILOT), SITE, FALSE, PLAIN)[0] is TRUE


def test_a_mode_that_shows_the_start_moves_nothing() -> None:
    facts = facts_of(ARMED, ACTIVE, family=Family.ROVER)
    starting = facts._replace(heartbeat=facts.heartbeat._replace(custom_mode=16))
    assert values(starting, SITE, FALSE, PLAIN) == (TRUE, FALSE)


def values(facts: Facts, options: HardwareOptions, stopped: TriState, why: Reason) -> tuple[TriState, TriState]:
    drives = drives_powered(facts, options, stopped, why)
    return drives[0], motion_possible(facts, options, flight_mode(facts, options), *drives)[0]
