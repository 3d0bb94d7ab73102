"""Faulty batteries and ESCs are errors; a Remote ID transmitter that is not ready is a reason not to arm."""

from __future__ import annotations

from struct import pack

import pytest

from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import ACTIVE, CRITICAL, FITTED, PREARM, STANDBY, Flight, copter, px4

OK, LOW, CRITICALLY_LOW, EMERGENCY, FAILED, UNHEALTHY, CHARGING = range(1, 8)
TRANSMITTER = (1, 236)


def ready(flight: Flight | None = None) -> Flight:
    """A disarmed vehicle some time after its boot."""
    flight = flight or copter()
    flight.wait(12)
    return flight


def battery(flight: Flight, charge: int = OK, faults: int = 0, number: int = 0) -> Flight:
    return flight.stream(f"battery {number}", lambda: mav.BatteryStatus(number, charge, faults), hz=0.5)


def esc(flight: Flight, *flags: int, index: int = 0, count: int = 4, info: int = 15) -> Flight:
    return flight.stream("esc", lambda: mav.EscInfo(pack("<4H", *flags), index, count, info))


def texts(flight: Flight) -> list[tuple[int, str | None]]:
    return [(error.code, error.text) for error in flight.detail.errors]


@pytest.mark.parametrize("charge", [0, OK, LOW, CHARGING, 8, 255])
def test_a_battery_that_is_not_faulty_is_no_error(charge: int) -> None:
    flight = battery(ready(), charge)
    assert {status.in_error for status in flight.wait(30)} == {TriState.FALSE}
    assert flight.vehicle.state is not None
    assert flight.vehicle.state.faulty_parts == {}


@pytest.mark.parametrize(
    ("charge", "faults", "expected"),
    [
        (OK, 16, (2014, "battery 2: over-temperature")),
        (OK, 1 | 4, (2014, "battery 2: deep discharge, failed cell")),
        (OK, 0x10002, (2014, "battery 2: voltage spikes, fault 0x10000")),
        (UNHEALTHY, 0, (2014, "battery 2: unhealthy")),
        (UNHEALTHY, 16, (2014, "battery 2: over-temperature")),
        (FAILED, 0, (2014, "battery 2: failed")),
        (CRITICALLY_LOW, 0, (2004, "battery 2: charge critical")),
        (EMERGENCY, 0, (2004, "battery 2: charge so low that damage is possible")),
    ],
)
def test_a_faulty_battery_is_an_error_with_its_words(charge: int, faults: int, expected: tuple[int, str]) -> None:
    flight = battery(ready(), charge, faults, number=1)
    flight.wait(3)
    assert texts(flight) == [expected]
    assert flight.status.in_error is TriState.TRUE


def test_one_report_is_no_error_and_the_second_is() -> None:
    """Recorded: a healthy battery is UNHEALTHY in its first message."""
    flight = ready()
    sent_us = flight.clock.now().unix_us
    flight.send(mav.BatteryStatus(0, UNHEALTHY, 0)).wait(2)
    assert flight.codes == []
    flight.send(mav.BatteryStatus(0, UNHEALTHY, 0))
    assert flight.codes == [2014]
    assert flight.detail.errors[0].since_us == sent_us
    flight.send(mav.BatteryStatus(0, OK, 0))
    assert flight.codes == []


def test_a_fault_that_is_no_longer_reported_is_no_longer_known() -> None:
    flight = battery(ready(), faults=16)
    flight.wait(3)
    flight.stop("battery 0").wait(9)
    assert flight.codes == [2014]
    flight.wait(3)
    assert flight.codes == []


def test_the_faults_of_two_batteries_are_one_error_and_end_one_by_one() -> None:
    flight = battery(battery(ready(), faults=16), faults=8, number=1)
    flight.wait(4)
    assert texts(flight) == [(2014, "battery 1: over-temperature; battery 2: over-current")]
    battery(flight, number=0).wait(3)
    assert texts(flight) == [(2014, "battery 2: over-current")]


def test_the_words_of_the_autopilot_about_an_empty_battery_are_preferred() -> None:
    flight = battery(ready().hb(armed=True, state=ACTIVE), CRITICALLY_LOW)
    flight.text("Battery 1 is critical 9.80V used 1500 mAh").wait(4)
    assert texts(flight) == [(2004, "Battery 1 is critical 9.80V used 1500 mAh")]


def test_an_empty_battery_names_the_failsafe() -> None:
    flight = battery(ready(px4()).hb(armed=True, state=ACTIVE), CRITICALLY_LOW)
    flight.wait(4)
    flight.hb(state=CRITICAL).wait(4)
    assert flight.codes == [2004]


def test_faults_of_the_boot_are_not_counted() -> None:
    flight = battery(copter().reboot(), faults=16)
    flight.send(flight.system_time()).wait(8)
    assert flight.codes == []
    flight.wait(3)
    assert flight.codes == [2014]


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (1, "ESC 2: over-current"),
        (4 | 32, "ESC 2: over-temperature, motor stuck"),
        (64, "ESC 2: failure"),
    ],
)
def test_a_faulty_esc_is_an_error_with_its_words(flags: int, expected: str) -> None:
    flight = esc(ready(px4()), 0, flags, 0, 0)
    flight.wait(3)
    assert texts(flight) == [(4007, expected)]
    esc(flight, 0, 0, 0, 0).wait(2)
    assert flight.codes == []


def test_the_fifth_esc_is_in_the_second_message() -> None:
    for info in (1, 1 << 4):  # a bit for each ESC of the message, or of the vehicle
        flight = esc(ready(px4()), 32, 0, 0, 0, index=4, count=6, info=info)
        flight.wait(3)
        assert texts(flight) == [(4007, "ESC 5: motor stuck")]


@pytest.mark.parametrize(
    ("flags", "count", "info"),
    [
        ((0, 32, 0, 0), 4, 0b1101),  # offline
        ((0, 0, 0, 32), 3, 15),  # not there
        ((0x180, 0, 0, 0), 4, 15),  # PX4's warnings of a temperature
    ],
)
def test_an_esc_that_is_offline_or_only_warns_is_no_error(flags: tuple[int, ...], count: int, info: int) -> None:
    flight = esc(ready(px4()), *flags, count=count, info=info)
    flight.wait(5)
    assert flight.codes == []


def test_an_error_of_a_part_leaves_all_other_fields_alone() -> None:
    flight = ready(copter()).hb(armed=True, state=ACTIVE)
    flight.wait(3)
    before = flight.status
    battery(flight, FAILED, 0x1FF)
    esc(flight, 127, 127, 127, 127).wait(5)
    assert flight.status == before._replace(in_error=TriState.TRUE, error_code=4007)
    assert flight.codes == [4007, 2014]


# -- Remote ID ---------------------------------------------------------------------------------------------------------


def arm_status(status: int, error: bytes = b"") -> mav.OpenDroneIdArmStatus:
    return mav.OpenDroneIdArmStatus(status, error)


def reasons(flight: Flight) -> list[str | None]:
    return [inhibit.text for inhibit in flight.detail.inhibits if inhibit.name == "PREARM_FAILING"]


def unchecked() -> Flight:
    """An autopilot that does not report its checks."""
    flight = copter().set(enabled=FITTED)
    flight.wait(12)
    return flight


@pytest.mark.parametrize("sender", [(1, 1), TRANSMITTER, (1, 237), (1, 238)])
def test_a_transmitter_that_is_not_ready_is_a_reason_not_to_arm(sender: tuple[int, int]) -> None:
    flight = unchecked().send(arm_status(1, b"no operator location"), sender)
    number = {237: " 2", 238: " 3"}.get(sender[1], "")
    assert reasons(flight) == [f"remote ID{number}: no operator location"]
    flight.send(arm_status(0), sender)
    assert reasons(flight) == []


def test_it_is_listed_beside_the_reasons_of_the_autopilot() -> None:
    flight = copter().set(health=FITTED)
    flight.wait(12)
    flight.send(arm_status(1), TRANSMITTER).text("PreArm: GPS 1: Bad fix", 2)
    assert reasons(flight) == ["PreArm: GPS 1: Bad fix", "remote ID: not ready to arm"]


def test_an_autopilot_whose_checks_pass_can_be_armed_whatever_the_transmitter_says() -> None:
    flight = ready().send(arm_status(1, b"no fix"), TRANSMITTER)
    assert reasons(flight) == []
    assert flight.set(health=FITTED & ~PREARM).wait(2)
    assert reasons(flight) == ["remote ID: no fix"]


def test_it_ends_with_silence_and_with_arming() -> None:
    flight = unchecked().send(arm_status(1, b"no fix"), TRANSMITTER)
    flight.hb(armed=True, state=ACTIVE)
    assert reasons(flight) == []
    flight.hb(armed=False, state=STANDBY)
    assert reasons(flight) == ["remote ID: no fix"]
    flight.wait(11)
    assert reasons(flight) == []


@pytest.mark.parametrize("sender", [(2, 236), (1, 190), (255, 190), (1, 235)])
def test_nobody_else_speaks_for_the_transmitter(sender: tuple[int, int]) -> None:
    assert reasons(unchecked().send(arm_status(1, b"no fix"), sender)) == []


def test_a_transmitter_without_a_vehicle_is_ignored() -> None:
    flight = Flight(streams=False).send(arm_status(1), TRANSMITTER)
    assert flight.tracked is None
