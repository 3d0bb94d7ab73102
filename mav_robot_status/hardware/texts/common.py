"""Texts that say nothing about an error whatever their severity and whoever says them."""

from __future__ import annotations

from typing import Final

from . import Effect, table

RULES: Final = table(
    [
        (r".*(cleared|Cleared|disengaged|regained|denied|not available|Unsupported| OK|complete)", Effect.IGNORE),
        # seen at severity 1 or 2 on good flights
        (r"Initialising APM|GROUND START|Calibrating |Calibration |command received|Place vehicle", Effect.IGNORE),
        (r"ODOMETRY: |Not enough bandwidth|System does not support", Effect.IGNORE),
    ]
)
