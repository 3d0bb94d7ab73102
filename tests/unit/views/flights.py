"""A flight in steps: the status of a handle at each second, as a timeline."""

from __future__ import annotations

from mav_robot_status.clock import Instant
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Evidence,
    IndustrialRobotStatusHandle,
    Inhibit,
    LinkState,
    RobotMode,
    RobotStatus,
    TriState,
    Vehicle,
)
from mav_robot_status.views.timeline import Timeline, TimelineBuilder, VehicleTimeline

START_US = 1_800_000_000_000_000  # 2027-01-15T08:00:00Z
TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
S = 1_000_000
DISARMED = Inhibit("DISARMED", None, START_US)


def error(code: int, name: str, text: str | None = None) -> ErrorCause:
    return ErrorCause(code, name, text, START_US)


class Flight:
    """One vehicle in a log. Steps are in seconds on a clock that begins at 100."""

    def __init__(self, name: str = "flight.tlog", system: int = 1) -> None:
        self.builder = TimelineBuilder(name)
        self.handle = IndustrialRobotStatusHandle("handle")
        self.detail = Detail(system, 1, vehicle=Vehicle("PX4", "QUADROTOR", "POSCTL"))
        self.jump_us = 0
        self.builder.begin(self.instant(0))

    def instant(self, second: float) -> Instant:
        return Instant(100 + second, START_US + self.jump_us + round(second * S))

    def say(
        self,
        second: float,
        *,
        armed: bool = True,
        errors: tuple[ErrorCause, ...] = (),
        inhibits: tuple[Inhibit, ...] = (),
        mode: str = "POSCTL",
        because: Evidence | None = None,
        **fields: TriState,
    ) -> Flight:
        """A status of a connected vehicle."""
        status = RobotStatus(mode=RobotMode.MANUAL, **fields)
        vehicle = self.detail.vehicle._replace(flight_mode=mode)
        inhibits = inhibits if armed else (DISARMED, *inhibits)
        return self.put(
            second, status, self.detail._replace(errors=errors, inhibits=inhibits, vehicle=vehicle), because
        )

    def lose(self, second: float) -> Flight:
        """The link is lost."""
        vehicle = self.detail.vehicle._replace(flight_mode=None)
        stale = Inhibit("LINK_STALE", None, START_US)
        return self.put(
            second, RobotStatus(), self.detail._replace(link=LinkState.LOST, inhibits=(stale,), vehicle=vehicle), None
        )

    def put(self, second: float, status: RobotStatus, detail: Detail, because: Evidence | None) -> Flight:
        self.handle.status, self.handle.detail = status, detail
        self.handle.evidence = {} if because is None else dict.fromkeys(RobotStatus._fields[:-1], because)
        self.builder.sample([self.handle], self.instant(second))
        return self

    def jump(self, second: float, by_us: int) -> Flight:
        """The log's clock is set."""
        self.jump_us += by_us
        self.builder.begin(self.instant(second))
        return self

    def end(self, second: float) -> Timeline:
        self.builder.end(self.instant(second))
        return self.builder.timeline

    def vehicle(self, second: float) -> VehicleTimeline:
        """The vehicle's timeline when the log ends at `second`."""
        (vehicle,) = self.end(second).vehicles
        return vehicle
