"""One vehicle of the hardware interface: its slot, its handle, and its state after the first HEARTBEAT."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...interface import DEFAULT_HANDLE_NAME, Detail, IndustrialRobotStatusHandle, LinkState, RobotStatus, Vehicle
from .belief import Belief
from .state import timeout_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant
    from .facts import Facts
    from .options import HardwareOptions
    from .px4_events import EventTable
    from .requests.message_intervals import Requests
    from .requests.parameters import Parameters
    from .requests.scheduler import LostEvents
    from .state import VehicleState

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
        "basis",
        "belief",
        "boots",
        "conflict_since",
        "due",
        "established",
        "event_table",
        "facts",
        "handle",
        "ids",
        "losses",
        "lost_events",
        "name",
        "parameters",
        "requests",
        "slot",
        "tell_late_at",
        "tell_strangers_at",
        "touched",
    )

    def __init__(self, slot: ExpectedVehicle, name: str | None = None) -> None:
        self.slot = slot
        self.name = name
        """Its name for people; None if it has none."""
        self.handle = IndustrialRobotStatusHandle(slot.handle)
        self.handle.detail = self.unheard(slot.system, slot.component)
        self.ids: tuple[int, int] | None = None
        self.belief = Belief()
        """Who speaks with its ids, each with a state."""
        self.event_table: EventTable | None = None
        """The words for its events."""
        self.requests: Requests | None = None
        self.parameters: Parameters | None = None
        self.lost_events: LostEvents | None = None
        self.boots = 0
        self.established = False
        """Whether its heartbeats arrived for a while. Otherwise its place is free again soon after it falls silent."""
        self.losses = 0
        """How often the link was lost."""
        self.tell_strangers_at = self.tell_late_at = -math.inf
        """When it may be logged again that others speak as it, or that it is late."""
        self.conflict_since: Instant | None = None
        """The beginning of the conflict that was logged last."""
        self.facts: Facts | tuple[()] = ()
        """The facts of its main speaker."""
        self.basis: tuple[Any, ...] = ()
        """What the status in the handle is derived from: conflicts, and the facts of all that claim its ids."""
        self.due = math.inf
        """When its status may change, monotonic seconds."""
        self.touched = False
        """Whether a message has changed its state since the last `read`."""

    @property
    def state(self) -> VehicleState | None:
        """The state of its main speaker; None before the first HEARTBEAT."""
        main = self.belief.main
        return None if main is None else main.state

    @property
    def component(self) -> int:
        """Its component id."""
        return 0 if self.ids is None else self.ids[1]

    @property
    def is_armed(self) -> bool:
        """Whether it is connected, and says that it may move."""
        main = self.belief.main
        return main is not None and main.armed and self.handle.detail.link is LinkState.CONNECTED

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
        self.facts, self.basis = (), ()
        self.boots = 0
        self.established = self.touched = False
        self.due = math.inf
        self.belief.forget()
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
