"""A UDP socket that says what a test tells it to, and remembers what it hears and when."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from mav_robot_status.mavlink.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message
from mav_robot_status.testing import decode

from .gateway_process import SOON

ARMED = 128
ROVER, ARDUPILOT, ACTIVE = 10, 3, 4
BEAT = 0.25  # s


class Heard(NamedTuple):
    """One message, and the datagram that it came in."""

    at: float
    message: Any
    data: bytes


class Wire:
    """An ArduPilot rover as far as its heartbeats go; `beating` sends them from a thread."""

    def __init__(self, to: tuple[Any, ...] | None = None, system: int = 1, component: int = 1) -> None:
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
        self._beating = threading.Event()
        self._lock = threading.Lock()
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._listen, self._keep_beating)]
        for thread in self._threads:
            thread.start()

    def beat(self, armed: bool | None = None, custom_mode: int | None = None) -> float:
        """Send one HEARTBEAT; when it was sent."""
        with self._lock:
            self.armed = self.armed if armed is None else armed
            self.custom_mode = self.custom_mode if custom_mode is None else custom_mode
            base_mode = 65 | (ARMED if self.armed else 0)
            message = MAVLink_heartbeat_message(ROVER, ARDUPILOT, base_mode, self.custom_mode, ACTIVE, 3)
            self.beats.append(time.monotonic())
            self.send(message)
            return self.beats[-1]

    def beating(self, on: bool = True) -> Wire:
        """Send a HEARTBEAT every quarter of a second, or no more."""
        (self._beating.set if on else self._beating.clear)()
        return self

    def send(self, message: Any) -> None:
        """Send a message of pymavlink's, or bytes."""
        data = message if isinstance(message, bytes) else message.pack(self.mav)
        assert self.to is not None
        with contextlib.suppress(ConnectionRefusedError):
            self.socket.sendto(data, self.to)

    def heard(self, kind: str | None = None) -> list[Heard]:
        """What has been heard so far."""
        with self._news:
            return [h for h in self._heard if kind is None or h.message.get_type() == kind]

    def wait_for(
        self, kind: str, wanted: Callable[[Any], bool] = lambda m: True, timeout: float = SOON, after: float = 0.0
    ) -> Heard:
        """The first message of a kind, heard later than `after`, of which `wanted` is true."""
        deadline = time.monotonic() + timeout
        with self._news:
            while True:
                for heard in self._heard:
                    if heard.at > after and heard.message.get_type() == kind and wanted(heard.message):
                        return heard
                left = deadline - time.monotonic()
                if left <= 0:
                    raise AssertionError(f"no {kind} within {timeout} s; heard {[h.message for h in self._heard[-5:]]}")
                self._news.wait(left)

    def close(self) -> None:
        """Fall silent."""
        self._stop.set()
        for thread in self._threads:
            thread.join()
        self.socket.close()

    def _listen(self) -> None:
        while not self._stop.is_set():
            try:
                data = self.socket.recv(65535)
            except OSError:  # nothing yet, or an earlier datagram found nobody
                continue
            at = time.monotonic()
            with self._news:
                self._heard += [Heard(at, message, data) for message in decode(data)]
                self._news.notify_all()

    def _keep_beating(self) -> None:
        while not self._stop.wait(BEAT):
            if self._beating.is_set() and self.to is not None:
                self.beat()
