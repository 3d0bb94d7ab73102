"""A status is derived only if it may have changed. The driver compares each handle with a newly derived status."""

from __future__ import annotations

from mav_robot_status.hardware.mavlink.facts import Deadline
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.subjects import facts_of
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from .driver import ACTIVE, FITTED, GYRO, PREARM, Flight, copter, px4
from .test_sequences import Outputs


def changes(flight: Flight, seconds: float) -> list[float]:
    """Seconds until the status or its detail changes."""
    start = flight.clock.now().mono
    found = []
    before = flight.look().status, flight.detail
    while flight.clock.now().mono < start + seconds:
        flight.wait(0.05)
        if (flight.status, flight.detail) != before:
            before = flight.status, flight.detail
            found.append(round(flight.clock.now().mono - start, 2))
    return found


def test_repeated_messages_need_no_new_status() -> None:
    flight = px4()
    flight.stream("local", lambda: mav.LocalPositionNed(flight.boot_ms, 0, 0, 0), hz=10)
    flight.wait(20)
    looks = [flight.vehicle.facts]
    for _ in range(100):  # 60 messages in five seconds
        flight.wait(0.05)
        if flight.vehicle.facts is not looks[-1]:
            looks.append(flight.vehicle.facts)
    assert len(looks) < 10


def test_the_next_change_is_the_earliest_possible_change() -> None:
    flight = copter(streams=False).hb()
    state, now = flight.vehicle.state, flight.clock.now().mono
    assert state is not None
    for timeout in (3.5, 0.5):
        moment = Deadline(now)
        facts_of(state, moment, HardwareOptions(heartbeat_timeout=timeout))
        assert now + timeout < moment.next < now + timeout + 1e-6


def test_a_text_that_stops_repeating_ends_on_time() -> None:
    flight = copter().set(health=FITTED)
    flight.wait(12)
    flight.text("PreArm: Motors Emergency Stopped", 2)
    assert flight.status.e_stopped is TriState.TRUE
    assert changes(flight, 40) == [35.0]


def test_a_slow_stream_is_stale_after_three_intervals() -> None:
    flight = copter().stop("sys_status").stream("sys_status", lambda: flight.sys_status(), hz=1 / 3)
    flight.wait(15)
    flight.stop("sys_status")
    assert flight.status.in_error is TriState.FALSE
    assert changes(flight, 12) == [9.05]


def test_a_fault_in_a_slow_stream_counts_after_its_time() -> None:
    flight = copter().stop("sys_status").stream("sys_status", lambda: flight.sys_status(), hz=0.5)
    flight.wait(16)
    flight.set(health=FITTED & ~GYRO | PREARM).send(flight.sys_status())
    flight.stop("sys_status")
    assert changes(flight, 3) == [1.5]


def test_faults_at_boot_count_after_the_grace_period() -> None:
    flight = copter().set(health=FITTED & ~GYRO | PREARM)
    flight.wait(3)
    assert flight.codes == []
    assert changes(flight, 9) == [7.0]
    assert flight.codes == [3000]


def test_faults_count_at_once_if_the_clock_shows_an_earlier_boot() -> None:
    flight = copter().set(health=FITTED & ~GYRO | PREARM)
    flight.wait(3)
    assert flight.send(flight.system_time()).codes == [3000]


def test_an_increasing_speed_ends_the_stop_shown_by_the_outputs_at_once() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.wait(3)
    outputs.set([1000] * 4, 100)
    flight.wait(3)
    stopped = flight.status
    assert stopped.e_stopped is TriState.TRUE
    flight.send(mav.VfrHud(0.0, 2.0, 100))
    assert flight.status.e_stopped is TriState.UNKNOWN
