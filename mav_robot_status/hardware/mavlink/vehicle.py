"""One vehicle of the hardware interface: its slot, its handle, and its state after the first HEARTBEAT."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from ...interface import DEFAULT_HANDLE_NAME, Detail, IndustrialRobotStatusHandle, LinkState, RobotStatus, Vehicle
from ...values import NamedTuple
from .moment import Moment
from .state.claims import Claims
from .state.vehicle_state import timeout_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .facts import Facts
    from .options import HardwareOptions
    from .requests.lost_events import LostEvents
    from .requests.message_intervals import Requests
    from .requests.parameters import Parameters
    from .state.vehicle_state import VehicleState

    Names = Mapping[tuple[int, int | None], str]
    """The names that people give to vehicles, by system and component id. None: each autopilot of that system."""


ESTABLISHED: Final = 5.0
"""Seconds of heartbeats without a link loss after which a vehicle keeps its place and its handle."""


class ExpectedVehicle(NamedTuple):
    """An expected vehicle and the name of its handle. None: any id."""

    system: int | None = None
    component: int | None = None
    handle: str = DEFAULT_HANDLE_NAME
    name: str | None = None
    """Its name for people."""


class TrackedVehicle:
    """One vehicle: its handle, and after the first HEARTBEAT its ids and state."""

    __slots__ = (
        "boots",
        "claims",
        "connected",
        "deadline",
        "dirty",
        "established",
        "facts",
        "handle",
        "ids",
        "log_way_at",
        "losses",
        "lost_events",
        "moment",
        "name",
        "parameters",
        "requests",
        "slot",
        "state",
    )

    def __init__(self, slot: ExpectedVehicle, name: str | None = None) -> None:
        self.slot = slot
        self.name = name
        """Its name for people; None if it has none."""
        self.handle = IndustrialRobotStatusHandle(slot.handle)
        self.handle.detail = self.unheard(slot.system, slot.component)
        self.ids: tuple[int, int] | None = None
        self.state: VehicleState | None = None
        self.claims: Claims[Any] = Claims()
        """Who speaks with its ids."""
        self.requests: Requests | None = None
        self.parameters: Parameters | None = None
        self.lost_events: LostEvents | None = None
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
        self.connected = False
        """Whether the heartbeat was fresh at the last evaluation. Only then does the deadline cover all facts."""
        self.moment = Moment(-math.inf)
        """The time of the last evaluation. Its `next` is the deadline: until then only a message changes the facts."""
        self.deadline = math.inf
        """The deadline as the hardware interface has noted it."""

    @property
    def costly(self) -> bool:
        """Whether it is heard only through HIGH_LATENCY2. Its link charges for each byte, so nothing is sent to it."""
        return self.state is not None and self.state.high_latency is not None

    @property
    def last_heard(self) -> float:
        """When (monotonic seconds) it sent its last HEARTBEAT; -inf if it sent none."""
        heard_at = self.handle.heard_at
        return -math.inf if heard_at is None else heard_at

    @property
    def has_lasted(self) -> bool:
        """Whether it has been heard for a while since the last link loss."""
        return self.state is not None and self.last_heard - self.state.heartbeats.since.mono >= ESTABLISHED

    def timeout(self, options: HardwareOptions) -> float:
        """Seconds without a heartbeat after which its link counts as lost."""
        return options.heartbeat_timeout if self.state is None else timeout_of(self.state, options)

    def forget(self) -> None:
        """Return to the state before the first HEARTBEAT. The ids stay."""
        self.state, self.facts = None, ()
        self.boots = 0
        self.established = False
        self.dirty, self.connected, self.moment = False, False, Moment(-math.inf)
        self.claims.forget()
        self.handle.status = RobotStatus()
        self.handle.detail = self.unheard(*(self.ids or (None, None)))
        self.handle.heard_at = None
        self.handle.evidence = {}

    def unheard(self, system: int | None, component: int | None) -> Detail:
        """The detail of its handle before the first HEARTBEAT."""
        return Detail(system, component, vehicle=Vehicle(name=self.name), link=LinkState.NEVER_SEEN)

    def matches(self, system: int, component: int) -> bool:
        """Whether this slot is free for an autopilot with these ids."""
        return self.ids is None and self.accepts(system, component)

    def accepts(self, system: int, component: int) -> bool:
        """Whether an autopilot with these ids can have this slot, if it is free."""
        return self.slot.system in (None, system) and self.slot.component in (None, component)
