"""From a frame to its message, for the few messages that we read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from .definitions import MESSAGES

if TYPE_CHECKING:
    from .framing import Frame


READERS: Final = {d.id: (d.type, d.layout.size, d.layout.unpack) for d in MESSAGES.values()}
new: Final = tuple.__new__  # as in `framing`


def decode(frame: Frame) -> Any:
    """The message in a frame: one of the NamedTuples of `definitions`, or None if the id is not in MESSAGES.

    A payload that MAVLink 2 trimmed, or that an older definition without the extension fields made shorter, is filled
    up with zeros; bytes beyond the layout (a newer definition) are ignored. Never raises.
    """
    reader = READERS.get(frame.message_id)
    if reader is None:
        return None
    kind, size, unpack = reader
    payload = frame.payload
    if len(payload) != size:
        payload = payload[:size].ljust(size, b"\0")
    return new(kind, unpack(payload))


def text(raw: bytes) -> str:
    """The text in a char array: up to the first NUL, if there is one; what is not UTF-8 becomes U+FFFD."""
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
