from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.mavlink.definitions import CommandLong, Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import ManualClock, arducopter, ardurover, decode, px4
from mav_robot_status.testing.fake_fleet import FakeFleet
from mav_robot_status.testing.scenario import Action, ending

SET_MESSAGE_INTERVAL, ATTITUDE = 511, 30


@pytest.fixture
def receivers() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two programs that listen."""
    with contextlib.ExitStack() as ended:
        made = [ended.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for one in made:
            one.bind(("127.0.0.1", 0))
            one.setblocking(False)
        yield made[0], made[1]


def received(receiver: socket.socket) -> list[tuple[int, str]]:
    """System id and name of what waits."""
    found = []
    with contextlib.suppress(BlockingIOError):
        while True:
            found += [(m.get_srcSystem(), m.get_type()) for m in decode(receiver.recv(2000))]
    return found


def test_each_vehicle_is_heard_by_every_receiver(receivers: tuple[socket.socket, socket.socket]) -> None:
    clock = ManualClock()
    fleet = FakeFleet((ardurover.READY, px4.READY, arducopter.READY), [one.getsockname() for one in receivers])
    with contextlib.closing(fleet):
        for _ in range(30):
            fleet.poll(clock.advance(0.05))
        for receiver in receivers:
            assert {system for system, name in received(receiver) if name == "HEARTBEAT"} == {1, 2, 3}


def test_a_request_reaches_the_vehicle_that_it_names(receivers: tuple[socket.socket, socket.socket]) -> None:
    clock, receiver = ManualClock(), receivers[0]
    fleet = FakeFleet((ardurover.READY, ardurover.READY), [receiver.getsockname()])
    with contextlib.closing(fleet):
        fleet.poll(clock.advance(0.05))
        _, sender = receiver.recvfrom(2000)
        beat = encode(Heartbeat(0, 18, 8, 0, 0, 3), system=245, component=192, sequence=0)
        asked = CommandLong(ATTITUDE, 100_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, SET_MESSAGE_INTERVAL, 2, 1, 0)
        receiver.sendto(beat + encode(asked, system=245, component=192, sequence=1), sender)
        for _ in range(60):
            fleet.poll(clock.advance(0.05))
        assert {system for system, name in received(receiver) if name == "ATTITUDE"} == {2}


def test_it_is_finished_when_every_story_is_told() -> None:
    clock, notes = ManualClock(), list[tuple[int, str]]()
    scenario = ending(ardurover.PREARM_FAILING)
    fleet = FakeFleet(
        (scenario, ardurover.READY), [], speed=10.0, on_note=lambda system, step: notes.append((system, step.note))
    )
    with contextlib.closing(fleet):
        assert not fleet.finished
        while not fleet.finished:
            fleet.poll(clock.advance(0.05))
        assert notes[-1] == (1, "the end")


def test_a_scenario_gets_one_end_so_that_it_can_be_played_in_a_loop() -> None:
    once = ending(ardurover.PREARM_FAILING, rest=2.0)
    assert once.steps[-1].action is Action.END
    assert once.duration == ardurover.PREARM_FAILING.duration + 2.0
    assert ending(once) == once
    assert ending(ardurover.READY) == ardurover.READY  # it has no steps to repeat
