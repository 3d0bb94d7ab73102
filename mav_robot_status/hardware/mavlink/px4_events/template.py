"""The message of an event: a template with arguments and markup, compiled once and filled in for each event.

Source: mavlink/libevents, README ("Message and description") and `ParsedEvent::processMessage`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PROFILE: Final = "dev"
"""The profile whose texts are shown: our readers can use the names of parameters."""
MOST_TEXT: Final = 300
"""Characters of a filled message."""
MOST_DECIMALS: Final = 9
UNITS: Final = {"m": " m", "m_v": " m", "m^2": " m^2", "m/s": " m/s", "C": " °C"}
"""libevents' units, in words. m_v is a vertical distance."""
SLOT: Final = re.compile(r"\{(\d{1,3})(?::(?:\.(\d{1,3}))?)?([^{}]{0,8})\}", re.ASCII)
TAG: Final = re.compile(r'<([a-z]{1,16})(?: +([a-z]{1,16})="([^"<>]*)")? *>', re.ASCII)


class Slot(NamedTuple):
    """The place of an argument: its number from 0, the decimals (None: as many as there are), and the unit."""

    argument: int
    decimals: int | None
    unit: str

    def shown(self, value: int | float | str | None) -> str:
        """A value in this place. The name of an enumeration has neither decimals nor unit."""
        if value is None:
            return "?"
        if isinstance(value, str):
            return value
        if isinstance(value, int):
            return f"{value}{self.unit}"
        return f"{value:g}{self.unit}" if self.decimals is None else f"{value:.{self.decimals}f}{self.unit}"


Template = tuple["str | Slot", ...]


def compiled(source: str, arguments: int) -> Template:
    """The template for an event with this number of arguments. Any text is a template: wrong markup stays as it is."""
    return tuple(_merged(_parts(source, arguments)))


def filled(template: Template, values: Sequence[int | float | str | None], most: int = MOST_TEXT) -> str:
    """The text, in one line of at most `most` characters."""
    text = "".join(part if isinstance(part, str) else part.shown(values[part.argument]) for part in template)
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= most else line[: most - 3] + "..."


def _merged(parts: Iterator[str | Slot]) -> Iterator[str | Slot]:
    text: list[str] = []
    for part in parts:
        if isinstance(part, str):
            text.append(part)
            continue
        yield "".join(text)
        yield part
        text.clear()
    yield "".join(text)


def _parts(source: str, arguments: int) -> Iterator[str | Slot]:
    at = 0
    while at < len(source):
        character, step = source[at], 1
        if character == "\\":
            character, step = source[at + 1 : at + 2], 2
        elif character == "{" and (slot := SLOT.match(source, at)) and 1 <= int(slot[1]) <= arguments:
            decimals = None if slot[2] is None else min(int(slot[2]), MOST_DECIMALS)
            yield Slot(int(slot[1]) - 1, decimals, UNITS.get(slot[3], f" {slot[3]}" if slot[3] else ""))
            at = slot.end()
            continue
        elif character == "<" and (tag := TAG.match(source, at)):
            end = source.find(f"</{tag[1]}>", tag.end())
            if end >= 0:
                yield from _element(tag, source[tag.end() : end], arguments)
                at = end + len(tag[1]) + 3
                continue
        yield character
        at += step


def _element(tag: re.Match[str], content: str, arguments: int) -> Iterator[str | Slot]:
    """An element of the markup. What an unknown one contains is not shown."""
    name, attribute, value = tag[1], tag[2], tag[3] or ""
    if name == "param":
        yield content
    elif name == "a":
        yield f"{content} ({value})" if attribute == "href" and value else content
    elif name == "profile" and (value.lstrip("!") == PROFILE) is not value.startswith("!"):
        yield from _parts(content, arguments)
