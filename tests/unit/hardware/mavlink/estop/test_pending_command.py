"""Commands of a ground station to the vehicle and the answers, as observed on the link."""

from __future__ import annotations

import math

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.estop import pending_command
from mav_robot_status.hardware.mavlink.estop.state import NOTHING
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import RobotMode, TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import ACTIVE, PLANE, PX4, QUAD, ROVER, SUB, Flight, Ids

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)
AUX, TERMINATION = 218, 185
ESTOP, LOW, MIDDLE, HIGH = 31, 0, 1, 2
STATION: Ids = (255, 190)
OTHER_STATION: Ids = (254, 190)
VEHICLE: Ids = (1, 1)


def command(number: int, *params: float, to: Ids = VEHICLE) -> mav.CommandLong:
    param1, param2 = (*params, 0.0, 0.0)[:2]
    return mav.CommandLong(param1, param2, 0.0, 0.0, 0.0, 0.0, 0.0, number, *to, confirmation=0)


def ack(number: int = AUX, result: int = ACCEPTED, to: Ids = STATION) -> mav.CommandAck:
    return mav.CommandAck(number, result, 0, 0, *to)


def driving(autopilot: int = 3, vehicle: int = ROVER, options: HardwareOptions | None = None) -> Flight:
    """An armed vehicle without evidence of a stop. A rover is in AUTO."""
    flight = Flight(autopilot, vehicle, options=options)
    flight.hb(armed=True, state=ACTIVE, mode=10).wait(2)
    return flight


def stop(flight: Flight, position: float = HIGH) -> Flight:
    return flight.send(command(AUX, ESTOP, position), STATION)


# -- command and answer ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vehicle", [ROVER, QUAD, PLANE])
def test_an_accepted_emergency_stop_is_a_stop_until_an_accepted_release(vehicle: int) -> None:
    flight = driving(vehicle=vehicle)
    assert flight.status.e_stopped is UNKNOWN
    stop(flight)
    assert flight.status.e_stopped is UNKNOWN
    flight.send(ack())
    assert flight.status[1:4] == (TRUE, FALSE, FALSE)
    assert flight.code == 0
    assert flight.inhibits == {"E_STOPPED": None}
    flight.wait(60)
    assert flight.status.e_stopped is TRUE
    stop(flight, LOW).send(ack())
    assert flight.status[1:4] == (FALSE, TRUE, TRUE)


def test_the_command_is_the_evidence() -> None:
    flight = stop(driving()).send(ack())
    assert flight.vehicle.handle.evidence["e_stopped"].source == "COMMAND_ACK: accepted command 218 of 255.190"


def test_a_command_int_has_the_same_effect() -> None:
    flight = driving()
    named = {"param1": float(ESTOP), "param2": float(HIGH), "command": AUX, "target_system": 1, "target_component": 1}
    flight.send(mav.CommandInt(**{field: named.get(field, 0) for field in mav.CommandInt._fields}), STATION)  # type: ignore[arg-type]
    assert flight.send(ack()).status.e_stopped is TRUE


def test_a_command_to_all_components_includes_the_autopilot() -> None:
    flight = driving().send(command(AUX, ESTOP, HIGH, to=(1, 0)), STATION)
    assert flight.send(ack()).status.e_stopped is TRUE


def test_an_answer_without_a_target_is_accepted() -> None:
    assert stop(driving()).send(ack(to=(0, 0))).status.e_stopped is TRUE


# -- command or answer alone -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("result", [TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED])
def test_a_refused_stop_is_ignored_even_if_the_next_command_is_accepted(result: int) -> None:
    flight = stop(driving()).send(ack(result=result))
    assert flight.status.e_stopped is UNKNOWN
    assert flight.send(ack()).status.e_stopped is UNKNOWN


def test_a_stop_in_progress_counts_once_it_is_accepted() -> None:
    flight = stop(driving()).send(ack(result=IN_PROGRESS))
    assert flight.status.e_stopped is UNKNOWN
    assert flight.send(ack()).status.e_stopped is TRUE


@pytest.mark.parametrize("to", [(2, 1), (0, 0), (1, 154)], ids=["another vehicle", "all vehicles", "its gimbal"])
def test_a_command_to_another_system_is_ignored(to: Ids) -> None:
    flight = driving().send(command(AUX, ESTOP, HIGH, to=to), STATION)
    assert flight.send(ack()).status.e_stopped is UNKNOWN


@pytest.mark.parametrize(
    "answer",
    [ack(400), ack(to=OTHER_STATION)],
    ids=["to another command", "to another station"],
)
def test_an_answer_to_another_command_is_ignored(answer: mav.CommandAck) -> None:
    assert stop(driving()).send(answer).status.e_stopped is UNKNOWN


def test_an_answer_from_another_system_is_ignored() -> None:
    assert stop(driving()).send(ack(), ids=(1, 154)).status.e_stopped is UNKNOWN


@pytest.mark.parametrize(("position", "stopped"), [(LOW, TRUE), (MIDDLE, FALSE), (HIGH, FALSE)])
def test_function_165_engages_in_its_low_position_and_releases_in_the_others(position: int, stopped: TriState) -> None:
    flight = stop(driving(), HIGH if stopped is FALSE else LOW).send(ack())
    flight.wait(1.0)
    flight.send(command(AUX, 165, position), STATION)
    assert flight.send(ack()).status.e_stopped is stopped


@pytest.mark.parametrize(("seconds", "stopped"), [(4.9, TRUE), (5.1, UNKNOWN)])
def test_an_answer_counts_for_five_seconds(seconds: float, stopped: TriState) -> None:
    flight = stop(driving())
    flight.wait(seconds)
    assert flight.send(ack()).status.e_stopped is stopped


def test_an_answer_counts_once() -> None:
    flight = stop(driving()).send(ack())
    flight.text("RC7: MotorEStop LOW", 6)
    assert flight.send(ack()).status.e_stopped is FALSE


@pytest.mark.parametrize(
    "params",
    [(ESTOP, MIDDLE), (ESTOP, math.nan), (math.nan, HIGH), (7, HIGH), (ESTOP, 3)],
    ids=["middle", "no position", "no function", "another function", "no such position"],
)
def test_another_function_or_switch_position_is_ignored(params: tuple[float, float]) -> None:
    flight = driving().send(command(AUX, *params), STATION)
    assert flight.send(ack()).status.e_stopped is UNKNOWN


def test_an_answer_to_one_of_two_different_commands_proves_nothing() -> None:
    flight = stop(stop(driving(), HIGH), LOW).send(ack())
    assert flight.status[1:4] == (UNKNOWN, UNKNOWN, UNKNOWN)
    assert flight.send(ack()).status[1:4] == (UNKNOWN, UNKNOWN, UNKNOWN)


def test_an_answer_to_a_repeated_command_counts() -> None:
    assert stop(stop(driving())).send(ack()).status.e_stopped is TRUE
    refused = stop(stop(driving())).send(ack(result=DENIED))
    assert refused.status[1:4] == (UNKNOWN, TRUE, TRUE)


def test_another_function_that_waits_for_its_answer_makes_an_answer_ambiguous() -> None:
    flight = stop(driving()).send(command(AUX, 9, HIGH), STATION)
    assert flight.send(ack()).status.e_stopped is UNKNOWN


def test_an_answer_without_a_target_is_ambiguous_if_two_stations_wait_for_one() -> None:
    flight = stop(driving()).send(command(AUX, ESTOP, HIGH), OTHER_STATION)
    assert flight.send(ack(to=(0, 0))).status.e_stopped is UNKNOWN


def test_a_lost_answer_to_a_release_does_not_leave_a_stop() -> None:
    flight = stop(stop(driving()).send(ack()), LOW)
    assert flight.status[1:4] == (UNKNOWN, UNKNOWN, UNKNOWN)
    assert flight.inhibits == {"STOP_UNCERTAIN": None}
    flight.wait(60)
    assert flight.status[1:4] == (UNKNOWN, UNKNOWN, UNKNOWN)


def test_a_lost_answer_to_a_stop_does_not_leave_a_release() -> None:
    flight = stop(stop(driving(), LOW).send(ack()), HIGH)
    assert flight.status[1:4] == (UNKNOWN, UNKNOWN, UNKNOWN)


@pytest.mark.parametrize(("position", "kept"), [(HIGH, (FALSE, TRUE, TRUE)), (LOW, (TRUE, FALSE, FALSE))])
def test_a_refused_command_changes_nothing(position: int, kept: tuple[TriState, ...]) -> None:
    flight = stop(stop(driving(), LOW if position == HIGH else HIGH).send(ack()), position)
    assert flight.send(ack(result=DENIED)).status[1:4] == kept


@pytest.mark.parametrize(("autopilot", "stopped"), [(PX4, FALSE), (0, UNKNOWN)])
def test_the_function_numbers_are_those_of_ardupilot(autopilot: int, stopped: TriState) -> None:
    assert stop(driving(autopilot, QUAD)).send(ack()).status.e_stopped is stopped


def test_a_command_to_an_unknown_vehicle_changes_nothing() -> None:
    flight = Flight(streams=False)
    flight.send(command(AUX, ESTOP, HIGH), STATION).send(ack())
    assert flight.tracked is None


def test_a_reported_stop_ends_the_assumption_of_no_stop() -> None:
    flight = Flight(vehicle_type=ROVER, options=HardwareOptions(estop_assume_visible=True))
    flight.wait(6)
    flight.hb(armed=True, state=ACTIVE).wait(1)
    assert flight.status.e_stopped is FALSE
    assert stop(flight).send(ack()).status.e_stopped is TRUE


# -- termination -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vehicle", "codes"), [(PLANE, [1002]), (ROVER, [1002]), (QUAD, []), (SUB, [])]
)  # copters and subs only disarm and can arm again at once
def test_an_accepted_termination_counts_if_it_does_more_than_disarm(vehicle: int, codes: list[int]) -> None:
    flight = driving(vehicle=vehicle).send(command(TERMINATION, 1), STATION).send(ack(TERMINATION))
    assert flight.codes == codes
    assert (flight.status.e_stopped is TRUE) is bool(codes)


def test_a_termination_that_is_not_requested_or_not_accepted_is_ignored() -> None:
    flight = driving(vehicle=PLANE).send(command(TERMINATION, 0), STATION).send(ack(TERMINATION))
    flight.send(command(TERMINATION, math.nan), STATION).send(ack(TERMINATION))
    flight.send(command(TERMINATION, 1), STATION).send(ack(TERMINATION, UNSUPPORTED))
    assert (flight.codes, flight.status.mode) == ([], RobotMode.AUTO)


# -- the functions themselves ------------------------------------------------------------------------------------------


def test_only_relevant_commands_are_kept() -> None:
    now = Instant(100.0, 0)
    assert pending_command.asked(command(300, 1), STATION, NOTHING, now) is None
    kept = pending_command.asked(command(AUX, ESTOP, HIGH), STATION, NOTHING, now)
    assert kept is not None
    assert kept[:5] == (AUX, ESTOP, HIGH, STATION, 100.0)


def test_few_commands_are_remembered_and_none_for_long() -> None:
    pending = pending_command.NONE
    for at in (0.0, *[100.0] * 20):
        asked = pending_command.asked(command(AUX, ESTOP, HIGH), STATION, NOTHING, Instant(at, 0))
        assert asked is not None
        pending = pending_command.remembered(pending, asked)
    assert len(pending) == pending_command.MOST
    assert {one.at for one in pending} == {100.0}


def test_an_answer_without_a_command_is_ignored() -> None:
    assert pending_command.answered((), ack(), Instant(100.0, 0)) == (None, ())
