"""The values of the interface: a RobotStatus (the port of `industrial_robot_status_interface.h`) and its details."""

from __future__ import annotations

from enum import Enum
from typing import Final, NamedTuple

from ..clock import rfc3339
from ..json_object import JsonObject
from .fields import RobotMode, RobotStatus, TriState

__all__ = [
    "GROUP",
    "Detail",
    "ErrorCause",
    "Evidence",
    "Inhibit",
    "LinkState",
    "NotReady",
    "RobotMode",
    "RobotStatus",
    "RobotStatusMsg",
    "TriState",
    "Vehicle",
]


GROUP: Final = "GROUP"
"""`vehicle.type` of a group."""


class LinkState(str, Enum):
    """The state of the connection to the robot's controller (of a MAVLink vehicle: its autopilot)."""

    NEVER_SEEN = "NEVER_SEEN"
    CONNECTED = "CONNECTED"
    LOST = "LOST"


class ErrorCause(NamedTuple):
    """One active reason for in_error."""

    code: int
    """Non-zero."""
    name: str
    """Capitals, digits and underscores: `BATTERY_LOW`."""
    text: str | None
    """The text that the robot's controller sent; None if it sent none."""
    since_us: int
    """When the cause became active: Unix microseconds."""
    handle: str | None = None
    """The member of a group that reports it; None for a single robot."""

    def members(self) -> dict[str, str | int | None]:
        """The members in JSON."""
        return {"code": self.code, **_reason(self)}


class Inhibit(NamedTuple):
    """One reason why motion is not possible."""

    name: str
    """Capitals, digits and underscores: `DISARMED`."""
    text: str | None
    """The text that the robot's controller sent; None if it sent none."""
    since_us: int
    """When the reason became active: Unix microseconds."""
    handle: str | None = None
    """The member of a group that reports it; None for a single robot."""

    def members(self) -> dict[str, str | int | None]:
        """The members in JSON."""
        return _reason(self)


def _reason(of: ErrorCause | Inhibit) -> dict[str, str | int | None]:
    """What both have in JSON. `handle` is absent while it is None."""
    said: dict[str, str | int | None] = {"name": of.name, "text": of.text, "since": rfc3339(of.since_us)}
    return said if of.handle is None else {**said, "handle": of.handle}


class NotReady(NamedTuple):
    """A member of a group that cannot work now, and why."""

    handle: str
    why: str
    """LINK_STALE, E_STOPPED, the name of an error or inhibit, or MOTION_UNKNOWN."""


class Vehicle(NamedTuple):
    """What the robot's controller reports about itself. A field that it does not report is None.

    Of a MAVLink vehicle: MAVLink's names without their prefix; an unknown number is the number as text.
    """

    autopilot: str | None = None
    """The kind of controller: `ARDUPILOTMEGA`; of an arm, its maker's name for it."""
    type: str | None = None
    """The kind of robot: `GROUND_ROVER`; of an arm, its model."""
    flight_mode: str | None = None
    """The operating mode, by the controller's own name."""
    custom_mode: int | None = None
    """HEARTBEAT.custom_mode, 0 to 4294967295. None for every other robot."""
    state: str | None = None
    """The state of the controller: MAV_STATE; of an arm, the controller's own name."""
    firmware: str | None = None
    """The version of the controller's firmware: `4.5.6`, `4.7.0-dev`."""
    can_arm: bool | None = None
    """Whether the checks before arming pass in the current mode, by the controller's latest report of them."""
    modes_blocked: tuple[str, ...] | None = None
    """The operating modes in which they fail, by the controller's own names."""
    name: str | None = None
    """What people call the robot: 1 to 40 printable characters. The configuration gives it."""

    def members(self) -> JsonObject:
        """The members in JSON. Those that were added later are absent while they are None."""
        return {name: value for name, value in self._asdict().items() if value is not None or name not in _ADDED}


_ADDED: Final = frozenset({"firmware", "can_arm", "modes_blocked", "name"})


class Evidence(NamedTuple):
    """Why a field has its value: the rule that applied and the message that it read."""

    rule: str
    """The rule, as a short sentence."""
    source: str | None = None
    """The message that decided, with its bit, field or text."""
    at: float | None = None
    """When that message arrived: seconds on the monotonic clock."""
    next: str | None = None
    """What would make the field known if it is UNKNOWN, in whole sentences; None: the interface does not say."""


class Detail(NamedTuple):
    """The details of a RobotStatus. A hardware interface may leave them as created."""

    system: int | None = None
    """The MAVLink system id, 1 to 255. None for a robot that is not a MAVLink vehicle."""
    component: int | None = None
    """The MAVLink component id of the autopilot, 1 to 255. None for a robot that is not a MAVLink vehicle."""
    errors: tuple[ErrorCause, ...] = ()
    """Every active cause, the most important first."""
    inhibits: tuple[Inhibit, ...] = ()
    """Empty while motion_possible is TRUE."""
    vehicle: Vehicle = Vehicle()
    link: LinkState = LinkState.CONNECTED
    members: tuple[str, ...] = ()
    """The handles of a group, see `hardware.group`. Empty for a single robot."""
    not_ready: tuple[NotReady, ...] = ()
    """The members of a group that cannot work now."""

    @property
    def ready(self) -> bool | None:
        """Whether all members of a group can work now; None for a single robot."""
        if self.vehicle.type != GROUP and not self.members:
            return None
        return bool(self.members) and not self.not_ready

    def group_members(self) -> JsonObject:
        """The members in JSON that only a group has; empty for a single robot."""
        if self.ready is None:
            return {}
        not_ready = [one._asdict() for one in self.not_ready]
        return {"members": list(self.members), "ready": self.ready, "not_ready": not_ready}

    def lost(self, why: Inhibit, link: LinkState = LinkState.LOST) -> Detail:
        """The same robot, of which nothing is known any more."""
        return self._replace(
            errors=(),
            inhibits=(why,),
            vehicle=self.vehicle._replace(flight_mode=None, custom_mode=None, state=None),
            link=link,
            not_ready=tuple(NotReady(member, why.name) for member in self.members),
        )


class RobotStatusMsg(NamedTuple):
    """What a controller passes to its publishers: the status of one handle at one moment."""

    handle: str
    unix_us: int
    """When the controller was updated: Unix microseconds."""
    status: RobotStatus
    detail: Detail
    heartbeat_age: float | None
    """Seconds since the robot's controller was last heard; None if never."""
    boot_s: float | None = None
    """Seconds since the robot's controller has started; None unless its own log is replayed."""
