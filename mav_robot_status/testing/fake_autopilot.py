"""`FakeAutopilot`: plays a scenario on a real UDP socket."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

from ..clock import Instant
from ..mavlink.signing import Signer
from .codec import decode
from .commands import answer
from .event_table import VehicleFiles
from .lossy import Lossy, LossyLink
from .scenario import Action, Scenario, Step, Text, VehicleState, step
from .udp_fake import Address, UdpFake
from .vehicle_model import Outgoing, VehicleModel

log = logging.getLogger(__name__)

RECEIVED_KEPT = 1000
"""The most received messages that `heard` returns."""


def _log_note(step: Step) -> None:
    log.info("%5.1f s  %s", step.at, step.note)


class FakeAutopilot(UdpFake):
    """Sends to `to` like an autopilot or a simulator with `--out`, and receives on its own `address`.

    Without `to` it waits for the first datagram, and sends to the most recent sender. Either call `poll` with the time,
    or let a thread run on the real clock: `with FakeAutopilot(scenario, to=...) as ap:`. The methods that change the
    vehicle (`arm`, `say`, ...) may be called from any thread; the next poll applies the change. `speed` makes the steps
    of the scenario pass faster, `loop` restarts it at its end. `on_note` is called with each step, in the thread
    if one runs; the default logs the step. With a `signing_key` of 32 bytes it signs its frames. With `files` it offers
    its metadata and serves them over MAVLink FTP. With `lossy` its link is bad in both directions.

    Raises OSError if the address `bind` is in use.
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
        files: VehicleFiles | None = None,
        lossy: Lossy | None = None,
    ) -> None:
        super().__init__(bind)
        self.scenario = scenario
        self._model: VehicleModel | None = None
        self._speed, self._loop, self._on_note = speed, loop, on_note
        self._to = to
        self._answers_sender = to is None
        self._ids = system, component
        self._signer = None if signing_key is None else Signer(signing_key, link_id=0)
        self._files = files
        self._sent: LossyLink[bytes] = LossyLink(lossy or Lossy())
        self._arrived: LossyLink[tuple[bytes, Address]] = LossyLink((lossy or Lossy())._replace(seed=1))
        self._pending: deque[Step] = deque()
        self._received: deque[Any] = deque(maxlen=RECEIVED_KEPT)
        self._lock = threading.Lock()
        self.address: Address = self._socket.getsockname()
        """The local address. It receives there."""

    # For a test to read

    @property
    def state(self) -> VehicleState:
        """The state of the vehicle."""
        return self._model.state if self._model else self.scenario.start

    @property
    def finished(self) -> bool:
        """True when no step of the scenario is left."""
        return self._model is not None and self._model.finished

    def heard(self, kind: str | None = None) -> list[Any]:
        """The last 1000 received messages, oldest first; only those named `kind` if it is given."""
        with self._lock:
            return [m for m in self._received if kind is None or m.get_type() == kind]

    # For a test to call

    def set(self, **changes: Any) -> None:
        """Change fields of `VehicleState`. Raises ValueError (TypeError from Python 3.13) for an unknown field."""
        self.do(step(0.0, "", **changes))

    def do(self, step: Step) -> None:
        """Apply a step that is not in the scenario; its time is ignored."""
        self._pending.append(step)

    def arm(self) -> None:
        """Arm, regardless of the pre-arm checks."""
        self.set(armed=True)

    def disarm(self) -> None:
        """Disarm, also in flight."""
        self.set(armed=False)

    def set_mode(self, custom_mode: int) -> None:
        """Change the flight mode. The firmware need not know the number."""
        self.set(custom_mode=custom_mode)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT under the firmware's condition.

        ArduPilot sends it after it has received a message, or while streams run. PX4 sends it after it has received the
        heartbeat of a ground station.
        """
        self.do(Step(0.0, "", {}, (Text(severity, text),)))

    def silence(self) -> None:
        """Cut the link in both directions."""
        self.do(step(0.0, "", action=Action.SILENCE))

    def resume(self) -> None:
        """Restore the link."""
        self.do(step(0.0, "", action=Action.RESUME))

    def reboot(self) -> None:
        """Restart the autopilot: silence for 1.2 s, then the boot of the firmware."""
        self.do(step(0.0, "", action=Action.REBOOT))

    # The loop

    def poll(self, now: Instant) -> None:
        """Receive the datagrams that wait, and send the messages that are due. The first call starts the scenario."""
        if self._model is None:
            self._model = VehicleModel(self.scenario, now.mono, self._speed, self._loop, self._on_note)
            self._model.serve(self._files)
        due = self._model.run(now)
        while self._pending:
            self._model.do(self._pending.popleft())
        for data, sender in self._arrived.carry(self._receive()):
            self._handle(self._model, decode(data), sender)
        frames = [self._frame(outgoing, now.unix_us) for outgoing in due + self._model.run(now)]
        for frame in self._sent.carry(frames):
            self._send(frame)

    def _handle(self, model: VehicleModel, messages: list[Any], sender: Address) -> None:
        if not messages or not model.listening:
            return
        if self._answers_sender:
            self._to = sender
        for message in messages:
            if _is_for(message, *self._ids):
                with self._lock:
                    self._received.append(message)
                answer(model, message)

    def _frame(self, outgoing: Outgoing, unix_us: int) -> bytes:
        frame = outgoing.frame(*self._ids)
        return frame if self._signer is None else self._signer.sign(frame, unix_us)

    def _send(self, frame: bytes) -> None:
        if self._to is not None:
            self._send_to(self._to, frame)


def _is_for(message: Any, system: int, component: int) -> bool:
    """Whether a message is a broadcast, or addressed to this vehicle."""
    to_system, to_component = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
    return to_system in (0, system) and to_component in (0, component)
