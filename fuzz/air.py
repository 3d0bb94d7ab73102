"""A gateway whose links have no sockets: frames of any address in, statuses out, time as an argument."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

from mav_robot_status.clock import Instant
from mav_robot_status.gateway.mavlink_hardware import MavlinkHardware
from mav_robot_status.interface import LinkState, TriState
from mav_robot_status.links.base import Received
from mav_robot_status.mavlink.encode import encode

if TYPE_CHECKING:
    from mav_robot_status.config import Config
    from mav_robot_status.interface import Detail, RobotStatus
    from mav_robot_status.links.base import Link
    from mav_robot_status.links.url import Url

START: Final = Instant(1000.0, 1_800_000_000_000_000)
SO_BROADCAST: Final = 6


class Air:
    """A `Link` without a socket: `waiting` is what the gateway reads next."""

    text = "the air"
    stream = False
    dropped = 0

    def __init__(self, url: object = None) -> None:
        self.waiting: list[Received] = []

    def receive(self, limit: int = 64) -> list[Received]:
        """What waits."""
        pieces, self.waiting = self.waiting, []
        return pieces

    def fileno(self) -> int:
        """No descriptor."""
        return -1

    def send(self, data: bytes, to: object = None) -> bool:
        """Nobody listens."""
        return True

    def due(self) -> float:
        """Never."""
        return math.inf

    def service(self, now: float) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Nothing to close."""


class AirSocket:
    """What our UDP links use of a socket. `waiting` is what the gateway reads next."""

    def __init__(self) -> None:
        self.waiting: list[Received] = []

    def recvfrom(self, _: int) -> Received:
        """The first datagram that waits."""
        if not self.waiting:
            raise BlockingIOError
        return self.waiting.pop(0)

    def sendto(self, data: bytes, to: object) -> int:
        """Nobody listens."""
        return len(data)

    def setsockopt(self, level: int, option: int, value: object) -> None:
        """It can broadcast, and it has no filter."""
        if option != SO_BROADCAST:
            raise OSError

    def getsockopt(self, *_: object) -> bytes:
        """It counts nothing."""
        raise OSError

    def fileno(self) -> int:
        """No descriptor."""
        return -1

    def close(self) -> None:
        """Nothing to close."""


class Gateway:
    """A `MavlinkHardware` on links in the air."""

    def __init__(self, config: Config, now: Instant, air: type[Air] = Air) -> None:
        """Open it. A link that listens is an `air`; any other one is ours, on an `AirSocket`."""
        self.now = now
        self._airs: list[Any] = []

        def open_air(url: Url) -> Link:
            link: Any = air(url)
            if not url.kind.listens:
                socket = AirSocket()
                with mock.patch("mav_robot_status.links.udp._new_socket", return_value=socket):
                    link = url.kind.open(url)
                self._airs.append(socket)
            else:
                self._airs.append(link)
            return link  # type: ignore[no-any-return]

        with mock.patch("mav_robot_status.gateway.links.endpoint.open_guarded", open_air):
            self.hardware = MavlinkHardware(config, lambda: self.now)
        self._sources = list(self.hardware.sources())

    def arrive(self, data: bytes, source: tuple[str, int], link: int = 0) -> None:
        """A datagram of this address arrives on a link, by its number in the configuration."""
        self._airs[link].waiting.append(Received(data, source))
        self._sources[link].receive(self.now, 64)
        self.hardware.read(self.now)

    def turn(self) -> None:
        """What the event loop does at any time: serve the links, update the handles, send."""
        for source in self._sources:
            if self.now.mono >= source.next_due():
                source.service(self.now)
        self.hardware.read(self.now)
        self.hardware.write(self.now)

    def close(self) -> None:
        """The gateway ends."""
        self.hardware.close()


def says_safe(status: RobotStatus, detail: Detail) -> bool:
    """Whether the status calls the robot safe. Of a live armed robot that is the worst error."""
    return detail.link is LinkState.CONNECTED and (
        status.drives_powered is TriState.FALSE
        or status.motion_possible is TriState.FALSE
        or status.e_stopped is TriState.TRUE
    )


@lru_cache(maxsize=8192)
def packed(message: Any, sequence: int, system: int = 1, component: int = 1) -> bytes:
    """The frame of a message."""
    return encode(message, system=system, component=component, sequence=sequence)
