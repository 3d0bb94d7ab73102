"""What a robot's status is: the port of `industrial_robot_status_interface.h`, and what MAVLink can tell beyond it.

Numbers are those of industrial_msgs: TriState -1/0/1, RobotMode -1/1/2 (there is no 0).
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import NamedTuple


class TriState(IntEnum):
    """industrial_msgs/TriState: unknown is a value of its own and never means false."""

    UNKNOWN = -1
    FALSE = 0
    TRUE = 1


class RobotMode(IntEnum):
    """industrial_msgs/RobotMode: who moves the robot, a person (MANUAL) or a program (AUTO)."""

    UNKNOWN = -1
    MANUAL = 1
    AUTO = 2


class RobotStatus(NamedTuple):
    """The seven fields of industrial_msgs/RobotStatus; as created, nothing is known."""

    mode: RobotMode = RobotMode.UNKNOWN
    e_stopped: TriState = TriState.UNKNOWN
    drives_powered: TriState = TriState.UNKNOWN
    motion_possible: TriState = TriState.UNKNOWN
    in_motion: TriState = TriState.UNKNOWN
    in_error: TriState = TriState.UNKNOWN
    error_code: int = 0
    """0: no error. Non-zero if and only if in_error is TRUE."""


class LinkState(str, Enum):
    """What is known of the connection to the robot's controller."""

    NEVER_SEEN = "NEVER_SEEN"
    CONNECTED = "CONNECTED"
    LOST = "LOST"


class ErrorCause(NamedTuple):
    """One active reason for in_error."""

    code: int
    name: str
    text: str | None
    """The autopilot's own words, where it said any."""
    since_us: int
    """Unix microseconds at which the cause was first seen."""


class Inhibit(NamedTuple):
    """One reason why motion is not possible."""

    bit: int
    """Its bit in ROBOT_STATUS.inhibit_flags."""
    name: str
    text: str | None
    since_us: int


class Vehicle(NamedTuple):
    """What the autopilot says of itself; MAVLink's names without prefix, an unknown number as text."""

    autopilot: str | None = None
    type: str | None = None
    flight_mode: str | None = None
    custom_mode: int | None = None
    state: str | None = None


class Evidence(NamedTuple):
    """Why a field has its value: the rule that decided and the message that it read."""

    rule: str
    """What was concluded from what, in words."""
    source: str | None = None
    """The deciding message, with its bit, field or text."""
    at: float | None = None
    """When that message arrived: seconds on the monotonic clock."""


class Detail(NamedTuple):
    """What goes with a RobotStatus of a MAVLink vehicle. A hardware interface of one's own may leave it as created."""

    system: int | None = None
    component: int | None = None
    errors: tuple[ErrorCause, ...] = ()
    """Every active cause, the most important first."""
    inhibits: tuple[Inhibit, ...] = ()
    """Empty while motion_possible is TRUE."""
    vehicle: Vehicle = Vehicle()
    link: LinkState = LinkState.CONNECTED


class RobotStatusMsg(NamedTuple):
    """What a controller hands to its publishers: a status, whose it is, and when it was so."""

    handle: str
    unix_us: int
    """The stamp of the controller's update."""
    status: RobotStatus
    detail: Detail
    heartbeat_age: float | None
    """Seconds since the robot's controller was last heard; None if never."""
