"""The contract of hardware interfaces, controllers and publishers; see `fields`, `status`, `handle`, `hardware`."""

from .controller import Controller
from .fields import FIELDS, STATES, TRI_STATES, Field, Kind, RobotMode, RobotStatus, TriState
from .handle import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle
from .hardware import HardwareContext, HardwareInterface, IoSource, RobotHW
from .metrics import ConnectionMetrics, Metrics, PublisherMetrics
from .options import Option, Options
from .publisher import Audience, MavlinkPort, Publisher, PublisherContext
from .registry import IndustrialRobotStatusInterface, InterfaceManager
from .status import (
    GROUP,
    Detail,
    ErrorCause,
    Evidence,
    Inhibit,
    LinkState,
    NotReady,
    RobotStatusMsg,
    Vehicle,
)
from .validation import validate

__all__ = [
    "DEFAULT_HANDLE_NAME",
    "FIELDS",
    "GROUP",
    "STATES",
    "TRI_STATES",
    "Audience",
    "ConnectionMetrics",
    "Controller",
    "Detail",
    "ErrorCause",
    "Evidence",
    "Field",
    "HardwareContext",
    "HardwareInterface",
    "IndustrialRobotStatusHandle",
    "IndustrialRobotStatusInterface",
    "Inhibit",
    "InterfaceManager",
    "IoSource",
    "Kind",
    "LinkState",
    "MavlinkPort",
    "Metrics",
    "NotReady",
    "Option",
    "Options",
    "Publisher",
    "PublisherContext",
    "PublisherMetrics",
    "RobotHW",
    "RobotMode",
    "RobotStatus",
    "RobotStatusMsg",
    "TriState",
    "Vehicle",
    "validate",
]
