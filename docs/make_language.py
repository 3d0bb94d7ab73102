"""Writes `docs/explanation/language-of-state.md` from the tables in `language`: `python docs/make_language.py [FILE]`.

`tests/docs/test_reference.py` runs this and compares, so the page cannot drift from the code.
"""

from __future__ import annotations

import json
import pathlib
import sys
from collections.abc import Iterator

from make_reference import table

from mav_robot_status.language import LOOKS, ROBOT_STATES, TONES

HERE = pathlib.Path(__file__).resolve().parent

HEAD = """# The language of state

Generated from the tables in the code by `python docs/make_language.py`; do not edit.

One table has the word, the shape, the sign and the tone of each value. Views show what it says, so that a state looks
the same everywhere. A value differs from the others of its field in its word and its shape, never in colour alone. A
robot that is parked and healthy is calm: colour is for what a person must know.

The status informs. It is not a safety function.
"""


def tones() -> Iterator[str]:
    yield "## Tones\n"
    yield "The contrast of each colour with its background is at least 4.5 (WCAG 2, level AA).\n"
    yield from table(
        ("tone", "meaning", "light", "dark", "terminal"),
        (
            (name, tone.meaning, f"`{tone.light}`", f"`{tone.dark}`", tone.terminal or "plain")
            for name, tone in TONES.items()
        ),
    )


def values() -> Iterator[str]:
    yield "## Values\n"
    yield "The sign is that of a terminal, with its form without UTF-8. The short word is for narrow columns. The bar"
    yield "is the form in a timeline. Rows that several fields share stand once.\n"
    of: dict[tuple[str, ...], list[str]] = {}
    for name, looks in LOOKS.items():
        for value, o in looks.items():
            look = (o.word, o.short or o.word, o.shape, f"`{o.glyph}` `{o.ascii}`", o.tone, o.bar)
            of.setdefault((_json(value), *look), []).append(name)
    yield from table(
        ("field", "value", "word", "short", "shape", "sign", "tone", "bar"),
        ((", ".join(names), f"`{value}`", *look) for (value, *look), names in of.items()),
    )


def states() -> Iterator[str]:
    yield "## States of a robot\n"
    yield "The worst first. Page, `watch`, report, events and ground stations use the same words. The severity is"
    yield "MAV_SEVERITY, that of the STATUSTEXT to ground stations.\n"
    yield from table(
        ("of a robot that is", "word", "shape", "sign", "severity", "tone"),
        ((o.meaning, o.word, o.shape, f"`{o.glyph}` `{o.ascii}`", o.severity, o.tone) for o in ROBOT_STATES),
    )
    yield "A headline is the word, then why, with the cause first, then the next step. A robot that moves with an error"
    yield "or a stop is MOVING, in the tone of an alarm, and its first sentence names the trouble. A list begins with"
    yield "the worst.\n"
    yield "A group says of each member what it is: “base is stopped; arm is READY and may move.” It is never called"
    yield "stopped or parked while a member may move.\n"
    yield "A lost link is never a reason why motion is not possible. It says when the robot was last heard, and what it"
    yield "was then: “Last heard 14:03:10: armed, moving, AUTO. It may be moving.”\n"


def _json(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def page() -> str:
    """The whole page."""
    return HEAD + "\n" + "\n".join(line for part in (states(), tones(), values()) for line in part).rstrip() + "\n"


def main() -> int:
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "explanation" / "language-of-state.md"
    out.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
