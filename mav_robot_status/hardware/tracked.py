"""One vehicle as the hardware follows it: its place, its handle, and once it was heard its memory."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from ..interface import DEFAULT_HANDLE_NAME, Detail, IndustrialRobotStatusHandle, LinkState

if TYPE_CHECKING:
    from .horizon import Matters
    from .memory import Memory
    from .parameters import Parameters
    from .requests import Requests


class Slot(NamedTuple):
    """A vehicle that is expected, and the name of its handle. None: any."""

    system: int | None = None
    component: int | None = None
    handle: str = DEFAULT_HANDLE_NAME


class Tracked:
    """One vehicle: its handle, and once it was heard its ids and memory."""

    __slots__ = (
        "boots",
        "checked",
        "deadline",
        "dirty",
        "handle",
        "ids",
        "losses",
        "memory",
        "parameters",
        "requests",
        "seen",
        "slot",
    )

    def __init__(self, slot: Slot) -> None:
        self.slot = slot
        self.handle = IndustrialRobotStatusHandle(slot.handle)
        self.handle.detail = Detail(slot.system, slot.component, link=LinkState.NEVER_SEEN)
        self.ids: tuple[int, int] | None = None
        self.memory: Memory | None = None
        self.requests: Requests | None = None
        self.parameters: Parameters | None = None
        self.boots = 0
        self.losses = 0
        """How often the link was lost."""
        self.seen: Matters = {}
        """What mattered at the last look."""
        self.dirty = False
        """Whether it is among those that are stirred."""
        self.deadline = math.inf
        """Before this time (monotonic seconds) the status does not change if nothing that matters is heard."""
        self.checked = -math.inf
        """Up to when the passing of time is in the status."""

    def matches(self, system: int, component: int) -> bool:
        """True if this is the place for a newly heard autopilot."""
        return self.ids is None and self.slot.system in (None, system) and self.slot.component in (None, component)
