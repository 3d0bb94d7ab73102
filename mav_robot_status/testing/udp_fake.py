"""`UdpFake`: what the fakes on a UDP socket have in common: the socket, and the thread that polls it."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
from abc import ABC, abstractmethod
from types import TracebackType
from typing import Final, TypeVar

from .. import clock
from ..clock import Instant

READ_AT_ONCE: Final = 100
"""The most datagrams of one poll: a flood must not prevent the vehicle from sending."""
POLL_PERIOD: Final = 0.02
"""Seconds that the thread waits for a datagram before it checks what is due."""

Address = tuple[str, int]
Self = TypeVar("Self", bound="UdpFake")


class UdpFake(ABC):
    """Either call `poll` with the time, or let a thread run on the real clock: `with fake:`."""

    def __init__(self, bind: Address | None = None) -> None:
        """Raises OSError if the address `bind` is in use."""
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            if bind is not None:
                self._socket.bind(bind)
        except OSError:
            self._socket.close()
            raise

    @abstractmethod
    def poll(self, now: Instant) -> None:
        """Receive the datagrams that wait, and send the messages that are due. The first call starts everything."""

    def close(self) -> None:
        """Stop the thread, if any, and close the socket."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._socket.close()

    def __enter__(self: Self) -> Self:
        self._thread = threading.Thread(target=self._run, name=type(self).__name__, daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            self.poll(clock.now())
            select.select([self._socket], [], [], POLL_PERIOD)

    def _receive(self) -> list[tuple[bytes, Address]]:
        """At most READ_AT_ONCE of the datagrams that wait, each with its sender."""
        datagrams: list[tuple[bytes, Address]] = []
        with contextlib.suppress(OSError):  # no datagram waits, or the peer refused an earlier one
            while len(datagrams) < READ_AT_ONCE:
                datagrams.append(self._socket.recvfrom(65535))
        return datagrams

    def _send_to(self, address: Address, frame: bytes) -> None:
        with contextlib.suppress(OSError):  # as on a real link, a datagram that cannot be sent is lost
            self._socket.sendto(frame, address)
