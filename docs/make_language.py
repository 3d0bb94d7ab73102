"""Writes `docs/explanation/language-of-state.md` from the tables in `language`: `python docs/make_language.py [FILE]`.

`tests/docs/test_reference.py` runs this and compares, so the page cannot drift from the code.
"""

from __future__ import annotations

import json
import pathlib
import sys
from collections.abc import Iterator

from make_reference import table

from mav_robot_status.language import LOOKS, TONES
from mav_robot_status.language.headline import ROWS

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


def headlines() -> Iterator[str]:
    yield "## Headlines\n"
    yield "A headline is one word, then why, then the next step. An error makes any headline an alarm, of rank 1. A"
    yield "robot that cannot move for a reason that needs a person is a warning, of rank 3. A list begins with the"
    yield "lowest rank.\n"
    yield from table(
        ("of a robot that is", "word", "shape", "tone", "rank"),
        ((state, row.word, row.look.shape, row.tone, row.rank) for state, row in ROWS.items()),
    )
    yield "*Not ready* and *partly stopped* are said of groups: another member may move.\n"
    yield "A lost link is never a reason why motion is not possible. It says that nothing is known, since when, and"
    yield "what was last known: “Unknown since 14:03:10. It may be moving. Last known: AUTO, moving.”"


def _json(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def page() -> str:
    """The whole page."""
    return HEAD + "\n" + "\n".join(line for part in (tones(), values(), headlines()) for line in part).rstrip() + "\n"


def main() -> int:
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "explanation" / "language-of-state.md"
    out.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
