"""The peer of the fake autopilot: a plain UDP socket."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, ManualClock, Scenario, decode
from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

TICK = 0.05


class Listener:
    """Replaces the gateway: receives the messages of the fake autopilot, and can send."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.address: tuple[str, int] = self.socket.getsockname()
        self.mav = MAVLink(None, srcSystem=1, srcComponent=192)

    def receive(self, kind: str | None = None) -> list[Any]:
        """The messages since the last call."""
        messages: list[Any] = []
        with contextlib.suppress(BlockingIOError):
            while True:
                messages += decode(self.socket.recv(65535))
        return [m for m in messages if kind is None or m.get_type() == kind]

    def send(self, message: Any, to: FakeAutopilot) -> None:
        self.socket.sendto(message.pack(self.mav), to.address)

    def command(self, to: FakeAutopilot, command: int, *params: float) -> None:
        padded = [*params, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][:7]
        self.send(self.mav.command_long_encode(1, 1, command, 0, *padded), to)

    def ground_station_heartbeat(self, to: FakeAutopilot) -> None:
        self.send(MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), to)


class Stage:
    """A fake autopilot, a listener, and a manual clock."""

    def __init__(self, listener: Listener, autopilot: FakeAutopilot) -> None:
        self.listener = listener
        self.autopilot = autopilot
        self.clock = ManualClock()
        autopilot.poll(self.clock.now())

    def play(self, seconds: float, kind: str | None = None) -> list[Any]:
        """Advance the time in small steps. Return the received messages."""
        received: list[Any] = []
        for _ in range(round(seconds / TICK)):
            self.autopilot.poll(self.clock.advance(TICK))
            received += self.listener.receive(kind)
        return received

    def command(self, command: int, *params: float) -> Any:
        """Send a command. Return its acknowledgement."""
        self.listener.command(self.autopilot, command, *params)
        (ack,) = self.play(TICK, "COMMAND_ACK")
        return ack


@pytest.fixture
def listener() -> Iterator[Listener]:
    made = Listener()
    yield made
    made.socket.close()


@pytest.fixture
def stage(listener: Listener) -> Iterator[Any]:
    """A function that makes a `Stage` for a scenario."""
    with contextlib.ExitStack() as stack:

        def build(scenario: Scenario, **options: Any) -> Stage:
            options.setdefault("to", listener.address)
            return Stage(listener, stack.enter_context(contextlib.closing(FakeAutopilot(scenario, **options))))

        yield build
