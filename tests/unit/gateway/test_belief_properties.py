"""Two senders with one id, in every order that hypothesis finds: a live robot is never called safe.

`TwoSenders` takes single steps, in any order. `Script` is a whole scene of an honest vehicle and a stranger, with links
that lose, delay and repeat; it also shows that the status comes back when the stranger ends.
"""

from __future__ import annotations

import logging
from typing import NamedTuple

import pytest
from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from fuzz import belief
from fuzz.belief import FATES, OTHER, PAUSES, TRUE_ONE, UnsafeError, World
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink.definitions import Heartbeat

from .belief_air import (
    AWAY,
    HEARTBEAT,
    HOME,
    NEARLY,
    PRESSED,
    QUADROTOR,
    RELEASED,
    ROVER,
    THIRD,
    Fate,
    Path,
    Port,
    Scene,
    Source,
    Vehicle,
    again,
    at_once,
    cut,
    dropped,
    heard,
    is_safe,
    late,
    only,
    scattered,
    states,
)

SENDERS = st.sampled_from((TRUE_ONE, OTHER))
SENT_AS = st.sampled_from(sorted(set(FATES)))


class TwoSenders(RuleBasedStateMachine):
    """The steps of `World`; its oracle is the invariant."""

    @initialize()
    def begin(self) -> None:
        logging.disable(logging.WARNING)
        self.world = World()

    @rule(seconds=st.sampled_from(PAUSES))
    def wait(self, seconds: float) -> None:
        self.world.wait(seconds)

    @rule(who=SENDERS, fate=SENT_AS)
    def beat(self, who: int, fate: str) -> None:
        self.world.beat(who, fate)

    @rule(who=SENDERS, fate=SENT_AS)
    def stream(self, who: int, fate: str) -> None:
        self.world.stream(who, fate)

    @rule(who=SENDERS, count=st.integers(1, 60))
    def chatter(self, who: int, count: int) -> None:
        self.world.chatter(who, count)

    @rule(who=SENDERS, armed=st.booleans())
    def arm(self, who: int, armed: bool) -> None:
        self.world.arm(who, armed)

    @rule(who=SENDERS, mode=st.sampled_from((3, 5)))
    def change_mode(self, who: int, mode: int) -> None:
        self.world.change_mode(who, mode)

    @rule(who=SENDERS, place=st.integers(0, 3), forked=st.booleans())
    def move(self, who: int, place: int, forked: bool) -> None:
        self.world.move(who, place, forked)

    @rule(who=SENDERS)
    def reboot(self, who: int) -> None:
        self.world.reboot(who)

    @rule(kind=st.integers(0, 1), age=st.sampled_from((5.0, 5000.0)))
    def exchange(self, kind: int, age: float) -> None:
        self.world.exchange(kind, age)

    @rule(kind=st.integers(0, 1))
    def copy(self, kind: int) -> None:
        self.world.copy(kind)

    @rule()
    def restart(self) -> None:
        self.world.restart()

    @invariant()
    def a_live_robot_is_not_called_safe(self) -> None:
        self.world.check()

    def teardown(self) -> None:
        logging.disable(logging.NOTSET)


TwoSenders.TestCase.settings = settings(max_examples=60, stateful_step_count=40, deadline=None, derandomize=True)
test_a_live_robot_is_never_called_safe_whatever_two_senders_do = TwoSenders.TestCase


def test_random_steps_find_no_unsafe_status_and_the_same_seed_takes_the_same_steps() -> None:
    assert belief.run(4000, seed=7) is None


class Bridge(World):
    """Both senders behind a bridge: one address, one count. No gateway can tell them apart in time."""

    def _count(self, sender: belief.Sender, way: Source) -> int:
        return super()._count(self.senders[TRUE_ONE], belief.SHARED)

    def _arrive(self, said: belief.Said) -> None:
        super()._arrive(said._replace(way=belief.SHARED))


def test_the_simulation_finds_an_unsafe_status() -> None:
    found = belief.run(20_000, seed=1, world_type=Bridge)
    assert found is not None
    assert "world = Bridge()" in found


def test_a_finding_can_be_replayed_step_by_step() -> None:
    world = World()
    with belief.quietly():
        for name, arguments in (("beat", (TRUE_ONE, "arrives")), ("wait", (0.1,)), ("restart", ())):
            getattr(world, name)(*arguments)
        world.hardware.vehicles.forget()
        world._armed_at = world.now.mono
        world.arm(TRUE_ONE, False)
        world.beat(TRUE_ONE, "arrives")
        world._armed_at = world.now.mono  # as if another one were armed
        with pytest.raises(UnsafeError, match="armed heartbeat"):
            world.check()


# -- whole scenes ------------------------------------------------------------------------------------------------------

BEGINS, ENDS = 8.0, 24.0
"""When a stranger may speak."""
BACK = 12.0
"""Seconds after which nothing is left of a stranger."""
UNSURE = 8.0
"""Seconds after a release, which may be lost, in which a stop may still be told."""
FATES_OF_PATHS: dict[str, Fate] = {
    "direct": at_once,
    "5 ms": late(0.005),
    "150 ms": late(0.15),
    "6 s": late(6.0),
    "7 s from 12 s on": late(7.0, since=12.0),
    "scattered": scattered(0.3, 1),
    "again after 10 ms": again(0.01),
    "again after 4.5 s": again(4.5),
    "HEARTBEATs only": only(HEARTBEAT),
}
TIMES = st.integers(0, 300).map(lambda tenths: tenths / 10)


class Stranger(NamedTuple):
    """Who else speaks with the ids."""

    source: Source
    begin: float
    length: float
    kind: int
    armed: bool
    clock: float | None
    """None: it sends HEARTBEAT and SYS_STATUS only."""
    turns: list[float]
    """When it arms and disarms."""
    stop: float
    """When it says that it is stopped."""


class Script(NamedTuple):
    """What the honest vehicle does, and what becomes of its frames."""

    fates: list[str]
    """Of the ways on which it is heard."""
    lost: float
    gaps: list[tuple[float, float]]
    """When a silence of all ways begins, and for how long."""
    armed: bool
    turns: list[float]
    boots: list[tuple[float, float]]
    """When it boots, or another vehicle takes its place, and the boot clock then."""
    stops: list[tuple[float, float]]
    """When it is stopped, and for how long."""
    stranger: Stranger


GAPS = st.lists(st.tuples(TIMES, st.sampled_from((0.6, 1.2, 2.2, 5.0))), max_size=2)
STRANGERS = st.builds(
    Stranger,
    st.sampled_from((AWAY, HOME)),
    st.integers(80, 200).map(lambda tenths: tenths / 10),
    st.sampled_from((0.5, 2.0, 4.0, 7.0, 16.0)),
    st.sampled_from((ROVER, ROVER, ROVER, QUADROTOR)),
    st.booleans(),
    st.sampled_from((None, 40.0, 900.0, 5000.0)),
    st.lists(TIMES, max_size=3),
    TIMES,
)
SCRIPTS = st.builds(
    Script,
    st.lists(st.sampled_from(sorted(FATES_OF_PATHS)), max_size=2).map(lambda others: ["direct", *others]),
    st.sampled_from((0.0, 0.0, 0.1, 0.3)),
    GAPS,
    st.booleans(),
    st.lists(TIMES, max_size=4),
    st.lists(st.tuples(TIMES, st.sampled_from((0.0, 500.0))), max_size=1),
    st.lists(st.tuples(TIMES, st.sampled_from((1.0, 4.0))), max_size=1),
    STRANGERS,
)


def play(script: Script, *, alone: bool) -> tuple[Scene, Vehicle]:
    """The scene of a script, until all that the stranger changed has to be over."""
    scene = Scene()
    gaps = [(begin, begin + length) for begin, length in script.gaps]
    paths = [
        Path(source, cut(*gaps, rest=dropped(script.lost, place, rest=FATES_OF_PATHS[name])))
        for place, (source, name) in enumerate(zip((HOME, THIRD, HOME), script.fates, strict=False))
    ]
    vehicle = scene.add(Vehicle(heard(*paths), armed=script.armed))
    for number, at in enumerate(sorted(script.turns)):
        scene.set(at, vehicle, armed=script.armed is (number % 2 == 1))
    for at, clock in script.boots:
        scene.at(at, lambda clock=clock: vehicle.boot(clock))  # type: ignore[misc]
    for at, length in script.stops:
        scene.says(at, vehicle, PRESSED)
        scene.says(at + length, vehicle, RELEASED)
    if not alone:
        _invite(scene, vehicle, script.stranger)
    scene.run(script.stranger.begin + script.stranger.length + BACK + 3.0)
    return scene, vehicle


def _invite(scene: Scene, vehicle: Vehicle, script: Stranger) -> None:
    """Let the stranger speak. Its numbers stay far from those of the vehicle."""

    def begin() -> None:
        number = (vehicle.ports[0].number + 128) & 255
        streams = states() if script.clock is None else dict(vehicle.streams)
        if script.source == HOME:
            streams = dict(vehicle.streams)  # the same rate, so that the numbers stay apart
        stranger = Vehicle(
            (Port((Path(script.source),), number),),
            kind=script.kind,
            armed=script.armed,
            clock=script.clock or 40.0,
            streams=streams,
            begin=scene.now,
            end=scene.now + script.length,
        )
        scene.add(stranger)
        for place, at in enumerate(sorted(script.turns)):
            scene.set(at, stranger, armed=script.armed is (place % 2 == 1))
        if script.begin <= script.stop < stranger.end:
            scene.says(script.stop, stranger, PRESSED)

    scene.at(script.begin, begin)


def unsafe_lines(scene: Scene, vehicle: Vehicle, stops: list[tuple[float, float]]) -> list[float]:
    """When the vehicle was called safe, less than 2 s after a frame of its own said the opposite."""
    found, newest, armed_at = [], -1, -10.0
    coming = iter([*scene.heard, None])
    arrival = next(coming)
    for line in scene.lines:
        while arrival is not None and arrival.at <= line.at + NEARLY:
            if arrival.who is vehicle and arrival.number > newest:
                sent = vehicle.sent[arrival.number]
                if isinstance(sent.message, Heartbeat):
                    newest = arrival.number
                    armed_at = arrival.at if sent.message.base_mode & 128 else -10.0
            arrival = next(coming)
        stopped = any(at <= line.at <= at + length + UNSURE for at, length in stops)
        if line.at - armed_at < belief.WITHIN and is_safe(line) and not stopped:
            found.append(line.at)
    return found


def check_script(script: Script) -> None:
    with belief.quietly():
        scene, vehicle = play(script, alone=False)
        unsafe = unsafe_lines(scene, vehicle, script.stops)
        assert not unsafe, f"called safe at {unsafe}"
        twin, _ = play(script, alone=True)
    assert not differences(scene, twin, script.stranger.begin + script.stranger.length + BACK)


LIVE = {
    "drives_powered": TriState.TRUE,
    "motion_possible": TriState.TRUE,
    "e_stopped": TriState.FALSE,
    "in_error": TriState.FALSE,
}
"""What is no harm to say of a vehicle of which less would be known without the stranger."""
SAMPLED = "in_motion"
"""Its samples may be a moment older."""


def differences(scene: Scene, twin: Scene, begin: float) -> list[str]:
    """Where a status is not what it would be, which the other scene shows, from `begin` on."""
    found = []
    for line, other in zip(scene.during(begin), twin.during(begin), strict=True):
        for name, ours, theirs in zip(line.status._fields, line.status, other.status, strict=True):
            more = theirs is TriState.UNKNOWN and ours is LIVE.get(name)
            if ours != theirs and name != SAMPLED and not more:
                found.append(f"{line.at}: {name} {ours!r} and not {theirs!r}")
        if line.detail.link is not other.detail.link:
            found.append(f"{line.at}: {line.detail.link} and not {other.detail.link}")
    last, motions = scene.lines[-1], {line.status.in_motion for line in twin.during(begin)}
    if motions == {TriState.FALSE} and last.status.in_motion is not TriState.FALSE:
        found.append(f"{last.at}: {SAMPLED} {last.status.in_motion!r}")
    return found


@given(SCRIPTS)
@settings(max_examples=40, report_multiple_bugs=False, derandomize=True)
def test_a_stranger_makes_nothing_safe_and_leaves_nothing_behind(script: Script) -> None:
    check_script(script)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_a_stranger_makes_nothing_safe_and_leaves_nothing_behind_in_many_scenes(part: int) -> None:
    found = settings(max_examples=250, database=None, phases=[Phase.generate], report_multiple_bugs=False)
    seed(part)(found(given(SCRIPTS)(check_script)))()


def test_a_scene_shows_an_unsafe_status() -> None:
    scene = Scene()
    bridge = heard(Path())
    vehicle = scene.add(Vehicle(bridge, armed=True, streams=states()))
    scene.add(Vehicle(bridge, streams=states(), begin=10.5))
    with belief.quietly():
        scene.run(12.0)
    assert unsafe_lines(scene, vehicle, [])
