"""Two senders with one id, in every order that hypothesis finds: a live robot is never called safe."""

from __future__ import annotations

import logging

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from fuzz import belief
from fuzz.belief import FATES, OTHER, PAUSES, TRUE_ONE, UnsafeError, World
from mav_robot_status.hardware.mavlink import interface
from mav_robot_status.hardware.mavlink.facts import Claimed
from mav_robot_status.hardware.mavlink.settle import table
from mav_robot_status.hardware.mavlink.state import claims

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


TwoSenders.TestCase.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)
test_a_live_robot_is_never_called_safe_whatever_two_senders_do = TwoSenders.TestCase


def test_random_steps_find_no_unsafe_status_and_the_same_seed_takes_the_same_steps() -> None:
    assert belief.run(4000, seed=7) is None


def test_the_simulation_finds_a_gateway_that_does_not_compare_its_senders(monkeypatch: pytest.MonkeyPatch) -> None:
    def believe(*_: object) -> Claimed:
        return table.UNDISPUTED

    monkeypatch.setitem(table.SETTLE, "claimed", believe)
    monkeypatch.setattr(table, "_ALL", tuple(table.SETTLE.values()))
    found = belief.run(20_000, seed=1)
    assert found is not None
    assert "world = World()" in found


def test_the_simulation_finds_a_gateway_that_ignores_sequence_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interface, "CONTINUES", 255)
    monkeypatch.setattr(claims, "CONTINUES", 255)
    assert belief.run(20_000, seed=1) is not None


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
