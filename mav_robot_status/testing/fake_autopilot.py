"""`FakeAutopilot`: an autopilot at a real UDP socket, played from a scenario."""

from __future__ import annotations

import contextlib
import logging
import select
import socket
import threading
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any

from .. import clock
from ..clock import Instant
from ..mavlink.pymavlink_dialect import MAVLink
from .commands import answer
from .scenario import Action, Scenario, Step, Text, VehicleState, step
from .vehicle_model import Outgoing, VehicleModel

log = logging.getLogger(__name__)

RECEIVED_KEPT = 1000
"""How many received messages are remembered."""
READ_AT_ONCE = 100
"""Datagrams read per poll: a flood must not keep the vehicle from sending."""
SIGNING_EPOCH = 1_420_070_400
"""2015-01-01: a signature's time stamp counts 10 us from there."""
PATIENCE = 0.02
"""Seconds that the thread waits for a datagram before it looks what is due."""

Address = tuple[str, int]


def _log_note(step: Step) -> None:
    log.info("%5.1f s  %s", step.at, step.note)


class FakeAutopilot:
    """Sends to `to` like an autopilot or a simulator with `--out`, and hears what is sent to its own `address`.

    Without `to` it waits until it hears something and talks to whoever spoke last. Either call `poll` with the time, or
    let a thread run with the real clock: `with FakeAutopilot(scenario, to=...) as ap:`. Everything that changes the
    vehicle (`arm`, `say`, ...) may be called from any thread and happens at the next poll. `speed` makes the scenario's
    steps pass faster, `loop` starts it anew at its end, `on_note` is called with each step that happens (from the
    thread, if there is one); by default it is logged. With a `signing_key` of 32 bytes what it sends is signed.

    Raises OSError if `bind` is taken.
    """

    def __init__(
        self,
        scenario: Scenario,
        to: Address | None = None,
        *,
        system: int = 1,
        component: int = 1,
        speed: float = 1.0,
        loop: bool = False,
        on_note: Callable[[Step], None] = _log_note,
        bind: Address = ("127.0.0.1", 0),
        signing_key: bytes | None = None,
    ) -> None:
        self.scenario = scenario
        self._model: VehicleModel | None = None
        self._speed, self._loop, self._on_note = speed, loop, on_note
        self._to = to
        self._answers_sender = to is None
        self._mav = MAVLink(None, srcSystem=system, srcComponent=component)
        if signing_key is not None:
            self._mav.signing.secret_key = signing_key
            self._mav.signing.sign_outgoing = True
            self._mav.signing.timestamp = int((clock.now().unix_us / 1e6 - SIGNING_EPOCH) * 1e5)
        self._asked: deque[Step] = deque()
        self._received: deque[Any] = deque(maxlen=RECEIVED_KEPT)
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(bind)
        except OSError:
            self._socket.close()
            raise
        self.address: Address = self._socket.getsockname()
        """Where it can be reached."""

    # What a test can see

    @property
    def state(self) -> VehicleState:
        """What is the case inside the vehicle."""
        return self._model.state if self._model else self.scenario.start

    @property
    def finished(self) -> bool:
        """True when no step of the scenario is left."""
        return self._model is not None and self._model.finished

    def heard(self, kind: str | None = None) -> list[Any]:
        """The last 1000 messages that were received, oldest first, decoded by pymavlink; of one kind if it is named."""
        with self._lock:
            return [m for m in self._received if kind is None or m.get_type() == kind]

    # What a test can do

    def set(self, **changes: Any) -> None:
        """Change fields of `VehicleState`. Raises ValueError (TypeError from Python 3.13) for an unknown field."""
        self.do(step(0.0, "", **changes))

    def do(self, step: Step) -> None:
        """Take a step that is not in the scenario; its time does not matter."""
        self._asked.append(step)

    def arm(self) -> None:
        """Arm, whatever the pre-arm checks say."""
        self.set(armed=True)

    def disarm(self) -> None:
        """Disarm, also in flight."""
        self.set(armed=False)

    def set_mode(self, custom_mode: int) -> None:
        """Change the flight mode, also to a number that the firmware does not know."""
        self.set(custom_mode=custom_mode)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT, if the firmware would send one to this peer: ArduPilot once it heard something or streams
        flow, PX4 once it heard a ground station's heartbeat."""
        self.do(Step(0.0, "", {}, (Text(severity, text),)))

    def silence(self) -> None:
        """Cut the link in both directions."""
        self.do(step(0.0, "", action=Action.SILENCE))

    def resume(self) -> None:
        """Mend the link."""
        self.do(step(0.0, "", action=Action.RESUME))

    def reboot(self) -> None:
        """Start the autopilot again: 1.2 s of nothing, then the firmware's boot."""
        self.do(step(0.0, "", action=Action.REBOOT))

    # How it runs

    def poll(self, now: Instant) -> None:
        """Hear what is waiting, send what is due. The first call is the start of the scenario."""
        if self._model is None:
            self._model = VehicleModel(self.scenario, now.mono, self._speed, self._loop, self._on_note)
        due = self._model.run(now)
        while self._asked:
            self._model.do(self._asked.popleft())
        for data, sender in self._receive():
            self._hear(self._model, decode(data), sender)
        for outgoing in due + self._model.run(now):
            self._send(outgoing)

    def close(self) -> None:
        """Stop the thread, if there is one, and let go of the socket."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._socket.close()

    def __enter__(self) -> FakeAutopilot:
        self._thread = threading.Thread(target=self._run, name="fake autopilot", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            self.poll(clock.now())
            select.select([self._socket], [], [], PATIENCE)

    def _receive(self) -> list[tuple[bytes, Address]]:
        datagrams: list[tuple[bytes, Address]] = []
        with contextlib.suppress(OSError):  # nothing is waiting, or an earlier datagram found nobody
            while len(datagrams) < READ_AT_ONCE:
                datagrams.append(self._socket.recvfrom(65535))
        return datagrams

    def _hear(self, model: VehicleModel, messages: list[Any], sender: Address) -> None:
        if not messages or not model.listening:
            return
        if self._answers_sender:
            self._to = sender
        for message in messages:
            if _is_for(message, self._mav.srcSystem, self._mav.srcComponent):
                with self._lock:
                    self._received.append(message)
                answer(model, message)

    def _send(self, outgoing: Outgoing) -> None:
        if self._to is None:
            return
        self._mav.seq = outgoing.seq
        with contextlib.suppress(OSError):  # as on a real link, what cannot be sent is lost
            self._socket.sendto(outgoing.message.pack(self._mav), self._to)


def decode(data: bytes) -> list[Any]:
    """The messages of one datagram; what is no known message with a right checksum is left out."""
    parser = MAVLink(None)
    parser.robust_parsing = True
    return [m for m in parser.parse_buffer(data) or [] if m.get_msgId() >= 0]


def _is_for(message: Any, system: int, component: int) -> bool:
    """True for broadcasts and for what names this vehicle."""
    to_system, to_component = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
    return to_system in (0, system) and to_component in (0, component)
