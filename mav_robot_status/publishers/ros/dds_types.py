"""The ROS 2 messages as IDL types of Cyclone DDS. Other participants compare them with their own.

ROS 2 maps a definition to IDL like this: `final`, in `<package>::msg::dds_`, with an underscore after its name.
"""

from __future__ import annotations

from typing import Any, Final

from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import byte, float64, int8, int32, sequence, uint8, uint16, uint32


def _struct(package: str, name: str, /, **fields: Any) -> Any:
    return final(make_idl_struct(name, f"{package}.msg.dds_.{name}_", fields))


_TIME: Final = _struct("builtin_interfaces", "Time", sec=int32, nanosec=uint32)
_HEADER: Final = _struct("std_msgs", "Header", stamp=_TIME, frame_id=str)
_MODE: Final = _struct("industrial_msgs", "RobotMode", val=int8)
_TRI_STATE: Final = _struct("industrial_msgs", "TriState", val=int8)
_KEY_VALUE: Final = _struct("diagnostic_msgs", "KeyValue", key=str, value=str)
_DIAGNOSTIC_STATUS: Final = _struct(
    "diagnostic_msgs",
    "DiagnosticStatus",
    level=byte,
    name=str,
    message=str,
    hardware_id=str,
    values=sequence[_KEY_VALUE],
)
_GENERIC: Final = _struct(
    "control_msgs",
    "GenericHardwareState",
    health_status=uint8,
    error_domain=sequence[uint8],
    operational_mode=uint8,
    power_state=uint8,
    connectivity_status=uint8,
    manufacturer=str,
    model=str,
    firmware_version=str,
    state_details=sequence[_KEY_VALUE],
)
_CANOPEN: Final = _struct(
    "control_msgs", "CANopenState", node_id=uint8, nmt_state=uint8, dsp_402_state=uint8, last_emcy_code=uint32
)
_ETHERCAT: Final = _struct(
    "control_msgs",
    "EtherCATState",
    slave_position=uint16,
    vendor_id=str,
    product_code=str,
    al_state=uint8,
    has_error=bool,
    al_status_code=uint16,
)
_VDA5050: Final = _struct(
    "control_msgs",
    "VDA5050State",
    order_id=str,
    action_status=str,
    last_node_id=uint32,
    driving=bool,
    battery_charge=float64,
    operating_mode=str,
    error_type=str,
    error_description=str,
)
_DEVICE: Final = _struct(
    "control_msgs",
    "HardwareDeviceStatus",
    header=_HEADER,
    device_id=str,
    hardware_status=sequence[_GENERIC],
    canopen_states=sequence[_CANOPEN],
    ethercat_states=sequence[_ETHERCAT],
    vda5050_states=sequence[_VDA5050],
)
TYPES: Final[dict[str, Any]] = {
    "RobotStatus": _struct(
        "industrial_msgs",
        "RobotStatus",
        header=_HEADER,
        mode=_MODE,
        e_stopped=_TRI_STATE,
        drives_powered=_TRI_STATE,
        motion_possible=_TRI_STATE,
        in_motion=_TRI_STATE,
        in_error=_TRI_STATE,
        error_codes=sequence[int32],
    ),
    "DiagnosticArray": _struct(
        "diagnostic_msgs", "DiagnosticArray", header=_HEADER, status=sequence[_DIAGNOSTIC_STATUS]
    ),
    "HardwareStatus": _struct(
        "control_msgs",
        "HardwareStatus",
        header=_HEADER,
        hardware_id=str,
        hardware_device_states=sequence[_DEVICE],
    ),
}
"""By the name of the message type."""


def encoded(kind: Any, payload: bytes) -> Any:
    """A sample of an IDL type whose bytes are known: the writer asks for nothing else."""
    sample = object.__new__(kind)
    sample.serialize = lambda **_: payload
    return sample
