"""The ROS 2 messages that we publish: their types, and their bytes. Pure functions.

A type hash identifies a definition (REP 2016). rmw_zenoh has it in every key, so a subscriber with another definition
does not receive. Tests compare bytes and hashes with those of `rosbags`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import FIELDS, Kind
from ..json_lines import error_codes
from .cdr import Encoder
from .diagnostics import diagnostic_status
from .hardware_status import devices
from .naming import DIAGNOSTICS
from .naming import HARDWARE_STATUS as HARDWARE_STATUS_TOPIC

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ...interface import RobotStatusMsg
    from .diagnostics import DiagnosticStatus
    from .hardware_status import Device
    from .settings import Ros2Settings

LAST_SECOND: Final = 2**31 - 1  # builtin_interfaces/msg/Time counts seconds as int32: until 2038


class MessageType(NamedTuple):
    """A type of message."""

    package: str
    name: str
    hash: str

    @property
    def ros_name(self) -> str:
        """As ROS writes it: `industrial_msgs/msg/RobotStatus`."""
        return f"{self.package}/msg/{self.name}"

    @property
    def dds_name(self) -> str:
        """As DDS writes it: `industrial_msgs::msg::dds_::RobotStatus_`."""
        return f"{self.package}::msg::dds_::{self.name}_"


ROBOT_STATUS: Final = MessageType(
    "industrial_msgs", "RobotStatus", "RIHS01_0983f918a5b3fee8384138cb62b4b125ed17a0fde53d6229cd4a77d11d47d6f5"
)
DIAGNOSTIC_ARRAY: Final = MessageType(
    "diagnostic_msgs", "DiagnosticArray", "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
)

HARDWARE_STATUS: Final = MessageType(
    "control_msgs", "HardwareStatus", "RIHS01_d4d081efebdea6d8863855733ea95c58338ac4ffdb501a9524da4cbbad9927a2"
)


def kind_of(topic: str, settings: Ros2Settings) -> MessageType | None:
    """What the gateway publishes on a topic; None if it publishes nothing there."""
    if topic == DIAGNOSTICS:
        return DIAGNOSTIC_ARRAY
    kinds = {settings.topic: ROBOT_STATUS, HARDWARE_STATUS_TOPIC: HARDWARE_STATUS}
    return kinds.get(topic.rpartition("/")[2])


def robot_status(msg: RobotStatusMsg) -> bytes:
    """industrial_msgs/msg/RobotStatus.

    ORIGINAL: leaves frame_id empty. Here it is the handle, because a gateway has several robots.
    """
    encoder = Encoder()
    _header(encoder, msg.unix_us, msg.handle)
    for field, value in zip(FIELDS, msg.status, strict=True):
        if field.row.ros2 is None:
            continue
        if field.kind is Kind.CODE:
            encoder.int32_sequence(error_codes(msg.status, msg.detail))
        else:
            encoder.int8(value)
    return encoder.payload()


def diagnostic_array(msg: RobotStatusMsg) -> bytes:
    """diagnostic_msgs/msg/DiagnosticArray with the one DiagnosticStatus of this handle."""
    encoder = Encoder()
    _header(encoder, msg.unix_us, "")
    encoder.uint32(1)
    _diagnostic_status(encoder, diagnostic_status(msg))
    return encoder.payload()


def hardware_status(msg: RobotStatusMsg, latest: Mapping[str, RobotStatusMsg]) -> bytes:
    """control_msgs/msg/HardwareStatus of a robot, or of a group. `latest` has the messages of its members by handle."""
    encoder = Encoder()
    _header(encoder, msg.unix_us, msg.handle)
    encoder.string(msg.handle)
    found = devices(msg, latest)
    encoder.uint32(len(found))
    for one in found:
        _device(encoder, one)
    return encoder.payload()


def _device(encoder: Encoder, one: Device) -> None:
    _header(encoder, one.unix_us, one.device_id)
    encoder.string(one.device_id)
    encoder.uint32(1)  # its GenericHardwareState
    encoder.octet(one.health_status)
    encoder.octet_sequence(one.error_domain)
    for number in (one.operational_mode, one.power_state, one.connectivity_status):
        encoder.octet(number)
    for text in (one.manufacturer, one.model, one.firmware_version):
        encoder.string(text)
    _key_values(encoder, one.state_details)
    for _ in ("canopen_states", "ethercat_states", "vda5050_states"):
        encoder.uint32(0)


def _header(encoder: Encoder, unix_us: int, frame_id: str) -> None:
    """std_msgs/msg/Header. A time that int32 seconds cannot express becomes the nearest one that they can."""
    seconds, us = divmod(unix_us, 1_000_000)
    encoder.int32(min(max(seconds, 0), LAST_SECOND))
    encoder.uint32(us * 1000)
    encoder.string(frame_id)


def _diagnostic_status(encoder: Encoder, status: DiagnosticStatus) -> None:
    encoder.octet(status.level)
    encoder.string(status.name)
    encoder.string(status.message)
    encoder.string(status.hardware_id)
    _key_values(encoder, status.values)


def _key_values(encoder: Encoder, values: Sequence[tuple[str, str]]) -> None:
    encoder.uint32(len(values))
    for key, value in values:
        encoder.string(key)
        encoder.string(value)
