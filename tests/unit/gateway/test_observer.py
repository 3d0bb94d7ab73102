from __future__ import annotations

import socket
from contextlib import closing

from mav_robot_status.clock import Instant, later
from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.diagnosis.explain import silent
from mav_robot_status.gateway.event_loop import EventLoop
from mav_robot_status.gateway.observer import Observer
from mav_robot_status.interface import IndustrialRobotStatusInterface
from mav_robot_status.links.base import Address
from mav_robot_status.links.udp import UdpLink
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame
from mav_robot_status.streams import NO_OUTPUT

HERE = silent(Config(links=(LinkConfig("udpin:127.0.0.1:0"),)))
START = Instant(1.0, 0)
ROVER = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)
GROUND_STATION = encode(Heartbeat(0, 6, 8, 0, 4, 3), system=255, component=190, sequence=0)


class Noting(Observer):
    """Records its calls."""

    def __init__(self) -> None:
        self.data: list[bytes] = []
        self.frames: list[tuple[int, int]] = []
        self.ticks: list[tuple[float, list[str]]] = []

    def on_data(self, data: bytes, source: Address, now: Instant) -> None:
        self.data.append(data)

    def on_frame(self, frame: Frame, now: Instant) -> None:
        self.frames.append(frame.ids)

    def on_tick(self, handles: IndustrialRobotStatusInterface, now: Instant) -> None:
        self.ticks.append((now.mono, handles.get_names()))


def heard(*observers: Observer) -> None:
    """A gateway receives noise and the heartbeats of a ground station and of a rover, and turns once."""
    with closing(EventLoop(HERE, NO_OUTPUT, lambda: START, observers=observers)) as gateway:
        link = gateway.endpoints[0].link
        assert isinstance(link, UdpLink)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            for data in (b"noise", GROUND_STATION, ROVER):
                peer.sendto(data, ("127.0.0.1", link.port))
        gateway.hardware.all.sources()[0].receive(START, 64)
        gateway.turn(later(START, 0.5))


def test_an_observer_sees_all_data_the_frames_of_vehicles_and_each_tick() -> None:
    noting = Noting()
    heard(noting)
    assert noting.data == [b"noise", GROUND_STATION, ROVER]
    assert noting.frames == [(1, 1)]
    assert noting.ticks == [(1.5, ["industrial_robot_status_handle"])]


def test_an_observer_overrides_only_what_it_needs() -> None:
    heard(Observer(), Noting())
