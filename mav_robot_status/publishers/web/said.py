"""What the page says of one robot: its headline, its causes in words, and the last known values after a link loss."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface import STATES
from ...language import headline, remedy
from ...language.headline import UNHEARD

if TYPE_CHECKING:
    from ...json_object import JsonMapping, JsonObject

MOST_SENTENCES: Final = 16
MOST_CAUSES: Final = 64
"""Causes of one robot that the page lists."""


def said(line: JsonMapping, last: JsonMapping | None) -> JsonObject:
    """The members of `headlines` in an event. `last` is the last line with a connected link, if known."""
    found = headline(line, last)
    values = last or {}
    lost = _state(line) != "CONNECTED" and last is not None
    return {
        "word": found.word,
        "shape": found.shape,
        "tone": found.tone,
        "rank": found.rank,
        "sentences": [one._asdict() for one in found.sentences[:MOST_SENTENCES]],
        "step": found.step,
        "topic": found.topic,
        "causes": [_cause(group, cause) for group, cause in _causes(line)[:MOST_CAUSES]],
        "last": {field.name: values.get(field.name) for field in STATES} if lost else None,
    }


def with_words(value: object) -> object:
    """The value of a transition; a cause has its words."""
    return {**value, "words": remedy(value).sentence} if isinstance(value, dict) else value


def _causes(line: JsonMapping) -> list[tuple[str, JsonMapping]]:
    """Each cause with its list: errors, inhibits, or `unheard` if it says only that nothing is known."""
    return [
        ("unheard" if cause.get("name") == UNHEARD else group, cause)
        for group in ("errors", "inhibits")
        if isinstance(line.get(group), list)
        for cause in line[group]
        if isinstance(cause, dict)
    ]


def _cause(group: str, cause: JsonMapping) -> JsonObject:
    found = remedy(cause)
    names = ("name", "code", "text", "since", "handle")
    kept = {name: cause[name] for name in names if cause.get(name) is not None}
    return {"list": group, "words": found.sentence, "step": found.step, "topic": found.topic, **kept}


def _state(line: JsonMapping) -> object:
    link = line.get("link")
    return link.get("state") if isinstance(link, dict) else None
