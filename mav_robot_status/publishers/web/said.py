"""What the page says of one robot: its headline, its causes in words, and the last known values after a link loss."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface import STATES
from ...language import headline, remedy
from ...language.states import UNHEARD, causes, part, sentence

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...json_object import JsonMapping, JsonObject
    from ...language import Sentence

MOST_SENTENCES: Final = 16
MOST_CAUSES: Final = 64
"""Causes of one robot that the page lists."""


def said(line: JsonMapping, last: JsonMapping | None, members: Mapping[str, JsonMapping]) -> JsonObject:
    """The members of `headlines` in an event. `last` is the last line with a connected link, if known."""
    found = headline(line, last, members)
    return {
        "word": found.word,
        "shape": found.state.shape,
        "tone": found.tone,
        "rank": found.rank,
        "sentences": [_sentence(one) for one in found.sentences[:MOST_SENTENCES]],
        "step": found.step,
        "topic": found.topic,
    }


def _sentence(one: Sentence) -> JsonObject:
    return {name: value for name, value in one._asdict().items() if value}


def about(line: JsonMapping, last: JsonMapping | None) -> JsonObject:
    """What the page of one robot has besides: every cause, and what was known before its link was lost."""
    lost = part(line, "link").get("state") != "CONNECTED" and last is not None
    return {
        "causes": [_cause(group, cause, line) for group, cause in _causes(line)[:MOST_CAUSES]],
        "last": {field.name: (last or {}).get(field.name) for field in STATES} if lost else None,
    }


def with_words(value: object) -> object:
    """The value of a transition; a cause has its words."""
    return {**value, "words": remedy(value).sentence} if isinstance(value, dict) else value


def _causes(line: JsonMapping) -> list[tuple[str, JsonMapping]]:
    """Each cause with its list: errors, inhibits, or `unheard` if it says only that nothing is known."""
    return [
        ("unheard" if cause.get("name") == UNHEARD else group, cause)
        for group in ("errors", "inhibits")
        for cause in causes(line, group)
    ]


def _cause(group: str, cause: JsonMapping, line: JsonMapping) -> JsonObject:
    found = remedy(cause)
    names = ("name", "code", "text", "since", "handle")
    kept = {name: cause[name] for name in names if cause.get(name) is not None}
    words = sentence({**cause, "handle": None}, line)
    return {"list": group, "words": words, "step": found.step, "topic": found.topic, **kept}
