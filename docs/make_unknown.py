"""Writes `docs/explanation/unknown.md` from the table of `language.unknown`: `python docs/make_unknown.py [FILE]`.

`tests/docs/test_reference.py` runs this and compares, so the page cannot drift from the code.
"""

from __future__ import annotations

import pathlib
import sys
from collections.abc import Iterator

from make_reference import table

from mav_robot_status.language.unknown import ANY, AUTOPILOTS, TABLE, Unknown

HERE = pathlib.Path(__file__).resolve().parent

HEAD = """# What UNKNOWN means, and how to make it known

Generated from the table in the code by `python docs/make_unknown.py`; do not edit.

UNKNOWN (null in JSON) is not a fault. It says that the vehicle does not tell, and that a guess could be wrong. Each
UNKNOWN has a reason, and something that makes it known. `explain` shows both, in the words of this page:
`fields.X.next` in `explain --as-json`, null where the field is known. The page of a vehicle and `doctor` show them too.

Where a message is missing, the words also say whether mav-robot-status has asked for it and how long ago, or that it
does not ask (`--passive`, `requests: none`). The [scoreboard](../scoreboard.md) counts how often each field is UNKNOWN.
"""


def for_all(row: Unknown) -> bool:
    return set(row.words) == {ANY}


def rows_of(autopilot: str) -> Iterator[tuple[str, str]]:
    """The reasons with words of their own for an autopilot."""
    for row in TABLE:
        if not for_all(row) and (autopilot in row.words or (autopilot == ANY and ANY in row.words)):
            yield f"{row.reason} ...", row.words_for(autopilot)


def page() -> str:
    """The whole page."""
    head = ("UNKNOWN because", "what makes it known")
    lines: list[str] = ["## Every autopilot\n"]
    lines += table(head, ((f"{row.reason} ...", row.words[ANY]) for row in TABLE if for_all(row)))
    for autopilot in AUTOPILOTS:
        lines += [f"## {autopilot or 'Other autopilots'}\n"]
        lines += table(head, rows_of(autopilot))
    return HEAD + "\n" + "\n".join(lines).rstrip() + "\n"


def main() -> int:
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "explanation" / "unknown.md"
    out.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
