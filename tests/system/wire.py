"""A UDP socket that sends what a test asks for and remembers what it receives, with the times."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from mav_robot_status.testing import decode
from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from ..deadline import SOON, Deadline, allow

ARMED = 128
ROVER, ARDUPILOT, ACTIVE = 10, 3, 4
BEAT = 0.25  # s
SETTLE = b"settle"


class Heard(NamedTuple):
    """One message, and the datagram that contained it."""

    at: float
    message: Any
    data: bytes


class Wire:
    """The heartbeats of an ArduPilot rover; `beating` sends them from a thread."""

    def __init__(self, to: tuple[Any, ...] | None = None, system: int = 1, component: int = 1) -> None:
        """Without `to` it sends to the first sender that it hears."""
        self.socket = socket.socket(socket.AF_INET6 if to and ":" in to[0] else socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("::1" if to and ":" in to[0] else "127.0.0.1", 0))
        self.socket.settimeout(0.05)
        self.address: tuple[Any, ...] = self.socket.getsockname()
        self.to = to
        self.mav = MAVLink(None, srcSystem=system, srcComponent=component)
        self.armed, self.custom_mode = False, 0
        self.beats: list[float] = []
        """When the heartbeats were sent."""
        self._heard: list[Heard] = []
        self._news = threading.Condition()
        self._stop = threading.Event()
        self._beating, self._settled = threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._listen, self._keep_beating)]
        for thread in self._threads:
            thread.start()

    def beat(self, armed: bool | None = None, custom_mode: int | None = None) -> float:
        """Send one HEARTBEAT. The instant at which it was sent."""
        with self._lock:
            self.armed = self.armed if armed is None else armed
            self.custom_mode = self.custom_mode if custom_mode is None else custom_mode
            base_mode = 65 | (ARMED if self.armed else 0)
            message = MAVLink_heartbeat_message(ROVER, ARDUPILOT, base_mode, self.custom_mode, ACTIVE, 3)
            self.beats.append(time.monotonic())
            self.send(message)
            return self.beats[-1]

    def beating(self, on: bool = True) -> Wire:
        """Start or stop sending a HEARTBEAT every quarter of a second."""
        (self._beating.set if on else self._beating.clear)()
        return self

    def send(self, message: Any) -> None:
        """Send a pymavlink message, or bytes."""
        data = message if isinstance(message, bytes) else message.pack(self.mav)
        assert self.to is not None
        with contextlib.suppress(ConnectionRefusedError):
            self.socket.sendto(data, self.to)
        self.mav.seq = (self.mav.seq + 1) % 256

    def settle(self) -> None:
        """Wait until `heard` has everything that has arrived."""
        self._settled.clear()
        self.socket.sendto(SETTLE, self.address)
        assert self._settled.wait(allow(SOON))

    def heard(self, kind: str | None = None) -> list[Heard]:
        """The messages received so far."""
        with self._news:
            return [h for h in self._heard if kind is None or h.message.get_type() == kind]

    def wait_for(
        self, kind: str, wanted: Callable[[Any], bool] = lambda m: True, after: float = 0.0, count: int = 1
    ) -> Heard:
        """Message number `count` of a kind after the instant `after` for which `wanted` is true."""
        deadline = Deadline()
        with self._news:
            while len(found := self._found(kind, wanted, after)) < count:
                assert deadline.left, f"no {kind}; heard {[h.message for h in self._heard[-5:]]}"
                self._news.wait(deadline.left)
        return found[count - 1]

    def _found(self, kind: str, wanted: Callable[[Any], bool], after: float) -> list[Heard]:
        heard = (one for one in self._heard if one.at > after and one.message.get_type() == kind)
        return [one for one in heard if wanted(one.message)]

    def close(self) -> None:
        """Stop sending and receiving."""
        self._stop.set()
        for thread in self._threads:
            thread.join()
        self.socket.close()

    def _listen(self) -> None:
        while not self._stop.is_set():
            try:
                data, source = self.socket.recvfrom(65535)
            except OSError:  # nothing yet, or an earlier datagram found nobody
                continue
            at = time.monotonic()
            if data == SETTLE:
                self._settled.set()
                continue
            self.to = self.to or source
            with self._news:
                self._heard += [Heard(at, message, data) for message in decode(data)]
                self._news.notify_all()

    def _keep_beating(self) -> None:
        while not self._stop.wait(BEAT):
            if self._beating.is_set() and self.to is not None:
                self.beat()
