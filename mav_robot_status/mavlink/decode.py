"""From a payload to its message, for the few messages that we read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .definitions import MESSAGES

if TYPE_CHECKING:
    from collections.abc import Callable


class Reader(NamedTuple):
    """How one kind of message is read.

    A payload that MAVLink 2 trimmed, or that an older definition without the extension fields made shorter, is filled
    up with zeros before; bytes beyond the layout (a newer definition) are ignored.
    """

    type: type
    size: int
    """Bytes of all its fields."""
    unpack: Callable[..., tuple[Any, ...]]
    """The fields that are in a payload, from an offset on."""


READERS: Final = {d.id: Reader(d.type, d.layout.size, d.layout.unpack_from) for d in MESSAGES.values()}
"""By message id: for those in MESSAGES."""


def text(raw: bytes) -> str:
    """The text in a char array: up to the first NUL, if there is one; what is not UTF-8 becomes U+FFFD."""
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
