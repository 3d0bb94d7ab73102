"""The contract that hardware interfaces and controllers share; see `status`, `handle`, `registry`."""

from .handle import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle
from .metrics import ConnectionMetrics, Metrics, PublisherMetrics
from .publisher import Audience, MavlinkPort, Publisher, PublisherContext
from .registry import IndustrialRobotStatusInterface, InterfaceManager, RobotHW
from .status import (
    Detail,
    ErrorCause,
    Evidence,
    Inhibit,
    LinkState,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)

__all__ = [
    "DEFAULT_HANDLE_NAME",
    "Audience",
    "ConnectionMetrics",
    "Detail",
    "ErrorCause",
    "Evidence",
    "IndustrialRobotStatusHandle",
    "IndustrialRobotStatusInterface",
    "Inhibit",
    "InterfaceManager",
    "LinkState",
    "MavlinkPort",
    "Metrics",
    "Publisher",
    "PublisherContext",
    "PublisherMetrics",
    "RobotHW",
    "RobotMode",
    "RobotStatus",
    "RobotStatusMsg",
    "TriState",
    "Vehicle",
]
