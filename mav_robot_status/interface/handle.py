"""`IndustrialRobotStatusHandle`: a hardware interface sets a status under a name, and controllers read it."""

from __future__ import annotations

from collections.abc import Mapping

from .status import Detail, Evidence, RobotStatus

DEFAULT_HANDLE_NAME = "industrial_robot_status_handle"


class IndustrialRobotStatusHandle:
    """A name and the latest status under it.

    ORIGINAL: the C++ handle points at a RobotStatus that the hardware interface changes in place. Here a status is
    a value, and the hardware interface sets a new one. A reader can keep what it read.
    """

    __slots__ = ("booted_at", "detail", "evidence", "heard_at", "name", "status")

    def __init__(self, name: str, status: RobotStatus | None = None) -> None:
        self.name = name
        self.status = status if status is not None else RobotStatus()
        self.detail = Detail()
        self.heard_at: float | None = None
        """When (monotonic seconds) the robot's controller was last heard; None if never or unknown."""
        self.booted_at: float | None = None
        """When (monotonic seconds) the robot's controller has started; None unless its own log is replayed."""
        self.evidence: Mapping[str, Evidence] = {}
        """Why each field has its value, by name of the field; empty if the hardware interface gives no reasons."""

    def __repr__(self) -> str:
        return f"IndustrialRobotStatusHandle({self.name!r}, {self.status!r})"
