"""A status as control_msgs/HardwareStatus of ros2_control: a device for a robot, or for each member of a group.

The members and their numbers are those of control_msgs 6.5.0 and later. What it cannot express is in `state_details`.
Pure functions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from ...interface import FIELDS, Detail, LinkState, RobotMode, RobotStatus, RobotStatusMsg, TriState
from .diagnostics import Level, level, reason_of

HEALTH_UNKNOWN, HEALTH_OK, HEALTH_WARNING, HEALTH_ERROR = 0, 1, 3, 4
NONE, UNKNOWN_ERROR, STOP_HW, STOP_SW, PROTECTIVE_HW, PROTECTIVE_SW, SAFETY = 0, 1, 5, 6, 7, 8, 9
"""error_domain: EMERGENCY_STOP_HW and so on."""
DOMAINS: Final = {"PROTECTIVE_STOP": PROTECTIVE_SW, "SAFEGUARD_STOP": PROTECTIVE_HW, "SAFETY_STOP": SAFETY}
"""The kind of an error or inhibit by its name. The kind of another error is not known."""
MODES: Final = {RobotMode.UNKNOWN: 0, RobotMode.MANUAL: 1, RobotMode.AUTO: 2}
POWER: Final = {TriState.UNKNOWN: 0, TriState.TRUE: 3, TriState.FALSE: 2}
"""ON, STANDBY: a robot that answers is not off."""
LINKS: Final = {LinkState.NEVER_SEEN: 0, LinkState.CONNECTED: 1, LinkState.LOST: 2}
"""UNKNOWN, UP, DOWN."""
SLOW: Final = 4
"""CONNECTION_SLOW."""


class Device(NamedTuple):
    """control_msgs/HardwareDeviceStatus with its one GenericHardwareState."""

    unix_us: int
    device_id: str
    health_status: int
    error_domain: tuple[int, ...]
    operational_mode: int
    power_state: int
    connectivity_status: int
    manufacturer: str
    model: str
    firmware_version: str
    state_details: tuple[tuple[str, str], ...]


def devices(msg: RobotStatusMsg, latest: Mapping[str, RobotStatusMsg]) -> tuple[Device, ...]:
    """The robot itself, or the members of a group. A member that is not in `latest` is unknown."""
    if msg.detail.ready is None:
        return (device(msg),)
    return tuple(device(latest.get(name) or _untold(name, msg.unix_us)) for name in msg.detail.members)


def _untold(name: str, unix_us: int) -> RobotStatusMsg:
    return RobotStatusMsg(name, unix_us, RobotStatus(), Detail(link=LinkState.NEVER_SEEN), None)


def device(msg: RobotStatusMsg) -> Device:
    """One robot."""
    status, detail, vehicle = msg.status, msg.detail, msg.detail.vehicle
    late = any(inhibit.name == "HEARTBEAT_LATE" for inhibit in detail.inhibits)
    return Device(
        msg.unix_us,
        msg.handle,
        _health(status, detail),
        error_domain(status, detail),
        MODES[status.mode],
        POWER[status.drives_powered],
        SLOW if late and detail.link is LinkState.CONNECTED else LINKS[detail.link],
        vehicle.autopilot or "",
        vehicle.type or "",
        vehicle.firmware or "",
        tuple(_details(msg)),
    )


def _health(status: RobotStatus, detail: Detail) -> int:
    if detail.link is not LinkState.CONNECTED or status.in_error is TriState.UNKNOWN:
        return HEALTH_UNKNOWN
    if status.in_error is TriState.TRUE:
        return HEALTH_ERROR
    return HEALTH_WARNING if level(status, detail) is Level.WARN else HEALTH_OK


def error_domain(status: RobotStatus, detail: Detail) -> tuple[int, ...]:
    """The kinds of what is active. NONE only if it is known that nothing is; empty if nothing is and one is unknown."""
    found = []
    if status.e_stopped is TriState.TRUE:
        found.append(STOP_HW if detail.system is None else STOP_SW)  # an arm has a button
    found += [DOMAINS.get(error.name, UNKNOWN_ERROR) for error in detail.errors]
    found += [DOMAINS[inhibit.name] for inhibit in detail.inhibits if inhibit.name in DOMAINS]
    if status.in_error is TriState.TRUE and not detail.errors:
        found.append(UNKNOWN_ERROR)
    if not found and status.e_stopped is status.in_error is TriState.FALSE:
        return (NONE,)
    return tuple(dict.fromkeys(found))


def _details(msg: RobotStatusMsg) -> Iterator[tuple[str, str]]:
    for field in FIELDS:
        yield field.name, field.word(getattr(msg.status, field.name))
    yield "link", msg.detail.link.value
    for error in msg.detail.errors:
        yield "error", reason_of(error)
    for inhibit in msg.detail.inhibits:
        yield "inhibit", reason_of(inhibit)
