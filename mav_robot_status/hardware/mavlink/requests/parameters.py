"""Reads which outputs drive motors and what the RC switches do: SERVOn_FUNCTION and RCn_OPTION.

Each is requested once, and once more if no answer arrives. The values are kept while the gateway runs. An answer to
somebody else's request counts as well. MAVLink parameter protocol: PARAM_REQUEST_READ by name.
"""

from __future__ import annotations

import math
from typing import Final

from ....mavlink import definitions as mav

# the first four RC channels are the sticks
NAMES: Final = (*(f"SERVO{n}_FUNCTION" for n in range(1, 17)), *(f"RC{n}_OPTION" for n in range(5, 17)))
FIRST: Final = 5.0  # s after the first heartbeat: messages are requested first
APART: Final = 0.4  # s between two requests, so that the answers stay below 100 bytes a second
PATIENCE: Final = 5.0  # s after the last request until the second round
ROUNDS: Final = 2
NO_INDEX: Final = -1  # PARAM_REQUEST_READ.param_index: by name


class Parameters:
    """The reading of one autopilot's parameters. Call `heard` for each of its PARAM_VALUEs."""

    def __init__(self, system: int, component: int, started: float) -> None:
        self._ids = (system, component)
        self._missing = dict.fromkeys(NAMES)
        self._queue = list(NAMES)
        self._round = 1
        self._due = started + FIRST

    def heard(self, name: str) -> None:
        """Note a value that arrived: it need not be requested."""
        self._missing.pop(name, None)

    def outstanding(self) -> list[str]:
        """The names that may still be answered."""
        return [] if self._due == math.inf else list(self._missing)

    def due(self, now: float) -> mav.ParamRequestRead | None:
        """The request to send at `now`, if any."""
        if now < self._due:
            return None
        while self._queue:
            name = self._queue.pop(0)
            if name in self._missing:
                self._due = now + APART
                return mav.ParamRequestRead(NO_INDEX, *self._ids, name.encode())
        if self._missing and self._round < ROUNDS:
            self._round += 1
            self._queue = list(self._missing)
            self._due = now + PATIENCE
        else:
            self._due = math.inf
        return None

    def next_due(self) -> float:
        """When `due` has something to do."""
        return self._due
