"""`FakeFleet`: plays several scenarios on one UDP socket, like vehicles behind a radio or a router."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
from collections.abc import Callable, Sequence
from types import TracebackType

from .. import clock
from ..clock import Instant
from .codec import DecodedMessage, decode
from .commands import answer
from .fake_autopilot import POLL_PERIOD, READ_AT_ONCE, Address
from .scenario import Scenario, Step
from .vehicle_model import VehicleModel

OnNote = Callable[[int, Step], None]


class FakeFleet:
    """Vehicles with the system ids 1, 2, ... that send to every address of `to`, and hear whoever sends to them.

    Either call `poll` with the time, or let a thread run on the real clock: `with FakeFleet(...):`. `on_note` is called
    with the system id and each step, in the thread if one runs. `loop` restarts each scenario at its end, `speed` makes
    its steps pass faster.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        to: Sequence[Address],
        *,
        loop: bool = False,
        speed: float = 1.0,
        on_note: OnNote = lambda system, step: None,
    ) -> None:
        self._scenarios, self._to = tuple(scenarios), tuple(to)
        self._loop, self._speed, self._on_note = loop, speed, on_note
        self._models: dict[int, VehicleModel] = {}
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    @property
    def finished(self) -> bool:
        """True when no step of any scenario is left."""
        return bool(self._models) and all(model.finished for model in self._models.values())

    def poll(self, now: Instant) -> None:
        """Receive the datagrams that wait, and send the messages that are due. The first call starts the scenarios."""
        for system, scenario in enumerate(self._scenarios, 1):
            if system not in self._models:
                self._models[system] = VehicleModel(scenario, now.mono, self._speed, self._loop, self._noting(system))
        for message in self._receive():
            for system, model in self._models.items():
                if getattr(message, "target_system", 0) in (0, system) and model.listening:
                    answer(model, message)
        for system, model in self._models.items():
            for outgoing in model.run(now):
                self._send(outgoing.frame(system))

    def close(self) -> None:
        """Stop the thread, if any, and close the socket."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._socket.close()

    def __enter__(self) -> FakeFleet:
        self._thread = threading.Thread(target=self._run, name="fake fleet", daemon=True)
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

    def _noting(self, system: int) -> Callable[[Step], None]:
        return lambda step: self._on_note(system, step)

    def _receive(self) -> list[DecodedMessage]:
        messages: list[DecodedMessage] = []
        with contextlib.suppress(OSError):  # no datagram waits, or a peer refused an earlier one
            for _ in range(READ_AT_ONCE):
                messages += decode(self._socket.recv(65535))
        return messages

    def _send(self, frame: bytes) -> None:
        for address in self._to:
            with contextlib.suppress(OSError):  # as on a real link, a datagram that cannot be sent is lost
                self._socket.sendto(frame, address)
