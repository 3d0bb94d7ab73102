"""Several values of one field as one, by three-valued logic: of the members of a group, or of speakers that differ."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from ..interface import TriState


class Logic(Enum):
    """How several values become one. UNKNOWN without values."""

    ANY = "any"
    """TRUE if one is TRUE, FALSE if all are FALSE: Kleene's OR."""
    ALL = "all"
    """TRUE if all are TRUE, FALSE if one is FALSE: Kleene's AND."""
    AGREE = "agree"
    """The value of all, if they agree."""


DECISIVE = {Logic.ANY: TriState.TRUE, Logic.ALL: TriState.FALSE, Logic.AGREE: None}
"""The value that one is enough for."""


def join(logic: Logic, values: Iterable[TriState]) -> TriState:
    """The value of all. What one value cannot decide must be the same in all of them."""
    found = set(values)
    decisive = DECISIVE[logic]
    if decisive is not None and decisive in found:
        return decisive
    return found.pop() if len(found) == 1 else TriState.UNKNOWN
