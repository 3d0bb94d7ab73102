"""A fake autopilot and a manual clock, for our tests, for your tests, and for the demo.

    >>> import socket
    >>> from mav_robot_status.testing import FakeAutopilot, ardurover, decode
    >>> with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gateway:  # here: the program that you test
    ...     gateway.bind(("127.0.0.1", 0))
    ...     with FakeAutopilot(ardurover.READY, to=gateway.getsockname()) as autopilot:
    ...         autopilot.arm()
    ...         print(decode(gateway.recv(300))[0].get_type())
    HEARTBEAT

Scenarios are data: `scenarios` has ready ones; build others with `step` and `Scenario`. For tests without waits, call
`FakeAutopilot.poll` with the instants of a `ManualClock` instead of using `with`.
"""

from .codec import decode
from .event_table import VehicleFiles, event_files
from .fake_autopilot import FakeAutopilot
from .lossy import Lossy
from .manual_clock import ManualClock
from .scenario import Action, Scenario, Step, Text, VehicleState, step, with_applet
from .scenarios import (
    BY_NAME,
    DEMO,
    arduboat,
    arducopter,
    arduplane,
    ardurover,
    ardusub,
    betaflight,
    blimp,
    inav,
    px4,
    px4_vtol,
    quadplane,
    tracker,
)

__all__ = [
    "BY_NAME",
    "DEMO",
    "Action",
    "FakeAutopilot",
    "Lossy",
    "ManualClock",
    "Scenario",
    "Step",
    "Text",
    "VehicleFiles",
    "VehicleState",
    "arduboat",
    "arducopter",
    "arduplane",
    "ardurover",
    "ardusub",
    "betaflight",
    "blimp",
    "decode",
    "event_files",
    "inav",
    "px4",
    "px4_vtol",
    "quadplane",
    "step",
    "tracker",
    "with_applet",
]
