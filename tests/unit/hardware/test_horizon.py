"""A status is derived anew only when it may have changed: the driver compares each handle with one of that moment."""

from __future__ import annotations

from mav_robot_status.hardware import horizon
from mav_robot_status.hardware.options import HardwareOptions
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from .driver import ACTIVE, FITTED, GYRO, PREARM, Flight, copter, px4
from .test_sequences import Outputs


def changes(flight: Flight, seconds: float) -> list[float]:
    """After how many seconds the status or its detail became another one."""
    start = flight.clock.now().mono
    found = []
    before = flight.look().status, flight.detail
    while flight.clock.now().mono < start + seconds:
        flight.wait(0.05)
        if (flight.status, flight.detail) != before:
            before = flight.status, flight.detail
            found.append(round(flight.clock.now().mono - start, 2))
    return found


def test_messages_that_repeat_themselves_need_no_new_status() -> None:
    flight = px4()
    flight.stream("local", lambda: mav.LocalPositionNed(flight.boot_ms, 0, 0, 0), hz=10)
    flight.wait(20)
    looks = [flight.vehicle.seen]
    for _ in range(100):  # in five seconds come 60 messages
        flight.wait(0.05)
        if flight.vehicle.seen is not looks[-1]:
            looks.append(flight.vehicle.seen)
    assert len(looks) < 10


def test_the_next_change_is_the_first_of_all_that_may_come() -> None:
    flight = copter(streams=False).hb()
    memory, now = flight.vehicle.memory, flight.clock.now().mono
    assert memory is not None
    assert now + 3.5 < horizon.next_change(memory, now, HardwareOptions()) < now + 3.5 + 1e-6
    assert now + 0.5 < horizon.next_change(memory, now, HardwareOptions(heartbeat_timeout=0.5)) < now + 0.5 + 1e-6


def test_a_text_that_is_repeated_no_more_is_over_on_time() -> None:
    flight = copter().set(health=FITTED)
    flight.wait(12)
    flight.text("PreArm: Motors Emergency Stopped", 2)
    assert flight.status.e_stopped is TriState.TRUE
    assert changes(flight, 40) == [35.0]


def test_a_slow_stream_is_too_old_after_three_of_its_intervals() -> None:
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


def test_faults_at_boot_count_when_the_grace_is_over() -> None:
    flight = copter().set(health=FITTED & ~GYRO | PREARM)
    flight.wait(3)
    assert flight.codes == []
    assert changes(flight, 9) == [7.0]
    assert flight.codes == [3000]


def test_faults_count_at_once_when_a_clock_tells_that_the_boot_was_long_ago() -> None:
    flight = copter().set(health=FITTED & ~GYRO | PREARM)
    flight.wait(3)
    assert flight.send(flight.system_time()).codes == [3000]


def test_a_speed_that_grows_ends_the_verdict_of_the_outputs_at_once() -> None:
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
