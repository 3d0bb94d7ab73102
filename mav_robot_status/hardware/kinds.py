"""What is done with each kind of message, found by one look-up of its id."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ..mavlink import definitions as mav
from . import horizon
from .hearing import HANDLERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from .hearing import Handler
    from .horizon import Part
    from .memory import Memory
    from .motion import Motion

HEARTBEAT_ID: Final = 0
COMMAND_IDS: Final = frozenset({75, 76})  # COMMAND_INT, COMMAND_LONG: heard from others
WANTED_IDS: Final = frozenset(d.id for d in mav.MESSAGES.values() if d.type in HANDLERS) | COMMAND_IDS


class Kind(NamedTuple):
    """How the messages of one type are heard."""

    type: type
    handler: Handler
    part: Part | None
    """What it can change of all that matters; None: anything."""
    motion: Callable[[Memory], Motion] | None
    """What it may begin or end a while later."""


KINDS: Final = {
    d.id: Kind(d.type, HANDLERS[d.type], horizon.PARTS.get(d.type), horizon.MOTIONS.get(d.type))
    for d in mav.MESSAGES.values()
    if d.type in HANDLERS
}
