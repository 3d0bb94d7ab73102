"""One vehicle of the hardware interface: its slot, its handle, and its state after the first HEARTBEAT."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ...interface import DEFAULT_HANDLE_NAME, Detail, IndustrialRobotStatusHandle, LinkState
from .moment import Moment
from .state.claims import Claims

if TYPE_CHECKING:
    from .facts import Facts
    from .requests.message_intervals import Requests
    from .requests.parameters import Parameters
    from .state.vehicle_state import VehicleState


class ExpectedVehicle(NamedTuple):
    """An expected vehicle and the name of its handle. None: any id."""

    system: int | None = None
    component: int | None = None
    handle: str = DEFAULT_HANDLE_NAME


class TrackedVehicle:
    """One vehicle: its handle, and after the first HEARTBEAT its ids and state."""

    __slots__ = (
        "boots",
        "claims",
        "dirty",
        "established",
        "facts",
        "handle",
        "ids",
        "log_way_at",
        "losses",
        "moment",
        "parameters",
        "requests",
        "slot",
        "state",
    )

    def __init__(self, slot: ExpectedVehicle) -> None:
        self.slot = slot
        self.handle = IndustrialRobotStatusHandle(slot.handle)
        self.handle.detail = Detail(slot.system, slot.component, link=LinkState.NEVER_SEEN)
        self.ids: tuple[int, int] | None = None
        self.state: VehicleState | None = None
        self.claims: Claims[Any] = Claims()
        """Who speaks with its ids."""
        self.requests: Requests | None = None
        self.parameters: Parameters | None = None
        self.boots = 0
        self.established = False
        """Whether its heartbeats arrived for a while. Otherwise its place is free again soon after it falls silent."""
        self.losses = 0
        """How often the link was lost."""
        self.log_way_at = -math.inf
        """When a change of its way may be logged again."""
        self.facts: Facts | tuple[()] = ()
        """The facts that the status in the handle is derived from."""
        self.dirty = False
        """Whether the next `read` evaluates it."""
        self.moment = Moment(-math.inf)
        """The time of the last evaluation. Its `next` is the deadline: until then only a message changes the facts."""

    def matches(self, system: int, component: int) -> bool:
        """Whether this slot is free for an autopilot with these ids."""
        return self.ids is None and self.accepts(system, component)

    def accepts(self, system: int, component: int) -> bool:
        """Whether an autopilot with these ids can have this slot, if it is free."""
        return self.slot.system in (None, system) and self.slot.component in (None, component)
