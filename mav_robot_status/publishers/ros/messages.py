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

if TYPE_CHECKING:
    from ...interface import RobotStatusMsg
    from .diagnostics import DiagnosticStatus

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


def robot_status(msg: RobotStatusMsg) -> bytes:
    """industrial_msgs/msg/RobotStatus. frame_id is the name of the handle."""
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
    encoder.uint32(len(status.values))
    for key, value in status.values:
        encoder.string(key)
        encoder.string(value)
