"""From payloads to messages, for the messages of `definitions`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from .definitions import MESSAGES

Reader = tuple[type, int, "Callable[..., tuple[Any, ...]]"]
"""The reader of one message: its type, the bytes up to the last known field, and the function that unpacks the known
fields of a payload from an offset on.

The caller fills a short payload with zeros: MAVLink 2 removes trailing zeros, and an older definition lacks extension
fields. Bytes beyond the layout (a newer definition) are ignored. A plain tuple unpacks in a third of the time.
"""

READERS: Final[dict[int, Reader]] = {d.id: (d.type, d.layout.size, d.layout.unpack_from) for d in MESSAGES.values()}
"""By message id, for all of MESSAGES."""


def text(raw: bytes) -> str:
    """The text in a char array, up to the first NUL. Bytes that are not UTF-8 become U+FFFD."""
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
