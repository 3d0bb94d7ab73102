"""The words, shapes and colours of the page, as files for the browser: made from the one table in `language`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

from ...interface import STATES
from ...language import LINK, LOOKS
from ...language.headline import LAST, MAY_MOVE
from ...language.states import ROBOT_STATES
from ...language.values import UNKNOWN

if TYPE_CHECKING:
    from ...json_object import JsonObject
    from ...language import Look

HEADS: Final = {
    "mode": ("Mode", "Who drives it"),
    "motion_possible": ("Can move", "Motion possible"),
    "in_motion": ("Moves", "In motion"),
    "drives_powered": ("Drives", "Drives powered"),
    "e_stopped": ("E-stop", "Emergency stop"),
    "in_error": ("Error", "Error"),
    LINK: ("Link", "Link"),
}
"""The head of a column and the title of a field. A field without a row has its own name."""


def fields_module() -> bytes:
    """`fields.js`: each field with its names and looks; the sentences of a page without its gateway."""
    order = {name: place for place, name in enumerate(HEADS)}
    fields = sorted(STATES, key=lambda field: order.get(field.name, len(order)))
    rows = [_row(field.name, field.row.meaning) for field in fields]
    said = {
        "may_move": MAY_MOVE.text,
        "last": LAST,
        "unknown": _look(UNKNOWN),
    }
    robot = [{"word": one.word, "shape": one.shape, "tone": one.tone, "rank": one.rank} for one in ROBOT_STATES]
    parts = {"ROBOT_STATES": robot, "STATES": rows, "LINK": _row(LINK, ""), "SAID": said}
    return "".join(f"export const {name} = {json.dumps(value)};\n" for name, value in parts.items()).encode()


def _row(name: str, meaning: str) -> JsonObject:
    words = name[0].upper() + name[1:].replace("_", " ")
    head, title = HEADS.get(name, (words, words))
    looks = [[value, _look(look)] for value, look in LOOKS[name].items()]
    return {"name": name, "head": head, "title": title, "meaning": meaning, "looks": looks}


def _look(look: Look) -> dict[str, str]:
    short = look.short or look.word
    return {"word": look.word, "short": short, "shape": look.shape, "tone": look.tone, "bar": look.bar}
