"""STATUSTEXT transport: long texts come in chunks of 50 characters, and chunks get lost.

MAVLink, common.xml: id 0 is a complete text; otherwise chunks are numbered from 0, and one that holds a NUL is the
last. PX4 gives every text an id, and ends those that also exist as EVENT with a TAB. INAV pads with blanks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ....clock import Instant
    from ....mavlink.definitions import Statustext

CHUNK: Final = 50
PATIENCE: Final = 2.0
"""Seconds without a further chunk after which an incomplete text is used."""
MOST_CHUNKS: Final = 32
MOST_TEXTS: Final = 4
"""Limit of unfinished texts of one vehicle. When one more begins, the oldest is used as it is."""
HOLE: Final = "..."


class Text(NamedTuple):
    """A text, or the part that arrived."""

    severity: int
    text: str
    at: Instant
    """When its first chunk arrived."""


class Partial(NamedTuple):
    """A text with missing chunks."""

    severity: int
    chunks: Mapping[int, str]
    last: int | None
    """The number of the last chunk, once it is known."""
    first_at: Instant
    at: float


TextAssembly = tuple[tuple[int, Partial], ...]
"""The unfinished texts by id, oldest first."""

EMPTY: Final[TextAssembly] = ()


def heard_chunk(assembly: TextAssembly, message: Statustext, now: Instant) -> tuple[TextAssembly, list[Text]]:
    """The unfinished texts after one more message, and the texts that it completes or ends."""
    raw, nul, _ = message.text.partition(b"\0")
    piece = raw.decode("utf-8", "replace")
    if message.id == 0:
        return assembly, _texts([Text(message.severity, piece, now)])
    finished: list[Text] = []
    others = list(assembly)
    partial = next((p for n, p in assembly if n == message.id), None)
    if partial is not None:
        others = [(n, p) for n, p in others if n != message.id]
        if partial.chunks.get(message.chunk_seq, piece) != piece or partial.severity != message.severity:
            finished += _as_it_is(partial)  # the id was reused for another text
            partial = None
    if message.chunk_seq >= MOST_CHUNKS:
        return (*others, (message.id, partial)) if partial else tuple(others), _texts(finished)
    partial = partial or Partial(message.severity, {}, None, now, now.mono)
    partial = partial._replace(
        chunks={**partial.chunks, message.chunk_seq: piece},
        last=message.chunk_seq if nul else partial.last,
        at=now.mono,
    )
    if partial.last is not None and all(n in partial.chunks for n in range(partial.last + 1)):
        finished += _as_it_is(partial)
    else:
        others.append((message.id, partial))
    while len(others) > MOST_TEXTS:
        finished += _as_it_is(others.pop(0)[1])
    return tuple(others), _texts(finished)


def overdue(assembly: TextAssembly, now: float) -> tuple[TextAssembly, list[Text]]:
    """The unfinished texts at `now`, and those that have waited long enough, as they are."""
    waiting = tuple((n, p) for n, p in assembly if now < p.at + PATIENCE)
    if len(waiting) == len(assembly):
        return assembly, []
    return waiting, _texts([t for _, p in assembly if now >= p.at + PATIENCE for t in _as_it_is(p)])


def _as_it_is(partial: Partial) -> list[Text]:
    """The text with gaps; none if its start is missing, because rules match the start."""
    if 0 not in partial.chunks:
        return []
    highest = max(partial.chunks) if partial.last is None else partial.last
    pieces = [partial.chunks.get(n, HOLE) for n in range(highest + 1)]
    if partial.last is None:
        pieces.append(HOLE)
    return [Text(partial.severity, "".join(pieces), partial.first_at)]


def _texts(texts: list[Text]) -> list[Text]:
    """Remove trailing blanks and TABs, and empty texts."""
    return [t for t in (text._replace(text=text.text.rstrip()) for text in texts) if t.text]
