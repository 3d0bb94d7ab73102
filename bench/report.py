"""The result of a run as Markdown. `python -m bench.report RESULTS.json PAGE.md` puts it into a page."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from statistics import median
from typing import Any, Final

BEGIN: Final = "<!-- results -->\n"
END: Final = "<!-- end of results -->\n"
BOARDS: Final = {"a board 4 times slower": 4, "a board 8 times slower": 8}
MET: Final = {True: "yes", False: "**no**", None: "not measured"}


def render(result: dict[str, Any]) -> str:
    """All tables."""
    machine, versions = result["machine"], result["versions"]
    parts = [
        f"{machine['cpu']}, {machine['cores']} cores, Linux {machine['kernel']}, Python {machine['python']}; "
        f"load at the start {machine['load']}. {result['rounds']} rounds{', quick' if result['quick'] else ''}, "
        f"{result['date']}. " + ", ".join(f"{name} {version}" for name, version in versions.items()) + ".",
        _targets(result["cases"]),
        *(_case(case) for case in result["cases"]),
        *(_boards(case) for case in result["cases"] if case["case"] == "udp"),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def into(page: str, table: str) -> str:
    """The page with the table between its marks. Raises ValueError if the page has no marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the page lacks the lines {BEGIN.strip()} and {END.strip()}")
    return f"{before}{begin}{table}{end}{after}"


def _targets(cases: list[dict[str, Any]]) -> str:
    rows = [[target["words"], _measured(target), MET[target["met"]]] for case in cases for target in case["targets"]]
    return _table(["target", "measured", "met"], rows) if rows else ""


def _measured(target: dict[str, Any]) -> str:
    if target["value"] is None:
        return "-"
    if target["peer"] is None:
        unit = re.search(r", ([^,]*)$", target["metric"])
        return f"{_number(target['value'])} {unit[1] if unit else ''}".strip()
    return f"{_ratio(target['value'])} {target['peer']}"


def _case(case: dict[str, Any]) -> str:
    who = list(dict.fromkeys(name for row in case["rows"] for name in row["values"]))
    peers = [name for name in who if not name.startswith("ours")]
    head = ["", "", *who, *(f"ours / {name}" for name in peers)]
    rows = []
    for row in case["rows"]:
        values = row["values"]
        cells = [_spread(values[name]) if name in values else "" for name in who]
        ratios = [_paired(values.get("ours"), values.get(name)) for name in peers]
        rows.append([row["setup"], row["metric"], *cells, *ratios])
    notes = "\n".join(f"- {note}" for note in case["notes"])
    table = _table(head, rows) if rows else "Not measured."
    return "\n\n".join(part for part in (f"### {case['title']}", table, notes) if part)


def _boards(case: dict[str, Any]) -> str:
    """Estimates for slower computers: the CPU load times a factor. Only rates at which no program nears a full core."""
    rows = []
    for row in case["rows"]:
        rate = re.fullmatch(r"(\d+) frames/s", row["setup"])
        for who, values in row["values"].items():
            if rate and int(rate[1]) < 1000:
                share = median(values) * int(rate[1]) / 10_000
                rows.append([row["setup"], who, *(_number(share * factor) for factor in (1, *BOARDS.values()))])
    table = _table(["", "", "here", *BOARDS], rows)
    return f"### Estimate for small boards: per cent of a core\n\n{table}" if rows else ""


def _paired(mine: list[float] | None, theirs: list[float] | None) -> str:
    if not mine or not theirs or len(mine) != len(theirs) or not all(theirs):
        return ""
    return _ratio(median(a / b for a, b in zip(mine, theirs, strict=True)))


def _ratio(value: float) -> str:
    """A readable factor: 0.083 becomes 1/12."""
    return f"{value:.3g}x" if value >= 0.4 or value <= 0 else f"1/{1 / value:.3g}"


def _spread(values: list[float]) -> str:
    if len(values) == 1:
        return _number(values[0])
    return f"{_number(median(values))} ({_number(min(values))}-{_number(max(values))})"


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main(arguments: list[str]) -> int:
    """Put a result into a page."""
    if len(arguments) != 2:
        print("usage: python -m bench.report RESULTS.json PAGE.md", file=sys.stderr)
        return 2
    results, page = map(Path, arguments)
    page.write_text(into(page.read_text(), render(json.loads(results.read_text()))))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
