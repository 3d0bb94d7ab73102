"""Text in terminal cells: spans with a style name, clipped and padded to a width."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from ...streams import visible

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

Style = Literal["", "soft", "bold", "head", "chosen", "on", "unknown", "stop", "alarm", "cause", "warning"]
"""The meaning of a span. `paint` defines its look. The text alone has the same information."""


class Span(NamedTuple):
    """Text of one style."""

    text: str
    style: Style = ""


Line = tuple[Span, ...]


class Glyphs(NamedTuple):
    """The symbols, each one cell wide."""

    yes: str = "●"
    no: str = "○"
    unknown: str = "?"
    chosen: str = "▶"
    lost: str = "✗"
    rule: str = "─"
    more: str = "…"
    utf8: bool = True


UNICODE: Final = Glyphs()
ASCII: Final = Glyphs("*", "-", "?", ">", "x", "-", "~", utf8=False)
"""For a terminal without UTF-8."""


def clean(text: object) -> str:
    """Untrusted text as one line of visible text without marks of zero width."""
    known = visible(text)
    if known.isascii():
        return known
    composed = unicodedata.normalize("NFC", known)
    return "".join(c for c in composed if unicodedata.category(c) not in ("Mn", "Me"))


def cells(text: str) -> int:
    """The width of a clean text, in cells."""
    return len(text) if text.isascii() else sum(_cells(character) for character in text)


def _cells(character: str) -> int:
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1


def head(text: str, width: int) -> str:
    """The longest prefix of at most `width` cells."""
    room = width
    for i, character in enumerate(text):
        room -= _cells(character)
        if room < 0:
            return text[:i]
    return text


def clip(text: str, width: int, glyphs: Glyphs = UNICODE) -> str:
    """The text in at most `width` cells. A mark shows a cut."""
    if cells(text) <= width:
        return text
    return head(text, width - 1) + glyphs.more if width > 0 else ""


def fill(text: str, width: int, glyphs: Glyphs = UNICODE) -> str:
    """The text in exactly `width` cells."""
    clipped = clip(text, width, glyphs)
    return clipped + " " * (width - cells(clipped))


def fill_line(spans: Iterable[Span], width: int, glyphs: Glyphs = UNICODE) -> Line:
    """The spans in exactly `width` cells."""
    line: list[Span] = []
    room = width
    for text, style in spans:
        if room <= 0:
            break
        clipped = clip(text, room, glyphs) if text.strip() else text[:room]
        line.append(Span(clipped, style))
        room -= cells(clipped)
        if clipped != text:
            break
    return (*line, Span(" " * room)) if room > 0 else tuple(line)


def wrap(text: str, width: int) -> Iterator[str]:
    """The text in lines of at most `width` cells, broken at spaces where possible."""
    line = ""
    for word in text.split(" "):
        if line and cells(line) + 1 + cells(word) <= width:
            line += " " + word
            continue
        if line:
            yield line
        while cells(word) > width > 1:
            part = head(word, width)
            yield part
            word = word[len(part) :]
        line = word
    yield line


def plain(line: Line) -> str:
    """The line without its styles."""
    return "".join(span.text for span in line)


def encode(text: str, glyphs: Glyphs) -> bytes:
    """The bytes for the terminal. They have the width of the text."""
    if glyphs.utf8:
        return text.encode("utf-8", "replace")
    return "".join(c if c.isascii() else "?" * _cells(c) for c in text).encode("ascii")
