"""The numbers in a record. A damaged or strange log can hold any value under any name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .record import Value

Values = Mapping[str, "Value"]


def number(values: Values, *names: str) -> float:
    """The first of these members that is a finite number; NaN if none is."""
    for name in names:
        value = values.get(name)
        if isinstance(value, int | float) and math.isfinite(value):
            return value
    return math.nan


def whole(values: Values, *names: str) -> int:
    """The first of these members that is a whole number; -1 if none is."""
    found = number(values, *names)
    return int(found) if math.isfinite(found) else -1
