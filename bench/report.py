"""The result of a run as Markdown. `python -m bench.report` prints all tables of the committed results, and
`python -m bench.report PAGE.md` puts the targets into a page.

`results.json` is the last run, `before.json` an earlier one to compare with. Values measured on a busy machine would
mislead, so the tables of such a run have ratios and memory only.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from statistics import median
from typing import Any, Final

from .results import OURS

BEGIN: Final = "<!-- results -->\n"
END: Final = "<!-- end of results -->\n"
BOARDS: Final = {"a board 4 times slower": 4, "a board 8 times slower": 8}
RESULTS: Final = Path(__file__).with_name("results")
NO_RATIOS: Final = "This case has no other program to compare with, so a busy machine shows nothing."
MET: Final = {True: "yes", False: "**no**", None: "not measured"}


def render(result: dict[str, Any], before: dict[str, Any] | None = None) -> str:
    """All tables. `before`: an earlier result, for a column in the table of targets."""
    busy = bool(result["busy"])
    parts = [
        _head(result),
        _compared(result, before) if before else "",
        _targets(result, before),
        *(_case(case, busy) for case in result["cases"]),
        *(_boards(case) for case in result["cases"] if case["case"] == "udp" and not busy),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def summary(result: dict[str, Any]) -> str:
    """The machine, and the table of those targets that were measured."""
    cases = [{**case, "targets": [t for t in case["targets"] if t["value"] is not None]} for case in result["cases"]]
    return f"{_head(result)}\n\n{_targets({**result, 'cases': cases}, None)}\n"


def _head(result: dict[str, Any]) -> str:
    """The machine and the versions, on one line."""
    machine, versions = result["machine"], result["versions"]
    words = (
        f"{machine['cpu']}, {machine['cores']} cores, Linux {machine['kernel']}, Python {machine['python']}; "
        f"load at the start {machine['load']}. {result['rounds']} round{'s' if result['rounds'] > 1 else ''}"
        f"{', quick' if result['quick'] else ''}, {result['date']}. "
    )
    busy = f"The machine is busy: {result['busy']}. Only ratios and memory mean something. " if result["busy"] else ""
    speed = f"pymavlink parses a frame in {_number(result['parse_us'])} us here; absolute limits are scaled by that. "
    return words + busy + speed + ", ".join(f"{name} {version}" for name, version in versions.items()) + "."


def _compared(result: dict[str, Any], before: dict[str, Any]) -> str:
    """What the column "before" is."""
    busy = f", while the machine was busy: {before['busy']}" if before["busy"] else ""
    return f"Before: {before['date']}, mav-robot-status {before['versions']['mav-robot-status']}{busy}."


def into(page: str, table: str) -> str:
    """The page with the table between its marks. Raises ValueError if the page has no marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the page lacks the lines {BEGIN.strip()} and {END.strip()}")
    return f"{before}{begin}{table}{end}{after}"


def write(page: Path, results: Path) -> None:
    """Put the targets of the last run in a folder into a page."""
    page.write_text(into(page.read_text(), summary(json.loads((results / "results.json").read_text()))))


def committed(results: Path) -> str:
    """All tables of the last run in a folder. The earlier result is left out if it is the same run."""
    result = json.loads((results / "results.json").read_text())
    earlier = results / "before.json"
    before = json.loads(earlier.read_text()) if earlier.exists() else None
    return render(result, before if before and before["date"] != result["date"] else None)


def _targets(result: dict[str, Any], before: dict[str, Any] | None) -> str:
    targets = [target for case in result["cases"] for target in case["targets"]]
    earlier = {t["words"]: _measured(t, before) for case in before["cases"] for t in case["targets"]} if before else {}
    rows = [
        [target["words"], *([earlier.get(target["words"], "-")] if before else []), _measured(target, result),
         MET[target["met"] if _says_something(target, result) else None]]
        for target in targets
    ]  # fmt: skip
    return _table(["target", *(["before"] if before else []), "measured", "met"], rows) if rows else ""


def _says_something(target: dict[str, Any], result: dict[str, Any]) -> bool:
    """On a busy machine only a ratio to another program does, and memory."""
    return not result["busy"] or target["peer"] is not None or target["metric"].endswith(", MB")


def _measured(target: dict[str, Any], result: dict[str, Any]) -> str:
    """A ratio to another program; or a value, with its limit if that depends on the machine."""
    if target["value"] is None or not _says_something(target, result):
        return "-"
    if target["peer"] is not None:
        return f"{_ratio(target['value'])} {target['peer']}"
    limit = target["at_most"] if target["at_most"] is not None else target["at_least"]
    unit = re.search(r", ([^,]*)$", target["metric"])
    value = f"{_number(target['value'])} {unit[1] if unit else ''}".strip()
    return f"{value} (limit here {_number(limit)})" if target["machine"] is not None else value


def _case(case: dict[str, Any], busy: bool) -> str:
    who = list(dict.fromkeys(name for row in case["rows"] for name in row["values"]))
    variants = [name for name in who if name.startswith("ours,")]
    peers = [name for name in who if name != OURS and name not in variants]
    shown = [] if busy else who
    head = ["", "", *shown, *(f"ours / {name}" for name in peers), *(f"{name} / ours" for name in variants)]
    rows = []
    for row in case["rows"]:
        values = row["values"]
        cells = [_spread(values[name]) if name in values else "" for name in shown]
        ratios = [
            *(_paired(values.get(OURS), values.get(name)) for name in peers),
            *(_paired(values.get(name), values.get(OURS)) for name in variants),
        ]
        if shown or any(ratios):
            rows.append([row["setup"], row["metric"], *cells, *ratios])
    notes = "\n".join(f"- {note}" for note in case["notes"])
    table = _table(head, rows) if rows else NO_RATIOS if busy and case["rows"] else "Not measured."
    return "\n\n".join(part for part in (f"### {case['title']}", table, notes) if part)


def _boards(case: dict[str, Any]) -> str:
    """Estimates for slower computers: the CPU load times a factor. Only rates at which no program nears a full
    core.
    """
    rows = []
    for row in case["rows"]:
        rate = re.fullmatch(r"(\d+) frames/s, evenly spaced, half needed", row["setup"])
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
    """Print the committed results, or put their targets into a page."""
    if len(arguments) > 1:
        print("usage: python -m bench.report [PAGE.md]", file=sys.stderr)
        return 2
    if arguments:
        write(Path(arguments[0]), RESULTS)
    else:
        print(committed(RESULTS), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
