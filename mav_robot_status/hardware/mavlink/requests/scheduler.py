"""The requests to all vehicles: messages and parameters, and when the next one may be due."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ....interface import LinkState
from ....mavlink.decode import text
from ....mavlink.definitions import CommandAck, ParamValue
from ..autopilots.wanted import OUTPUT_WATCH
from .message_intervals import Requests, wanted_of
from .parameters import Parameters

if TYPE_CHECKING:
    from collections.abc import Container, Mapping

    from ..vehicle import TrackedVehicle


class Ask(NamedTuple):
    """A message for the autopilot of one vehicle."""

    system: int
    component: int
    message: Any


class RequestScheduler:
    """Collects the requests that are due. It looks only when `next_due` has come, or `passive` has changed."""

    def __init__(self, watch_outputs: bool, own_component: int) -> None:
        self.own_component = own_component
        self.own_system: int | None = None
        """Our system id. None: the system id of the vehicle."""
        self.next_due = -math.inf
        """When (monotonic seconds) a request may be due. -inf: at once, because something has changed."""
        self._watch_outputs = watch_outputs
        self._passive: Container[tuple[int, int]] = ()

    def heard(self, tracked: TrackedVehicle, message: Any, message_id: int, now: float) -> None:
        """Note a message of a vehicle: a message that arrives need not be requested."""
        requests = tracked.requests
        if requests is None:
            return
        requests.arrived(message_id, now)
        if type(message) is CommandAck and tracked.ids is not None:
            requests.acknowledged(message, (self.own_system or tracked.ids[0], self.own_component), now)
            self.next_due = -math.inf
        elif type(message) is ParamValue and tracked.parameters is not None:
            tracked.parameters.heard(text(message.param_id))

    def due(
        self, vehicles: Mapping[tuple[int, int], TrackedVehicle], now: float, passive: Container[tuple[int, int]]
    ) -> list[Ask]:
        """The requests to send at `now`, none to vehicles on `passive` links."""
        if now < self.next_due and passive == self._passive:
            return []
        self._passive = passive
        self.next_due = math.inf
        asks: list[Ask] = []
        for ids, tracked in vehicles.items():
            if ids not in passive and tracked.handle.detail.link is LinkState.CONNECTED:
                message = self._of(ids, tracked, now)
                if message is not None:
                    asks.append(Ask(*ids, message))
        if asks:  # another may follow at once
            self.next_due = -math.inf
        return asks

    def _of(self, ids: tuple[int, int], tracked: TrackedVehicle, now: float) -> Any:
        """The next request to one vehicle, or None."""
        state = tracked.state
        if state is None:
            return None
        if tracked.requests is None:
            tracked.requests = Requests(*ids, now)
        wanted = wanted_of(state.profile, state.family, self._watch_outputs)
        message: Any = tracked.requests.due(now, wanted, state.profile)
        if message is None and OUTPUT_WATCH[0] in wanted:
            if tracked.parameters is None:
                tracked.parameters = Parameters(*ids, now)
            message = tracked.parameters.due(now)
            self.next_due = min(self.next_due, tracked.parameters.next_due())
        self.next_due = min(self.next_due, tracked.requests.next_due())
        return message
