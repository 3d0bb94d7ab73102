"""Deadlines that fit the machine.

A test waits for a condition, never for a fixed time. The wait ends when the condition holds, so a long deadline costs
time only in a test that fails.

Every deadline is written in seconds on an idle machine and multiplied by the slowness of this machine: how many times
longer the command takes to start here than on two idle cores, and at least 1. The slowness is measured when the first
deadline is needed. It is measured again before a deadline counts as missed, because the load changes.
MAV_ROBOT_STATUS_TEST_SLOWNESS=4 in the environment is a lower bound for it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

SOON = 10.0
"""Seconds on an idle machine for anything that should happen at once."""

REFERENCE = 0.15
"""Seconds that `START` takes on two idle cores."""

_EXAMPLE = Path(__file__).parents[1] / "config" / "one_vehicle_udp.yaml"
START = (sys.executable, "-m", "mav_robot_status.cli", "check-config", str(_EXAMPLE))
VARIABLE = "MAV_ROBOT_STATUS_TEST_SLOWNESS"


class _Machine:
    """The slowness of this machine, as far as it was measured."""

    def __init__(self) -> None:
        self._slowness: float | None = None

    @property
    def slowness(self) -> float:
        """At least 1."""
        return self.measure() if self._slowness is None else self._slowness

    def measure(self) -> float:
        """The largest slowness so far, with one more measurement."""
        began = time.monotonic()
        subprocess.run(START, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        found = (time.monotonic() - began) / REFERENCE
        self._slowness = max(found, self._slowness or 1.0, float(os.environ.get(VARIABLE, "1")))
        return self._slowness


_MACHINE = _Machine()


def allow(seconds: float) -> float:
    """What takes this long on an idle machine may take so long here."""
    return seconds * _MACHINE.slowness


def in_time(took: float, seconds: float) -> bool:
    """Whether something took no longer than it may take on this machine."""
    return took <= allow(seconds) or took <= seconds * _MACHINE.measure()


class Deadline:
    """The end of a wait."""

    def __init__(self, seconds: float = SOON) -> None:
        """It begins now; `seconds` are seconds on an idle machine."""
        self._seconds = seconds
        self._began = time.monotonic()

    @property
    def left(self) -> float:
        """Seconds left on this machine; 0.0 when the deadline is missed."""
        passed = time.monotonic() - self._began
        if in_time(passed, self._seconds):
            return max(1e-3, allow(self._seconds) - passed)
        return 0.0


def wait_until(found: Callable[[], T | None], seconds: float = SOON, what: str = "") -> T:
    """The first true value of `found`, which is called every 20 ms. Raises AssertionError after the deadline."""
    deadline = Deadline(seconds)
    while not (result := found()):
        assert deadline.left, what or f"not within {seconds} s on an idle machine, {allow(seconds):.0f} s here"
        time.sleep(0.02)
    return result
