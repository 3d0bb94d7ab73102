"""Who is believed: attacks and bad links that never made a live vehicle safe, nor took its status away."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from fuzz.air import packed
from fuzz.belief import quietly
from mav_robot_status.config import SigningConfig, VehicleConfig
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.signing import Signer

from .belief_air import (
    AWAY,
    HEALTHY,
    HOME,
    PRESSED,
    REBOOT_WHILE_ARMED,
    Line,
    Path,
    Port,
    Scene,
    Source,
    Vehicle,
    again,
    cut,
    heard,
    is_conflict,
    is_safe,
    is_stopped,
    is_unknown,
    late,
    scattered,
    states,
)
from .test_belief_cases import KEY, signing

__all__ = ["signing"]

MOTOR_OUTPUTS = 0x8000
WRAP = 2**32 / 1000


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with quietly():
        yield


def toggled(scene: Scene, vehicle: Vehicle, times: list[float]) -> float:
    """The vehicle arms, disarms, arms ... at these times. For how long it was called safe while it was armed."""
    for number, at in enumerate(times):
        scene.set(at, vehicle, armed=number % 2 == 0)
    scene.run(times[-1] + 3.0)
    return sum(scene.seconds(is_safe, at + 0.35, until) for at, until in zip(times[::2], times[1::2], strict=True))


def test_the_boot_clock_wraps() -> None:
    scene = Scene()
    scene.add(Vehicle(clock=WRAP - 10.0, armed=True))
    scene.run(30.0)
    assert scene.seconds(is_unknown, 2.0) == 0.0
    assert {code for line in scene.lines for code in line.codes} == set()


def test_a_system_time_that_jumps_on_the_vehicles_channel() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(armed=True))
    clocks = iter(1000 * (5_000 + 15_000 * (number % 2)) for number in range(1000))
    scene.each(1 / 3, 10.0, 40.0, lambda: scene.say(vehicle, mav.SystemTime(0, next(clocks))))
    scene.run(40.0)
    assert scene.seconds(is_safe) == 0.0
    assert scene.seconds(is_unknown, 1.0, 10.0) == 0.0


@pytest.mark.parametrize("source", [AWAY, HOME], ids=["two addresses", "one address"])
@pytest.mark.parametrize("was_heard", [True, False])
def test_a_replay_of_the_disarmed_vehicle_at_ten_times_its_rate(source: Source, was_heard: bool) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle((Port((Path(fate=cut((0.0, 0.0 if was_heard else 110.0), (113.0, 115.5))),)),)))
    scene.set(105.0, vehicle, armed=True)
    scene.run(100.0)
    for sent in vehicle.sent:
        scene.arrives(112.0 + sent.at / 10, sent.data, source)
    scene.run(130.0)
    assert scene.seconds(is_safe, 111.0) == 0.0


def test_high_latency_of_another_address() -> None:
    scene = Scene()
    scene.add(Vehicle(heard(Path(fate=cut((15.0, 20.0)))), armed=True))
    other = scene.add(Vehicle(heard(Path(AWAY)), streams={}))
    said = mav.HighLatency2(0, 0, 0, 0, 0, 10, 3, 0, 0, 0, 0, 81, 0, 0)
    scene.each(0.5, 5.0, 30.0, lambda: scene.say(other, said))
    scene.run(35.0)
    assert scene.seconds(is_safe) == 0.0


def test_a_companion_that_announces_a_disarmed_autopilot_first() -> None:
    scene = Scene(vehicles=(VehicleConfig(system=1),))
    scene.add(Vehicle(ids=(1, 191), streams=states()))
    scene.add(Vehicle(heard(Path(AWAY)), armed=True, begin=5.0))
    scene.run(30.0)
    assert scene.seconds(is_safe, 5.1) == 0.0


def test_words_of_another_address_without_heartbeats_change_nothing() -> None:
    def scene(others: bool) -> Scene:
        scene = Scene()
        scene.add(Vehicle(armed=True, speed=3.0))
        script = scene.add(Vehicle(heard(Path(AWAY), number=90), streams={}))
        if others:
            scene.says(10.0, script, PRESSED)
            scene.each(1.0, 12.0, 25.0, lambda: scene.say(script, script.applet(1)))
        return scene.run(30.0)

    assert scene(True).said() == scene(False).said()


@pytest.mark.parametrize("fate", [again(0.15), scattered(0.3, 1), scattered(0.3, 2)], ids=["twice", "scattered", "2"])
def test_copies_and_disorder_take_nothing_away(fate: Any) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=fate))))
    assert toggled(scene, vehicle, [10.0, 17.0, 20.0, 23.0, 28.0, 33.0]) == 0.0
    assert scene.seconds(is_unknown, 2.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0


@pytest.mark.parametrize("links", [1, 2])
def test_two_links_that_drop_out_in_turns(links: int) -> None:
    scene = Scene(*(f"udpin:127.0.0.1:{number}" for number in range(1, 1 + links)))
    first = cut(*((9.0 + 6.0 * number, 10.0 + 6.0 * number + number % 3) for number in range(12)))
    gaps = ((12.5 + 6.0 * number, 13.5 + 6.0 * number + number % 2) for number in range(12))
    second = cut(*gaps, rest=late(0.05))
    vehicle = scene.add(Vehicle(heard(Path(fate=first), Path(AWAY, second, links - 1))))
    assert toggled(scene, vehicle, [10.0 + 4.0 * number for number in range(16)]) == 0.0
    assert scene.seconds(is_unknown, 2.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0


@pytest.mark.parametrize("source", [AWAY, HOME], ids=["two addresses", "one address"])
def test_unsigned_heartbeats_among_signed_ones(signing: SigningConfig, source: Source) -> None:
    scene = Scene(signing=signing)
    scene.add(Vehicle((Port((Path(fate=cut((15.0, 18.0))),), signer=Signer(KEY, 0)),), armed=True))
    numbers = iter(range(10_000))
    scene.each(
        0.1, 5.0, 30.0, lambda: scene.arrives(scene.now, packed(Vehicle().heartbeat(), next(numbers) & 255), source)
    )
    scene.run(35.0)
    assert scene.seconds(is_safe) == 0.0
    assert scene.seconds(is_unknown, 1.0) <= 0.5  # the HEARTBEATs of the vehicle are 4 s apart once


def test_a_safety_switch_that_was_shown_before_the_arming() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(enabled=HEALTHY & ~MOTOR_OUTPUTS, streams={**Vehicle().streams, "sys_status": 3.0}))
    scene.set(13.5, vehicle, enabled=HEALTHY, armed=True)
    scene.run(30.0)
    assert is_stopped(scene.line(13.4))
    assert scene.seconds(is_safe, 14.0) == 0.0


@pytest.mark.parametrize("stopped", [True, False])
@pytest.mark.parametrize(
    ("number", "most"), [(230, 0.0), (120, 1.0), (None, 1.0)], ids=["far numbers", "near numbers", "common numbers"]
)
def test_two_vehicles_with_clocks_on_one_channel(number: int | None, most: float, stopped: bool) -> None:
    scene = Scene()
    first = scene.add(Vehicle(armed=True))
    ports = first.ports if number is None else heard(Path(), number=number)
    second = scene.add(Vehicle(ports, clock=5000.0, armed=stopped, begin=10.5))
    if stopped:
        scene.says(12.3, second, PRESSED)
    scene.run(40.0)
    assert scene.seconds(is_safe) <= most
    assert is_conflict(scene.line(25.0))


def test_the_target_of_a_link_wins_back() -> None:
    scene = Scene("udpout:10.0.0.5:14550")
    scene.add(Vehicle(heard(Path(fate=cut((10.0, 15.0)))), armed=True))
    scene.add(Vehicle(heard(Path((HOME[0], 4555)), number=99), begin=5.3))
    scene.run(40.0)
    assert scene.seconds(is_safe, 0.0, 13.5) == 0.0
    assert scene.seconds(is_safe, 15.1) == 0.0
    assert scene.is_known(39.0, armed=True)


def test_64_senders_of_other_ids_come_first() -> None:
    scene = Scene(vehicles=(VehicleConfig(system=1),))
    for system in range(2, 66):
        scene.add(Vehicle(heard(Path((f"10.0.1.{system}", 14550))), ids=(system, 1), streams=states()))
    scene.add(Vehicle(begin=10.0))
    scene.run(15.0)
    assert scene.systems[1, 1] <= 11.0


# -- what is said of speakers that differ, and of late ones ------------------------------------------------------------


def is_undecided(line: Line) -> bool:
    """Whether nothing is said that rests on the HEARTBEAT, although the link is connected."""
    mode, stopped, powered, possible = line.status[:4]
    return line.connected and {int(mode), int(stopped), int(powered), int(possible)} == {-1}


def test_frames_without_heartbeats_keep_a_link_connected_and_its_motion_known() -> None:
    def fate(at: float, data: bytes) -> tuple[float, ...]:
        return () if 10.0 <= at < 30.0 and data[7] == 0 else (at,)

    scene = Scene()
    scene.add(Vehicle(heard(Path(fate=fate)), armed=True, speed=3.0))
    scene.run(33.0)
    late = scene.during(13.0, 30.0)
    assert all(is_undecided(line) for line in late)
    assert {tuple(line.inhibits) for line in late} == {("HEARTBEAT_LATE",)}
    assert {line.status.in_motion for line in late} == {TriState.TRUE}
    assert {line.status.in_error for line in late} == {TriState.FALSE}
    assert scene.seconds(is_unknown, 30.1) == 0.0


def test_a_radio_that_falls_4_seconds_behind_is_connected_and_undecided() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=late(4.0, since=10.0)))))
    scene.set(20.0, vehicle, armed=True)
    scene.run(40.0)
    assert all(is_undecided(line) for line in scene.during(15.0))


def test_after_a_loss_only_a_heartbeat_brings_the_link_back() -> None:
    def fate(at: float, data: bytes) -> tuple[float, ...]:
        return () if 10.0 <= at < (20.0 if data[7] == 0 else 15.0) else (at,)

    scene = Scene()
    scene.add(Vehicle(heard(Path(fate=fate)), armed=True))
    scene.run(25.0)
    assert not any(line.connected for line in scene.during(13.6, 20.0))
    assert scene.seconds(is_unknown, 20.1) == 0.0


def test_when_a_speaker_is_lost_the_status_is_that_of_the_other() -> None:
    scene = Scene()
    scene.add(Vehicle(armed=True, end=20.0))
    scene.add(Vehicle(heard(Path(AWAY)), clock=5000.0, begin=5.5))
    scene.run(50.0)
    assert scene.seconds(is_safe, 6.0, 20.0) == 0.0
    assert scene.is_known(36.0, armed=False)
    assert scene.seconds(is_unknown, 36.0) == 0.0


def test_two_that_differ_for_5_seconds_are_a_conflict_for_10() -> None:
    scene = Scene()
    scene.add(Vehicle(armed=True))
    scene.add(Vehicle(heard(Path(AWAY)), clock=5000.0, begin=10.5, end=20.0))
    scene.run(45.0)
    told = [line.at for line in scene.lines if is_conflict(line)]
    assert 15.0 <= told[0] <= 17.0
    assert 28.0 <= told[-1] <= 32.0
    assert len(told) == round((told[-1] - told[0]) * 20) + 1
    assert scene.seconds(is_safe) == 0.0
    assert scene.is_known(36.0, armed=True)


@pytest.mark.parametrize("delay", [0.005, 0.15])
@pytest.mark.parametrize(
    ("source", "link"), [(HOME, 0), (AWAY, 0), (AWAY, 1)], ids=["one address", "two addresses", "two links"]
)
def test_exact_copies_cost_nothing(delay: float, source: Source, link: int) -> None:
    def scene(*copies: Path) -> list[tuple[Any, ...]]:
        scene = Scene("udpin:127.0.0.1:1", "udpin:127.0.0.1:2")
        vehicle = scene.add(Vehicle(heard(Path(fate=cut((31.0, 33.2), (40.0, 45.0))), *copies)))
        for at, values in ((5.3, True), (12.3, False), (14.3, True), (50.3, False), (52.3, True)):
            scene.set(at, vehicle, armed=values)
        scene.set(16.0, vehicle, speed=2.0)
        scene.set(36.0, vehicle, speed=0.0)
        scene.says(20.1, vehicle, PRESSED)
        scene.says(24.1, vehicle, mav.Statustext(6, b"RC7: MotorEStop LOW", 0, 0))
        scene.says(38.1, vehicle, PRESSED)
        return scene.run(60.0).said()

    gaps = cut((31.0, 33.2), (40.0, 45.0), rest=late(delay))
    assert scene(Path(source, gaps, link)) == scene()


@pytest.mark.parametrize("silence", [0.0, 2.0, 8.0])
def test_a_reboot_while_armed_is_told(silence: float) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((10.0, 10.0 + silence)))), armed=True))
    scene.at(10.0, lambda: vehicle.boot())
    scene.set(10.0, vehicle, armed=False)
    scene.run(30.0)
    assert REBOOT_WHILE_ARMED in {code for line in scene.lines for code in line.codes}
    assert scene.is_known(25.0, armed=False)
    assert scene.seconds(is_unknown, 25.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0
