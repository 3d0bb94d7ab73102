"""Who is believed: cases in which a live vehicle was once called safe, or lost its status. Each has its bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path as File
from typing import Any

import pytest

from fuzz.air import packed
from fuzz.belief import quietly
from mav_robot_status.config import SigningConfig
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.signing import Signer

from .belief_air import (
    AWAY,
    HEARTBEAT,
    HOME,
    PRESSED,
    QUADROTOR,
    RELEASED,
    Path,
    Port,
    Scene,
    Source,
    Vehicle,
    again,
    cut,
    dropped,
    heard,
    is_conflict,
    is_safe,
    is_stopped,
    is_unknown,
    late,
    only,
    states,
)

KEY = bytes(range(32))
AUX_FUNCTION, MOTOR_STOP, HIGH = 218, 31.0, 2.0
GROUND = (255, 190)


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with quietly():
        yield


@pytest.fixture
def signing(tmp_path: File, monkeypatch: pytest.MonkeyPatch) -> SigningConfig:
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    key = tmp_path / "key"
    key.write_text(KEY.hex())
    key.chmod(0o600)
    return SigningConfig(str(key))


# -- says "safe" of a live vehicle -------------------------------------------------------------------------------------


def late_link() -> Scene:
    """B1. A queue of 7 s begins at 5 s."""
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=late(7.0, since=5.0)))))
    scene.set(14.5, vehicle, armed=True, speed=3.0)
    assert scene.run(5.0).is_known(4.9, armed=False)
    return scene.run(35.0)


def late_way(source: Source) -> Scene:
    """B2. Each frame is heard at once and 8 s late. The direct way dies 1.5 s after the arming."""
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((12.5, 99.0))), Path(source, late(8.0))), begin=0.6))
    scene.set(11.0, vehicle, armed=True)
    assert scene.run(12.0).is_known(10.9, armed=False)
    assert scene.is_known(11.9, armed=True)
    return scene.run(30.0)


def late_copy() -> Scene:
    """B3 a. The very datagram of a stop comes again after its release."""
    scene = Scene()
    vehicle = scene.add(Vehicle(armed=True))
    scene.at(10.0, lambda: scene.arrives(14.0, scene.say(vehicle, PRESSED)))
    scene.says(12.0, vehicle, RELEASED)
    assert is_stopped(scene.run(12.0).line(11.9))
    return scene.run(74.0)


def swapped() -> Scene:
    """B3 b. The stop was packed before its release, and arrives after it."""
    scene = Scene()
    vehicle = scene.add(Vehicle(armed=True))

    def swap() -> None:
        stop, release = (vehicle.ports[0].frame(said, (1, 1), 0) for said in (PRESSED, RELEASED))
        scene.arrives(12.0, release)
        scene.arrives(12.01, stop)

    scene.at(12.0, swap)
    return scene.run(74.0)


def late_words() -> Scene:
    """B3 c. The applet's words, and all else, come again 4.5 s late."""
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=again(4.5))), armed=True))
    scene.each(1.0, 6.0, 12.0, lambda: scene.say(vehicle, vehicle.applet(1)))
    scene.each(1.0, 12.0, 30.0, lambda: scene.say(vehicle, vehicle.applet(0)))
    assert is_stopped(scene.run(12.0).line(11.9))
    return scene.run(30.0)


def command(function: float, position: float) -> Any:
    return mav.CommandLong(function, position, 0.0, 0.0, 0.0, 0.0, 0.0, AUX_FUNCTION, 1, 1, 0)


def late_ack() -> Scene:
    """B4. The acknowledgement of another function comes again, after a stop that the vehicle did not hear."""
    scene = Scene()
    vehicle = scene.add(Vehicle(armed=True, speed=3.0))
    ground = scene.add(Vehicle(heard(Path(), number=30), ids=GROUND, streams={}))
    ack = mav.CommandAck(AUX_FUNCTION, 0, 0, 0, *GROUND)
    scene.says(10.0, ground, command(9.0, 0.0))
    scene.at(10.05, lambda: scene.arrives(13.5, scene.say(vehicle, ack)))
    scene.says(13.0, ground, command(MOTOR_STOP, HIGH))
    return scene.run(74.0)


def release_lost() -> Scene:
    """B5. A gap of 1.5 s swallows the release."""
    scene = Scene()
    streams = {**Vehicle().streams, "vfr_hud": 0.25}
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((11.0, 12.5)))), armed=True, streams=streams))
    scene.says(10.0, vehicle, PRESSED)
    scene.says(11.7, vehicle, RELEASED)
    assert is_stopped(scene.run(11.0).line(10.9))
    return scene.run(74.0)


def drives_off(numbered: bool) -> Scene:
    """B6. The release is lost, with or without a number, and the vehicle starts from rest."""
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((12.005, 12.015)))), armed=True))
    scene.says(10.0, vehicle, PRESSED)
    if numbered:
        scene.says(12.01, vehicle, RELEASED)
    scene.set(15.0, vehicle, speed=5.0)
    assert is_stopped(scene.run(15.0).line(14.9))
    return scene.run(75.0)


def satellite() -> Scene:
    """B7. HIGH_LATENCY2 at 0, 5 and 10 s, then nothing."""
    scene = Scene()
    vehicle = scene.add(Vehicle(streams={}))
    for at in (0.0, 5.0, 10.0):
        scene.says(at, vehicle, mav.HighLatency2(0, 0, 0, 0, 0, 10, 3, 0, 0, 0, 0, 81, 0, 0))
    assert scene.run(10.0).line(9.9).status.drives_powered is TriState.FALSE
    return scene.run(72.0)


def agrees_in_a_gap() -> Scene:
    """B8. A forger agrees, and goes on while the vehicle is silent."""
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((10.0, 12.2)))), armed=True))
    forger = scene.add(Vehicle(heard(Path(AWAY), number=77), armed=True, streams={"heartbeat": 0.25}, begin=5.0))
    scene.set(12.2, vehicle, speed=3.0)
    scene.says(16.0, forger, PRESSED)
    return scene.run(76.0)


def agrees_on_one_channel() -> Scene:
    """B9. Two armed vehicles on one radio, without clocks; the second one is stopped."""
    scene = Scene()
    scene.add(Vehicle(armed=True, streams=states()))
    second = scene.add(Vehicle(heard(Path(), number=120), armed=True, streams=states(), begin=0.5))
    scene.says(10.0, second, PRESSED)
    return scene.run(70.0)


def script_on_one_channel() -> Scene:
    """B9. A script with a count of its own says that the vehicle is stopped."""
    scene = Scene()
    scene.add(Vehicle(armed=True, speed=3.0))
    script = scene.add(Vehicle(heard(Path(), number=150), streams={}))
    scene.each(1.0, 8.0, 40.0, lambda: scene.say(script, script.applet(1)))
    return scene.run(45.0)


def one_count(armed_first: bool) -> Scene:
    """B10. An armed and a disarmed vehicle behind a bridge that packs anew. The second one comes at 10 s."""
    scene = Scene()
    bridge = heard(Path())
    scene.add(Vehicle(bridge, armed=armed_first, streams=states()))
    scene.add(Vehicle(bridge, armed=not armed_first, streams=states(), begin=10.5))
    scene.run(40.0)
    assert is_conflict(scene.line(20.0))
    return scene


def forged(places: int, source: Source = HOME) -> Callable[[], Scene]:
    """B10. Right after each HEARTBEAT another one says disarmed, so many numbers after the last one."""

    def scene() -> Scene:
        scene = Scene()
        vehicle = scene.add(Vehicle(armed=True))

        def forge() -> None:
            number = (vehicle.ports[0].number - 1 + places) & 255
            scene.arrives(scene.now, packed(Vehicle().heartbeat(), number), source)

        scene.each(1.0, 10.01, 40.0, forge)
        assert scene.run(10.0).is_known(9.9, armed=True)
        return scene.run(40.0)

    return scene


def broadcast() -> Scene:
    """B13. The vehicle that answered pauses, while another one speaks to the same port."""
    scene = Scene("udpbcast:127.255.255.255:14550")
    scene.add(Vehicle(heard(Path(fate=cut((10.0, 15.0)))), armed=True, speed=3.0))
    scene.add(Vehicle(heard(Path(AWAY)), clock=1000.0, begin=0.5))
    return scene.run(75.0)


def seldom() -> Scene:
    """B14. The disarmed one speaks each second, the armed one each 4.5 s."""
    scene = Scene()
    scene.add(Vehicle())
    scene.add(Vehicle(heard(Path(AWAY), number=99), armed=True, streams=states(4.5), begin=5.0))
    assert scene.run(5.0).is_known(4.9, armed=False)
    return scene.run(50.0)


@pytest.mark.parametrize(
    ("scene", "begin", "end", "most"),
    [
        pytest.param(late_link, 14.5, 35.0, 1.5, id="B1"),
        pytest.param(lambda: late_way(AWAY), 11.0, 30.0, 1.0, id="B2 two addresses"),
        pytest.param(lambda: late_way(HOME), 11.0, 30.0, 1.0, id="B2 one address"),
        pytest.param(late_copy, 12.0, 74.0, 0.5, id="B3 a"),
        pytest.param(swapped, 12.0, 74.0, 0.5, id="B3 b"),
        pytest.param(late_words, 12.0, 30.0, 0.5, id="B3 c"),
        pytest.param(late_ack, 10.0, 74.0, 0.3, id="B4"),
        pytest.param(release_lost, 17.5, 74.0, 0.0, id="B5"),
        pytest.param(lambda: drives_off(True), 23.0, 75.0, 0.0, id="B6 with a number"),
        pytest.param(lambda: drives_off(False), 23.0, 75.0, 0.0, id="B6 without a number"),
        pytest.param(satellite, 26.0, 72.0, 0.0, id="B7"),
        pytest.param(agrees_in_a_gap, 5.0, 76.0, 0.5, id="B8"),
        pytest.param(agrees_on_one_channel, 14.0, 70.0, 0.5, id="B9 two vehicles"),
        pytest.param(script_on_one_channel, 12.0, 45.0, 0.5, id="B9 a script"),
        pytest.param(lambda: one_count(True), 10.0, 40.0, 1.0, id="B10 armed first"),
        pytest.param(lambda: one_count(False), 10.5, 40.0, 1.0, id="B10 disarmed first"),
        pytest.param(forged(1), 10.0, 40.0, 1.0, id="B10 the next number"),
        pytest.param(forged(0), 10.0, 40.0, 0.0, id="the same number"),
        pytest.param(broadcast, 19.0, 75.0, 0.5, id="B13"),
        pytest.param(seldom, 5.0, 50.0, 1.0, id="B14"),
    ],
)
def test_a_live_vehicle_is_not_called_safe(scene: Callable[[], Scene], begin: float, end: float, most: float) -> None:
    assert scene().seconds(is_safe, begin, end) <= most


@pytest.mark.parametrize("seed", range(4))
def test_a_stop_that_was_said_once_ends_where_most_frames_are_lost(seed: int) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=dropped(0.6, seed))), armed=True))
    presses = [10.0 + 20.0 * number for number in range(6)]
    for at in presses:
        scene.says(at, vehicle, PRESSED)
        scene.says(at + 2.0, vehicle, RELEASED)
    scene.run(130.0)
    assert sum(scene.seconds(is_stopped, at + 7.0, at + 20.0) for at in presses) == 0.0  # B5


def test_a_stop_that_was_said_once_stays_while_the_vehicle_coasts() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(armed=True, speed=5.0))
    scene.says(10.0, vehicle, PRESSED)
    for step in range(1, 21):
        scene.set(10.0 + step / 4, vehicle, speed=5.0 - step / 4)
    scene.run(40.0)
    assert scene.seconds(is_stopped, 10.1, 40.0) > 29.8  # the other side of B6


@pytest.mark.parametrize("source", [AWAY, HOME], ids=["two addresses", "one address"])
@pytest.mark.parametrize(("dies", "lag"), [(99.0, 5.0), (99.0, 0.6), (12.5, 7.0), (12.5, 5.3)])
def test_a_signed_link_that_is_late_is_not_taken_for_the_latest(
    signing: SigningConfig, source: Source, dies: float, lag: float
) -> None:
    scene = Scene(signing=signing)
    direct = Port((Path(fate=cut((dies, 99.0))),), signer=Signer(KEY, 0))
    vehicle = scene.add(Vehicle((direct, Port((Path(source, late(lag)),), 50, signer=Signer(KEY, 1)))))
    scene.set(10.1, vehicle, armed=True)
    scene.run(30.0)
    assert scene.is_known(9.9, armed=False)
    assert scene.seconds(is_safe, 10.0, 30.0) <= 1.6  # B12


def test_signed_datagrams_that_were_heard_before_a_restart_are_no_news(signing: SigningConfig) -> None:
    scene = Scene(signing=signing)
    vehicle = scene.add(Vehicle((Port(signer=Signer(KEY, 0)),), end=8.0))
    scene.run(20.0)
    assert scene.is_known(7.9, armed=False)
    scene.restart()
    for sent in vehicle.sent:
        scene.arrives(sent.at + 21.0, sent.data, AWAY)
    scene.run(50.0)
    assert scene.seconds(is_safe, 20.0, 50.0) <= 1.0  # B17


def test_a_broadcast_link_hears_the_vehicle_that_answered_again() -> None:
    scene = Scene("udpbcast:127.255.255.255:14550")
    scene.add(Vehicle(heard(Path(fate=cut((10.0, 15.0)))), armed=True, speed=3.0))
    scene.add(Vehicle(heard(Path(AWAY)), ids=(2, 1), begin=0.5))
    scene.run(40.0)
    assert scene.seconds(is_unknown, 19.0, 40.0) == 0.0  # B13 with other ids


# -- takes a status away -----------------------------------------------------------------------------------------------


def test_a_thin_second_link_takes_nothing_away() -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(Path(fate=cut((10.0, 12.2))), Path(AWAY, only(HEARTBEAT))), armed=True))
    scene.says(30.0, vehicle, PRESSED)
    scene.run(32.0)
    before = scene.line(9.9).status
    assert before.in_motion is TriState.FALSE
    assert {line.status for line in scene.during(17.2, 30.0)} == {before}
    assert is_stopped(scene.line(30.2))  # T1


@pytest.mark.parametrize(
    "paths",
    [
        pytest.param((Path(), Path(AWAY, late(6.0))), id="T2"),
        pytest.param((Path(fate=again(4.5)),), id="T3"),
    ],
)
def test_a_link_that_repeats_all_of_it_late_is_no_conflict(paths: tuple[Path, ...]) -> None:
    scene = Scene()
    vehicle = scene.add(Vehicle(heard(*paths)))
    scene.set(15.0, vehicle, armed=True)
    scene.run(45.0)
    assert scene.is_known(44.0, armed=True)
    assert scene.seconds(is_safe, 15.0) <= 1.0
    assert scene.seconds(is_conflict) == 0.0
    assert scene.seconds(is_unknown, 2.0) <= 7.0


@pytest.mark.parametrize(
    ("claim", "times"),
    [
        pytest.param(Vehicle(kind=QUADROTOR), (10.3, 18.3, 26.3), id="T4"),
        pytest.param(Vehicle(), (10.3, 18.3, 26.3), id="disarmed"),
        pytest.param(Vehicle(kind=QUADROTOR, armed=True), (10.3,), id="armed"),
    ],
)
def test_one_datagram_takes_a_status_away_for_4_seconds_at_most(claim: Vehicle, times: tuple[float, ...]) -> None:
    scene = Scene()
    scene.add(Vehicle(armed=True))
    for number, at in enumerate(times):
        scene.arrives(at, packed(claim.heartbeat(), 80 + number), AWAY)
    scene.run(36.0)
    assert scene.seconds(is_conflict) == 0.0
    assert scene.seconds(is_safe) == 0.0
    for at in times:
        assert scene.seconds(is_unknown, at + 4.1, at + 8.0) == 0.0  # T4


@pytest.mark.parametrize("number", [70, 254])
def test_each_vehicle_of_a_fleet_on_one_port_has_a_status(number: int) -> None:
    scene = Scene()
    for system in range(1, number + 1):
        path = Path((f"10.0.1.{system}", 14550))
        scene.add(Vehicle(heard(path), ids=(system, 1), streams=states(), begin=system / number))
    scene.run(10.0)
    assert len(scene.systems) == number  # T6
