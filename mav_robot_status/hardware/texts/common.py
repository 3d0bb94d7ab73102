"""Texts that say nothing about an error whatever their severity and whoever says them."""

from __future__ import annotations

from typing import Final

from . import Effect, table

RULES: Final = table(
    [(r".*(cleared|Cleared|disengaged|regained|denied|not available|Unsupported| OK|complete)", Effect.IGNORE)]
)
