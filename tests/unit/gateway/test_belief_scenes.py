"""Who is believed: honest vehicles whose numbers, clocks or ports are unusual keep their status."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from fuzz.belief import quietly
from mav_robot_status.interface import TriState

from .belief_air import (
    AWAY,
    HEARTBEAT,
    HOME,
    REBOOT_WHILE_ARMED,
    Path,
    Port,
    Scene,
    Source,
    Vehicle,
    dropped,
    heard,
    held,
    is_conflict,
    is_safe,
    is_unknown,
    late,
    message_id,
    scattered,
)


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with quietly():
        yield


ARMINGS = (10.0, 17.0, 21.0, 28.0)
"""It is armed from the first to the second, and from the third to the fourth."""


def follows_the_armings(scene: Scene, vehicle: Vehicle, within: float) -> bool:
    """Whether the status follows each arming and disarming in so many seconds."""
    for number, at in enumerate(ARMINGS):
        scene.set(at, vehicle, armed=number % 2 == 0)
    scene.run(35.0)
    ends = *ARMINGS[1:], 35.0
    return all(
        scene.is_known(moment.at, armed=number % 2 == 0)
        for number, (at, end) in enumerate(zip(ARMINGS, ends, strict=True))
        for moment in scene.during(at + within, end)
    )


@pytest.mark.parametrize("rate", [64, 128, 256])
@pytest.mark.parametrize(
    "others",
    [
        pytest.param((), id="alone"),
        pytest.param((Path(fate=late(0.005)),), id="5 ms"),
        pytest.param((Path(AWAY, late(0.15)),), id="150 ms"),
        pytest.param((Path(AWAY, dropped(0.2, 1)),), id="dropped"),
    ],
)
def test_a_state_whose_number_comes_round_is_said_anew(rate: int, others: tuple[Path, ...]) -> None:
    scene = Scene()
    streams = {"heartbeat": 1.0, "sys_status": 1.0, "attitude": 1 / (rate - 6), "position": 0.25}
    vehicle = scene.add(Vehicle(heard(Path(), *others), streams=streams))
    assert follows_the_armings(scene, vehicle, 0.2)
    assert scene.seconds(is_unknown, 2.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0
    beats = {sent.data for sent in vehicle.sent if message_id(sent.data) == HEARTBEAT and sent.at >= 2.0}
    assert len(beats) <= 2 * 256 / rate  # armed and disarmed


@pytest.mark.parametrize("fate", [late(0.0), scattered(0.05, 1), dropped(0.3, 1)], ids=["good", "scattered", "dropped"])
def test_a_vehicle_that_has_one_number_for_ever(fate: Callable[[float, bytes], Iterator[float]]) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle((Port((Path(fate=fate),), step=0),)))
    assert follows_the_armings(scene, vehicle, 3.2)
    assert scene.seconds(is_unknown, 5.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0


@pytest.mark.parametrize("apart", [1, 10, 47, 49, 120])
@pytest.mark.parametrize("delay", [0.0, 0.003, 0.3])
def test_two_counts_of_one_vehicle_on_one_channel(apart: int, delay: float) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle((Port(), Port((Path(fate=late(delay)),), apart))))
    assert follows_the_armings(scene, vehicle, delay + 0.1)
    assert scene.seconds(is_unknown, 5.0) <= 4 * delay
    assert scene.seconds(is_conflict) == 0.0


def uneven(at: float) -> float:
    """Fast and slow in turns of 2 s, and never steady."""
    return (1.0 if at % 4.0 < 2.0 else 0.4) * (0.9 + 0.1 * math.sin(7.0 * at))


@pytest.mark.parametrize(
    "pace",
    [
        *(pytest.param(lambda at, rate=rate: rate, id=str(rate)) for rate in (0.3, 0.5, 0.8, 0.95)),
        pytest.param(uneven, id="uneven"),
        pytest.param(lambda at: 0.0 if at % 10.0 < 0.7 else 1.0, id="short pauses"),
        pytest.param(lambda at: 1.05, id="fast"),
    ],
)
def test_a_simulation_at_another_pace_is_not_late(pace: Callable[[float], float]) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(pace=pace))
    assert follows_the_armings(scene, vehicle, 3.4)
    assert scene.seconds(is_unknown, 5.0) == 0.0
    assert scene.seconds(lambda line: line.status.in_motion is not TriState.FALSE, 5.0) == 0.0


@pytest.mark.parametrize("pause", [2.0, 3.0, 6.0, 30.0])
def test_a_simulation_that_pauses_is_never_called_safe(pause: float) -> None:
    scene = Scene()
    scene.add(Vehicle(pace=lambda at: 0.0 if 10.0 <= at < 10.0 + pause else 1.0, armed=True))
    scene.run(40.0 + pause)
    assert scene.seconds(is_safe) == 0.0
    assert scene.seconds(is_conflict) == 0.0
    assert REBOOT_WHILE_ARMED not in {code for line in scene.lines for code in line.codes}
    assert all(line.connected for line in scene.during(12.0 + pause))


@pytest.mark.parametrize("until", [3.0, 8.0, 60.0])
def test_a_boot_clock_that_wraps_is_no_boot(until: float) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(clock=2**32 / 1000 - until))
    assert follows_the_armings(scene, vehicle, 0.1)
    assert scene.seconds(is_unknown, 2.0) == 0.0
    assert {code for line in scene.lines for code in line.codes} == set()


@pytest.mark.parametrize("source", [AWAY, HOME], ids=["two addresses", "one address"])
def test_a_second_port_that_is_7_seconds_late(source: Source) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle((Port(), Port((Path(source, late(7.5)),), 150))))
    scene.set(20.0, vehicle, armed=True)
    scene.set(40.0, vehicle, armed=False)
    scene.run(60.0)
    assert scene.seconds(is_safe, 20.0, 40.0) == 0.0
    assert scene.seconds(is_conflict) == 0.0
    assert scene.seconds(is_unknown, 2.0) <= 17.0
    assert scene.is_known(19.0, armed=False)
    assert scene.is_known(39.0, armed=True)
    assert scene.is_known(59.0, armed=False)


def test_a_burst_after_a_silence_is_as_old_as_it_is() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=held(10.0, 15.0)))))
    scene.set(13.5, vehicle, armed=True)
    scene.run(30.0)
    assert scene.seconds(is_safe, 15.0) == 0.0
    assert scene.seconds(is_unknown, 16.1) == 0.0
