"""The table that turns a status into the numbers of control_msgs/HardwareStatus."""

from __future__ import annotations

import pytest

from mav_robot_status.interface import Detail, ErrorCause, Inhibit, LinkState, RobotMode, RobotStatus, Vehicle
from mav_robot_status.publishers.ros.hardware_status import device, devices

from .statuses import BLOCKED, DISARMED, FAILING, FALSE, HEARD, MOVABLE, RADIO, TRUE, UNKNOWN, message

ARM = Detail(vehicle=Vehicle("UNIVERSAL_ROBOTS", "ARM", firmware="5.11.1"))
PARKED = Detail(1, 1, inhibits=(Inhibit("DISARMED", None, 1),))
LATE = Detail(1, 1, inhibits=(Inhibit("HEARTBEAT_LATE", None, 1),))
LOST = Detail(1, 1, inhibits=(Inhibit("LINK_STALE", None, 1),), link=LinkState.LOST)


def failed(*names: str, inhibits: str = "") -> Detail:
    errors = tuple(ErrorCause(8001, name, None, 1) for name in names)
    return ARM._replace(errors=errors, inhibits=tuple(Inhibit(name, None, 1) for name in inhibits.split()))


@pytest.mark.parametrize(
    ("status", "detail", "health"),
    [
        (MOVABLE, HEARD, 1),
        (BLOCKED, PARKED, 1),
        (BLOCKED, DISARMED, 3),
        (MOVABLE._replace(motion_possible=UNKNOWN), HEARD, 3),
        (MOVABLE._replace(in_error=UNKNOWN), HEARD, 0),
        (FAILING, RADIO, 4),
        (BLOCKED._replace(e_stopped=TRUE), PARKED, 1),
        (RobotStatus(), LOST, 0),
        (RobotStatus(in_error=TRUE, error_code=9001), LOST, 0),
    ],
)
def test_the_health(status: RobotStatus, detail: Detail, health: int) -> None:
    assert device(message(status, detail)).health_status == health


@pytest.mark.parametrize(
    ("status", "detail", "domain"),
    [
        (MOVABLE, HEARD, (0,)),
        (MOVABLE._replace(e_stopped=UNKNOWN), HEARD, ()),
        (MOVABLE._replace(in_error=UNKNOWN), HEARD, ()),
        (RobotStatus(), LOST, ()),
        (BLOCKED._replace(e_stopped=TRUE), HEARD, (6,)),
        (BLOCKED._replace(e_stopped=TRUE), ARM, (5,)),
        (BLOCKED._replace(e_stopped=TRUE, in_error=UNKNOWN), ARM, (5,)),
        (FAILING, RADIO, (1,)),
        (FAILING, HEARD, (1,)),
        (FAILING, failed("PROTECTIVE_STOP", inhibits="PROTECTIVE_STOP"), (8,)),
        (FAILING, failed("SAFETY_FAULT", "SAFETY_STOP"), (1, 9)),
        (BLOCKED, failed(inhibits="SAFEGUARD_STOP"), (7,)),
    ],
)
def test_the_kinds_of_what_is_active(status: RobotStatus, detail: Detail, domain: tuple[int, ...]) -> None:
    assert device(message(status, detail)).error_domain == domain


def test_mode_power_and_link() -> None:
    modes = [device(message(MOVABLE._replace(mode=mode))).operational_mode for mode in RobotMode]
    assert dict(zip(RobotMode, modes, strict=True)) == {-1: 0, 1: 1, 2: 2}
    powered = [device(message(MOVABLE._replace(drives_powered=value))).power_state for value in (UNKNOWN, FALSE, TRUE)]
    assert powered == [0, 2, 3]
    links = [Detail(link=LinkState.NEVER_SEEN), HEARD, LOST, LATE]
    assert [device(message(detail=detail)).connectivity_status for detail in links] == [0, 1, 2, 4]


def test_the_maker_and_the_details() -> None:
    found = device(message(FAILING, RADIO._replace(vehicle=ARM.vehicle, inhibits=DISARMED.inhibits)))
    assert (found.manufacturer, found.model, found.firmware_version) == ("UNIVERSAL_ROBOTS", "ARM", "5.11.1")
    assert dict(found.state_details)["motion_possible"] == "TRUE"
    assert found.state_details[7:] == (
        ("link", "CONNECTED"),
        ("error", "RADIO_FAILSAFE (Radio Failsafe)"),
        ("error", "LOW"),
        ("inhibit", "DISARMED"),
        ("inhibit", "PREARM_FAILING (PreArm: Bad fix)"),
    )
    assert device(message()).manufacturer == ""


def test_a_group_has_a_device_for_each_member_and_one_that_is_not_published_is_unknown() -> None:
    group = message(detail=Detail(members=("base", "arm")), handle="robot")
    base, arm = devices(group, {"base": message(handle="base")})
    assert (base.device_id, base.power_state, arm.device_id, arm.power_state) == ("base", 3, "arm", 0)
    assert (arm.health_status, arm.error_domain, arm.connectivity_status) == (0, (), 0)
