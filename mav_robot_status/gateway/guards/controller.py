"""One controller and its handle. An exception stops the controller, and nothing else."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from . import Guard

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface import Controller, Detail, IndustrialRobotStatusHandle, RobotStatus


class GuardedController:
    """Calls a controller when its handle has changed, or when the controller is due. Holds the state of both."""

    __slots__ = ("controller", "detail", "due", "guard", "handle", "number", "running", "status", "updated")

    def __init__(self, name: str, controller: Controller, handle: IndustrialRobotStatusHandle, number: int = 0) -> None:
        self.controller = controller
        self.number = number
        """Controllers that are due together are updated in this order."""
        self.guard = Guard(f"controller '{name}'")
        self.handle = handle
        self.running = False
        self.updated = 0.0
        """When (monotonic seconds) the controller was last updated, or started."""
        self.due = math.inf
        """The result of its `next_due` after that update."""
        self.status: RobotStatus | None = None
        self.detail: Detail | None = None
        """The values in the handle at that update."""

    def start(self, now: Instant) -> None:
        """Start the controller; its first update is due at once."""
        self.guard.call(None, self.controller.starting, now)
        self.running, self.updated, self.due = True, now.mono, -math.inf

    def update(self, now: Instant) -> None:
        """Update the controller if its handle has changed, or if it is due."""
        status, detail = self.handle.status, self.handle.detail
        if now.mono < self.due and status is self.status and detail is self.detail:
            return
        period, self.updated = now.mono - self.updated, now.mono
        self.status, self.detail = status, detail
        self.guard.call(None, self.controller.update, now, period)
        self.due = self.guard.call(math.inf, self.controller.next_due, now.mono)

    def stop(self, now: Instant) -> None:
        """Stop the controller."""
        self.guard.call(None, self.controller.stopping, now)
        self.running, self.due = False, math.inf
