"""The ready scenarios: `ardurover.BOOT`, `arducopter.CRASH`, `px4.KILL`, ..., and `DEMO`.

`BY_NAME` has all of them by name, for example `ardurover/boot`.
"""

from __future__ import annotations

from ..scenario import Scenario
from . import (
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
from .demo import DEMO

MODULES = (
    ardurover,
    arducopter,
    px4,
    arduplane,
    quadplane,
    ardusub,
    arduboat,
    tracker,
    blimp,
    px4_vtol,
    inav,
    betaflight,
)

BY_NAME: dict[str, Scenario] = {"demo": DEMO} | {
    f"{module.__name__.rpartition('.')[2]}/{name.lower().replace('_', '-')}": value
    for module in MODULES
    for name, value in vars(module).items()
    if isinstance(value, Scenario)
}

__all__ = [
    "BY_NAME",
    "DEMO",
    "arduboat",
    "arducopter",
    "arduplane",
    "ardurover",
    "ardusub",
    "betaflight",
    "blimp",
    "inav",
    "px4",
    "px4_vtol",
    "quadplane",
    "tracker",
]
