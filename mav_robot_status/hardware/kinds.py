"""What is done with each kind of message, found by one look-up of its id."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ..mavlink import definitions as mav
from . import horizon
from .hearing import HANDLERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from .hearing import Handler
    from .horizon import Part
    from .memory import Memory
    from .motion import Motion

    Kind = tuple[type, Handler, Part | None, Callable[[Memory], Motion] | None]

HEARTBEAT_ID: Final = 0
COMMAND_IDS: Final = frozenset({75, 76})  # COMMAND_INT, COMMAND_LONG: heard from others
WANTED_IDS: Final = frozenset(d.id for d in mav.MESSAGES.values() if d.type in HANDLERS) | COMMAND_IDS


KINDS: Final[dict[int, Kind]] = {
    d.id: (d.type, HANDLERS[d.type], horizon.PARTS.get(d.type), horizon.MOTIONS.get(d.type))
    for d in mav.MESSAGES.values()
    if d.type in HANDLERS
}
"""How the messages of one type are heard: that type, its handler, what of all that matters it can change (None:
anything), and the motion that it may begin or end a while later. A plain tuple is taken apart in a third of the time.
"""
