"""SETUP_SIGNING contains the signing key: the gateway never forwards it."""

from __future__ import annotations

import select
import socket
from collections.abc import Iterator
from contextlib import ExitStack, suppress

import pytest

from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.gateway.links.link_hub import LinkHub
from mav_robot_status.mavlink.definitions import CommandLong
from mav_robot_status.mavlink.encode import enclose, encode
from mav_robot_status.testing import ManualClock

SETUP_SIGNING = enclose(256, bytes(8) + bytes((1, 1)) + b"k" * 32, system=255, component=190, sequence=0)
TO_ALL = enclose(256, bytes(10) + b"k" * 32, system=255, component=190, sequence=1)
COMMAND = encode(CommandLong(0, 0, 0, 0, 0, 0, 0, 400, 0, 0, 0), system=255, component=190, sequence=2)


class Forwarding:
    """A hub that forwards between the sockets of a vehicle and a ground station."""

    def __init__(self, stack: ExitStack) -> None:
        self.vehicle, self.ground = (stack.enter_context(self.open()) for _ in range(2))
        links = (LinkConfig(f"udpout:127.0.0.1:{end.getsockname()[1]}") for end in (self.vehicle, self.ground))
        clock = ManualClock()
        self.now = clock.now()
        self.hub = LinkHub(Config(links=(next(links),), outs=(next(links),), forward=True), clock)
        for endpoint in self.hub.endpoints:
            stack.callback(endpoint.link.close)

    @staticmethod
    def open() -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.bind(("127.0.0.1", 0))
        made.setblocking(False)
        return made

    def forward(self, data: bytes, sender: socket.socket) -> list[bytes]:
        """Send `data` from one end. Returns the datagrams that arrive at the other end."""
        number, other = (0, self.ground) if sender is self.vehicle else (1, self.vehicle)
        endpoint = self.hub.endpoints[number]
        link = endpoint.link
        link.send(b"x")  # binds its socket to a port
        sender.sendto(data, sender.recvfrom(100)[1])
        assert select.select([link], [], [], 5)[0]
        self.hub.receiver.receive(endpoint, self.now)
        arrived = []
        with suppress(BlockingIOError):
            while True:
                arrived.append(other.recv(1000))
        return arrived


@pytest.fixture
def forwarding() -> Iterator[Forwarding]:
    with ExitStack() as stack:
        yield Forwarding(stack)


@pytest.mark.parametrize("key", [SETUP_SIGNING, TO_ALL], ids=["to one vehicle", "to all"])
def test_setup_signing_is_not_forwarded_in_either_direction(forwarding: Forwarding, key: bytes) -> None:
    assert forwarding.forward(key, forwarding.ground) == []
    assert forwarding.forward(key, forwarding.vehicle) == []


@pytest.mark.parametrize("key", [SETUP_SIGNING, TO_ALL], ids=["to one vehicle", "to all"])
def test_setup_signing_of_a_known_sender_is_not_forwarded(forwarding: Forwarding, key: bytes) -> None:
    assert forwarding.forward(COMMAND, forwarding.ground) == [COMMAND]  # its address has a channel now
    assert forwarding.forward(key, forwarding.ground) == []
    assert forwarding.forward(COMMAND, forwarding.ground) == [COMMAND]


def test_other_frames_of_the_same_datagram_are_forwarded(forwarding: Forwarding) -> None:
    assert forwarding.forward(COMMAND, forwarding.ground) == [COMMAND]
    other = encode(CommandLong(0, 0, 0, 0, 0, 0, 0, 401, 0, 0, 0), system=255, component=190, sequence=3)
    assert forwarding.forward(TO_ALL + other, forwarding.ground) == [other]
