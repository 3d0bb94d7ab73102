"""Speed and rotation in the topics of a PX4."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .numbers import Values, number

if TYPE_CHECKING:
    from ...clock import Instant
    from .kinematics import Kinematics
    from .state import LogState


class Px4Motion:
    """What the topics of motion mean. Each returns True if nothing has changed."""

    def __init__(self, state: LogState, moves: Kinematics) -> None:
        self.has_rates = False
        """Whether the log holds vehicle_angular_velocity."""
        self._state = state
        self._moves = moves
        self._attitude: tuple[float, tuple[float, ...]] | None = None

    def position(self, values: Values, now: Instant) -> bool:
        """vehicle_local_position."""
        source = "vehicle_local_position"
        if not (values.get("v_xy_valid") and values.get("v_z_valid")):
            return self._moves.moved(None, source, now)
        parts = [number(values, name) for name in ("vx", "vy", "vz")]
        flat = self._state.family == "rover"
        return self._moves.moved(math.hypot(*parts[: 2 if flat else 3]), f"{source}.vx", now)

    def rotation(self, values: Values, now: Instant) -> bool:
        """vehicle_angular_velocity."""
        rates = values.get("xyz")
        if isinstance(rates, tuple) and all(map(math.isfinite, rates)):
            self._moves.turned(max(map(abs, rates), default=0.0), now)
        return True

    def attitude(self, values: Values, now: Instant) -> bool:
        """vehicle_attitude: the rotation between two records."""
        q = values.get("q")
        if self.has_rates or not isinstance(q, tuple) or not all(map(math.isfinite, q)):
            return True
        before, self._attitude = self._attitude, (now.mono, q)
        if before is not None and now.mono > before[0] and len(before[1]) == len(q):
            dot = min(1.0, abs(sum(a * b for a, b in zip(before[1], q, strict=True))))
            self._moves.turned(2 * math.acos(dot) / (now.mono - before[0]), now)
        return True
