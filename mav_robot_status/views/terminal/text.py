"""Text in terminal cells: spans with a style, clipped and padded to a width. Untrusted text is cleaned here."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator
from datetime import datetime
from typing import NamedTuple

from ...language import TONES, Look, State, Tone
from ...streams import visible


class Span(NamedTuple):
    """Text of one style."""

    text: str
    style: str = ""
    """In rich's words: `bold cyan`. The text alone has the same information."""


Line = tuple[Span, ...]


class Signs(NamedTuple):
    """Which symbols a terminal can show."""

    utf8: bool = True

    def of(self, look: Look, width: int = 99) -> Span:
        """A value: its symbol, its tone, and its word, which is the short one if the whole one does not fit."""
        word = look.word if len(look.word) + 2 <= width else look.short or look.word
        return toned(f"{self.symbol(look)} {word}", look.tone)

    def symbol(self, look: Look | State) -> str:
        """The symbol of a value or of a state."""
        return look.glyph if self.utf8 else look.ascii

    def text(self, text: object) -> str:
        """Untrusted text as this terminal can show it."""
        known = clean(text)
        if self.utf8 or known.isascii():
            return known
        known = known.replace("“", '"').replace("”", '"').replace(CUT, ".")
        return "".join(c if c.isascii() else "?" * _cells(c) for c in known)


CUT = "…"


def toned(text: str, tone: Tone) -> Span:
    """Text in the colour of a tone."""
    return Span(text, TONES[tone].terminal)


def clean(text: object) -> str:
    """Untrusted text as one line of visible text without marks of zero width."""
    known = visible(text)
    if known.isascii():
        return known
    composed = unicodedata.normalize("NFC", known)
    return "".join(c for c in composed if unicodedata.category(c) not in ("Mn", "Me"))


def cells(text: str) -> int:
    """The width of a clean text, in cells."""
    return len(text) if text.isascii() else sum(map(_cells, text))


def _cells(character: str) -> int:
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1


def fill(text: str, width: int) -> str:
    """The text in exactly `width` cells. Three dots in one cell show a cut; `plain` writes them without UTF-8."""
    if width < 1:
        return ""
    if cells(text) > width:
        room, text = width - 1, text + " "
        end = next(i for i, _ in enumerate(text) if cells(text[: i + 1]) > room)
        text = text[:end] + CUT
    return text + " " * (width - cells(text))


def padded(span: Span, width: int) -> Line:
    """A span in exactly `width` cells. The spaces after its text, at least one, have no style."""
    text = fill(span.text.rstrip(), width - 1).rstrip()
    return Span(text, span.style), Span(" " * (width - cells(text)))


def wrap(line: Line, width: int) -> Iterator[Line]:
    """The words of a line in lines of at most `width` cells. The later ones begin with two spaces."""
    words = [Span(part, span.style) for span in line for part in _words(span.text)]
    shown: list[Span] = []
    room = width
    for word in words:
        if cells(word.text.rstrip()) > room and shown:
            yield tuple(shown)
            shown, room = [Span("  ")], width - 2
        text = word.text if cells(word.text) <= room else fill(word.text.rstrip(), room).rstrip()
        shown.append(Span(text, word.style))
        room = max(0, room - cells(text))
    yield tuple(shown)


def _words(text: str) -> Iterable[str]:
    """Each word with the spaces after it."""
    begin = 0
    for i in range(1, len(text)):
        if text[i - 1] == " " and text[i] != " ":
            yield text[begin:i]
            begin = i
    yield text[begin:]


def clock(stamp: str) -> str:
    """The time of day of an RFC 3339 stamp, in the time zone of this computer; the stamp, if it is none."""
    try:
        return f"{datetime.fromisoformat(stamp.replace('Z', '+00:00')).astimezone():%H:%M:%S}"
    except (ValueError, OverflowError):
        return stamp


def duration(seconds: float) -> str:
    """`12s`, `3m`, `5h`, `2d`: at most four characters up to 27 years."""
    whole = max(0, int(seconds))
    for unit, size, most in (("s", 1, 100), ("m", 60, 100), ("h", 3600, 48)):
        if whole < size * most:
            return f"{whole // size}{unit}"
    return f"{whole // 86400}d"
