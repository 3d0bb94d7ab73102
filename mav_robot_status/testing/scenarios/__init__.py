"""Scenarios that come along: `ardurover.BOOT`, `arducopter.CRASH`, `px4.KILL`, ..., and `DEMO`.

`BY_NAME` has all of them under names as `ardurover/boot`.
"""

from __future__ import annotations

from ..scenario import Scenario
from . import arducopter, ardurover, px4
from .demo import DEMO

BY_NAME: dict[str, Scenario] = {"demo": DEMO} | {
    f"{module.__name__.rpartition('.')[2]}/{name.lower().replace('_', '-')}": value
    for module in (ardurover, arducopter, px4)
    for name, value in vars(module).items()
    if isinstance(value, Scenario)
}

__all__ = ["BY_NAME", "DEMO", "arducopter", "ardurover", "px4"]
