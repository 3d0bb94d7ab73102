"""What is asked of all vehicles: the requests and parameters of each, and when it is time to look again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ..interface import LinkState
from ..mavlink.decode import text
from ..mavlink.definitions import CommandAck, ParamValue
from .parameters import Parameters
from .requests import OUTPUT_WATCH, Requests, wanted_of

if TYPE_CHECKING:
    from collections.abc import Container, Mapping

    from .tracked import Tracked


class Ask(NamedTuple):
    """A message for the autopilot of one vehicle."""

    system: int
    component: int
    message: Any


class Asking:
    """Asks politely (`requests`, `parameters`), and looks only when it is time to, or something has changed."""

    def __init__(self, watch_outputs: bool, own_component: int) -> None:
        self.own_component = own_component
        self.own_system: int | None = None
        """The system id we speak under; None: that of the vehicle we speak to."""
        self.anew = True
        """Whether there may be something to ask before `next_due`: something has changed."""
        self.next_due = math.inf
        """When (monotonic seconds) there may be something to ask."""
        self._watch_outputs = watch_outputs
        self._passive: Container[tuple[int, int]] = ()

    def heard(self, tracked: Tracked, message: Any, message_id: int, now: float) -> None:
        """A message of a vehicle that is asked: what came need not be asked for."""
        requests = tracked.requests
        if requests is None:
            return
        requests.arrived(message_id, now)
        if type(message) is CommandAck and tracked.ids is not None:
            requests.acknowledged(message, (self.own_system or tracked.ids[0], self.own_component), now)
            self.anew = True
        elif type(message) is ParamValue and tracked.parameters is not None:
            tracked.parameters.heard(text(message.param_id))

    def due(
        self, vehicles: Mapping[tuple[int, int], Tracked], now: float, passive: Container[tuple[int, int]]
    ) -> list[Ask]:
        """What is to be asked at `now`; nothing of those on `passive` links."""
        if now < self.next_due and not self.anew and passive == self._passive:
            return []
        self._passive = passive
        self.next_due = math.inf
        asks: list[Ask] = []
        for ids, tracked in vehicles.items():
            if ids not in passive and tracked.handle.detail.link is LinkState.CONNECTED:
                message = self._of(ids, tracked, now)
                if message is not None:
                    asks.append(Ask(*ids, message))
        self.anew = bool(asks)
        return asks

    def _of(self, ids: tuple[int, int], tracked: Tracked, now: float) -> Any:
        """What to ask of one vehicle, None for nothing."""
        memory = tracked.memory
        if memory is None:
            return None
        if tracked.requests is None:
            tracked.requests = Requests(*ids, now)
        wanted = wanted_of(memory.stack, memory.family, self._watch_outputs)
        message: Any = tracked.requests.due(now, wanted, memory.stack)
        if message is None and OUTPUT_WATCH[0] in wanted:
            if tracked.parameters is None:
                tracked.parameters = Parameters(*ids, now)
            message = tracked.parameters.due(now)
            self.next_due = min(self.next_due, tracked.parameters.next_due())
        self.next_due = min(self.next_due, tracked.requests.next_due())
        return message
