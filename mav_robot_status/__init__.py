"""RobotStatus of MAVLink vehicles: can it move, who commands it, and if it cannot move, why?

    from mav_robot_status import TriState, statuses

    for msg in statuses("udp:127.0.0.1:14550"):
        if msg.status.motion_possible is TriState.TRUE:
            print(msg.handle, "can move")

The public parts are the names below, `interface` (what hardware interfaces, links, controllers and publishers
implement), `controller`, `errors` and `testing` (a fake autopilot and conformance tests). The status informs. It is not
a safety function.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Final

from .version import __version__

if TYPE_CHECKING:
    from .api import Statuses, statuses
    from .errors import MavRobotStatusError
    from .interface import (
        Detail,
        ErrorCause,
        Inhibit,
        LinkState,
        RobotMode,
        RobotStatus,
        RobotStatusMsg,
        TriState,
        Vehicle,
        validate,
    )

__all__ = [
    "Detail",
    "ErrorCause",
    "Inhibit",
    "LinkState",
    "MavRobotStatusError",
    "RobotMode",
    "RobotStatus",
    "RobotStatusMsg",
    "Statuses",
    "TriState",
    "Vehicle",
    "__version__",
    "statuses",
    "validate",
]

_ELSEWHERE: Final = {"statuses": "api", "Statuses": "api", "MavRobotStatusError": "errors"}
"""Modules of names that `interface` does not have."""


def __getattr__(name: str) -> object:
    """Import a public name when it is first used: the command starts without the parts that it does not need."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(importlib.import_module(f".{_ELSEWHERE.get(name, 'interface')}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
