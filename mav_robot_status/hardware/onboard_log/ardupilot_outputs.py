"""Whether a motor output of an ArduPilot is driven: RCOU with the parameters that the log holds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from ..mavlink.identity import Family
from .state import FALSE, TRUE, UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...interface import TriState
    from .record import Value

MOTORS: Final = frozenset({31, *range(33, 41), 70, 73, 74, *range(82, 86), *range(160, 180)})
"""SERVOn_FUNCTION: the rotor of a helicopter, motors, throttles."""
HELICOPTER_MOTORS: Final = frozenset({31})
"""The others may move its swash plate."""
THROTTLES: Final = frozenset({70, 73, 74})
HELICOPTER: Final = 4  # MAV_TYPE
REVERSIBLE: Final = frozenset({Family.ROVER, Family.SUB})
OFF_STOP: Final = 25
"""Microseconds from the stop value from which an output is driven."""
LEAST_PULSE: Final = 800
"""A shorter pulse is no pulse."""
LOWEST: Final = 1000
PARAMETER: Final = re.compile(r"SERVO(\d{1,2})_(FUNCTION|MIN|TRIM|REVERSED|MAX)")
LAST_CHANNEL: Final = 14
"""Of RCOU."""


class Outputs:
    """The motor outputs of one vehicle."""

    def __init__(self) -> None:
        self._settings: dict[tuple[int, str], float] = {}
        self._least: float = LOWEST
        self._family: Family | None = None
        self._motors = MOTORS
        self._learnt: dict[int, float] = {}
        """The stop values at the start of the autopilot, while it was disarmed."""

    def kind(self, family: Family, vehicle_type: int) -> None:
        """What the vehicle is."""
        self._family = family
        self._motors = HELICOPTER_MOTORS if vehicle_type == HELICOPTER else MOTORS

    def parameter(self, name: str, value: float) -> None:
        """A parameter. Those that say nothing of outputs are ignored."""
        found = PARAMETER.fullmatch(name)
        if found and int(found[1]) <= LAST_CHANNEL:
            self._settings[int(found[1]), found[2]] = value
        elif name in ("MOT_PWM_MIN", "Q_M_PWM_MIN") and value >= LEAST_PULSE:
            self._least = value

    def heard(self, values: Mapping[str, Value], learns: bool) -> TriState:
        """Whether a motor is driven; UNKNOWN if no output is known to be one. `learns`: it is at rest since boot."""
        known = False
        for channel in range(1, LAST_CHANNEL + 1):
            pulse = values.get(f"C{channel}", values.get(f"Ch{channel}"))
            function = self._settings.get((channel, "FUNCTION"))
            if function is None or function not in self._motors or not isinstance(pulse, int | float):
                continue
            known = True
            if pulse < LEAST_PULSE:
                continue
            if learns:
                self._learnt.setdefault(channel, pulse)
            stop = self._learnt.get(channel, self._stop(channel, function))
            if abs(pulse - stop) > OFF_STOP:
                return TRUE
        return FALSE if known else UNKNOWN

    def _stop(self, channel: int, function: float) -> float:
        """The pulse of a motor that stands, by the parameters."""
        if self._family in REVERSIBLE:
            return self._settings.get((channel, "TRIM"), 1500.0)
        if function in THROTTLES or function in HELICOPTER_MOTORS:
            reversed_ = self._settings.get((channel, "REVERSED"), 0.0)
            return self._settings.get((channel, "MAX" if reversed_ else "MIN"), LOWEST)
        return self._least
