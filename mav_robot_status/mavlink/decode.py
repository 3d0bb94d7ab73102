"""From a payload to its message, for the few messages that we read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from .definitions import MESSAGES

if TYPE_CHECKING:
    from collections.abc import Callable


Reader = tuple[type, int, "Callable[..., tuple[Any, ...]]"]
"""How one kind of message is read: its type, the bytes up to the last field that we know, and what unpacks the known
fields of a payload, from an offset on.

A payload that MAVLink 2 trimmed, or that an older definition without the extension fields made shorter, is filled up
with zeros before; bytes beyond the layout (a newer definition) are ignored. A plain tuple is taken apart in a third of
the time.
"""

READERS: Final[dict[int, Reader]] = {d.id: (d.type, d.layout.size, d.layout.unpack_from) for d in MESSAGES.values()}
"""By message id: for those in MESSAGES."""


def text(raw: bytes) -> str:
    """The text in a char array: up to the first NUL, if there is one; what is not UTF-8 becomes U+FFFD."""
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
