"""`FakeFleet`: plays several scenarios on one UDP socket, like vehicles behind a radio or a router."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..clock import Instant
from .codec import decode
from .commands import answer
from .scenario import Scenario, Step
from .udp_fake import Address, UdpFake
from .vehicle_model import VehicleModel

OnNote = Callable[[int, Step], None]


class FakeFleet(UdpFake):
    """Vehicles with the system ids 1, 2, ... that send to every address of `to`, and hear every sender.

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
        super().__init__()
        self._scenarios, self._to = tuple(scenarios), tuple(to)
        self._loop, self._speed, self._on_note = loop, speed, on_note
        self._models: dict[int, VehicleModel] = {}

    @property
    def finished(self) -> bool:
        """True when no step of any scenario is left."""
        return bool(self._models) and all(model.finished for model in self._models.values())

    def poll(self, now: Instant) -> None:
        """Receive the datagrams that wait, and send the messages that are due. The first call starts the scenarios."""
        for system, scenario in enumerate(self._scenarios, 1):
            if system not in self._models:
                self._models[system] = VehicleModel(scenario, now.mono, self._speed, self._loop, self._noting(system))
        for message in [message for data, _ in self._receive() for message in decode(data)]:
            for system, model in self._models.items():
                if getattr(message, "target_system", 0) in (0, system) and model.listening:
                    answer(model, message)
        for system, model in self._models.items():
            for outgoing in model.run(now):
                for address in self._to:
                    self._send_to(address, outgoing.frame(system))

    def _noting(self, system: int) -> Callable[[Step], None]:
        return lambda step: self._on_note(system, step)
