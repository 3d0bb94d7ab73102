"""Writes the tables of `docs/scoreboard.md`: `python docs/make_scoreboard.py [--list]`.

It judges the status on the large set of recordings, which lies beside the checkout (tests/recorded/logs/README.md), by
its own judge, `tools/score.py`; the recordings over bad links by `tests/recorded/bad_link_verdicts.py`. That takes some
minutes. `--list` only prints the recordings of each family.
A slow test of `tests/recorded` compares the tables in the document with fresh ones.
"""

from __future__ import annotations

import functools
import json
import pathlib
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any, Final

DOCUMENT: Final = pathlib.Path(__file__).resolve().parent / "scoreboard.md"
SHARED: Final = DOCUMENT.parents[2] / "shared"
SCORE: Final = SHARED / "tools" / "score.py"
sys.path.insert(0, str(DOCUMENT.parents[1]))  # for `tests`

from tests.recorded.bad_link_verdicts import Recording, Verdicts  # noqa: E402
from tests.recorded.bad_links import BAD_LINKS  # noqa: E402

FAMILIES: Final = (
    ("ArduPilot with the applet", r".*-applet-"),
    ("ArduPilot Rover", r"ardurover-"),
    ("ArduPilot Boat", r"arduboat-"),
    ("ArduPilot Copter", r"arducopter-"),
    ("ArduPilot Heli", r"arduheli-"),
    ("ArduPilot Plane", r"arduplane-"),
    ("ArduPilot QuadPlane", r"arduquadplane-"),
    ("ArduPilot Sub", r"ardusub-"),
    ("PX4 quadcopter", r"px4-quad-"),
    ("PX4 rover", r"px4-rover-"),
    ("PX4 VTOL", r"px4-standard-vtol-"),
    ("INAV", r"inav-"),
    ("Betaflight", r"betaflight-"),
)
"""Each family and the beginning of the names of its recordings; the first that matches."""
FIELDS: Final = (
    "mode",
    "e_stopped",
    "drives_powered",
    "motion_possible",
    "in_motion",
    "in_error",
    "error_code",
    "link",
)
VERDICTS: Final = ("right", "honest", "unknown", "WRONG", "missing")
BLOCK: Final = "<!-- {0}: written by docs/make_scoreboard.py -->\n{1}<!-- end -->\n"


class Score:
    """The verdicts on some recordings."""

    def __init__(self, recordings: int, judged: dict[str, Any]) -> None:
        self.recordings = recordings
        self.fields = {name: Counter(counts) for name, counts in judged["fields"].items()}
        self.wrong = [one for one in judged["listed"] if one["verdict"] == "WRONG"]
        self.problems = judged["problems"]

    @property
    def all(self) -> Counter[str]:
        """The verdicts on all fields."""
        return sum(self.fields.values(), Counter())


def truths() -> dict[str, list[pathlib.Path]]:
    """The truth files of each family. Raises StopIteration for a recording of no family."""
    found: dict[str, list[pathlib.Path]] = {family: [] for family, _ in FAMILIES}
    for path in sorted((SHARED / "recordings" / "sitl").glob("*.truth.json")):
        found[next(family for family, pattern in FAMILIES if re.match(pattern, path.name))].append(path)
    return found


def judge(paths: Iterable[pathlib.Path], output_watch: bool) -> Score:
    """The verdicts of `tools/score.py`."""
    with tempfile.TemporaryDirectory() as folder:
        config, result = pathlib.Path(folder) / "config.yaml", pathlib.Path(folder) / "score.json"
        config.write_text(f"hardware: {{watch_outputs: {str(output_watch).lower()}}}\n")
        command = f"{sys.executable} -m mav_robot_status.cli run -q --config {config} {{log}} --rate 10"
        names = [str(path) for path in paths]
        options = ["--quiet", "--json", str(result), "--command", command]
        done = subprocess.run(
            [sys.executable, str(SCORE), *options, *names], capture_output=True, text=True, check=False
        )
        if done.returncode not in (0, 1):  # 1: an answer is WRONG
            raise RuntimeError(done.stderr)
        return Score(len(names), json.loads(result.read_text()))


def together(scores: Iterable[Score]) -> Score:
    """The sum of the verdicts."""
    scores = list(scores)
    fields = {field: dict(sum((s.fields[field] for s in scores), Counter())) for field in FIELDS}
    listed, problems = ([one for s in scores for one in getattr(s, name)] for name in ("wrong", "problems"))
    return Score(sum(s.recordings for s in scores), {"fields": fields, "listed": listed, "problems": problems})


def percent(counts: Counter[str]) -> str:
    """The share of right answers; empty if nothing was judged."""
    total = sum(counts.values())
    return f"{100 * counts['right'] / total:.1f}" if total else ""


def row(name: str, counts: Counter[str]) -> list[object]:
    """Name, number of checkpoints and of each verdict, share of right answers."""
    return [name, sum(counts.values()), *(counts[verdict] for verdict in VERDICTS), percent(counts)]


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """A Markdown table."""
    names = list(head)
    yield "| " + " | ".join(names) + " |"
    yield "|" + "---|" * len(names)
    for cells in rows:
        yield "| " + " | ".join(map(str, cells)) + " |"


def by_field(score: Score) -> Iterator[str]:
    yield f"{score.recordings} recordings with their ground truth.\n"
    rows = [row(f"`{field}`", score.fields[field]) for field in FIELDS]
    yield from table(("field", "checkpoints", *VERDICTS, "right %"), [*rows, row("all", score.all)])


def by_family(scores: dict[str, Score]) -> Iterator[str]:
    head = ("family", "recordings", "checkpoints", *VERDICTS, "right %")
    rows = [row(family, score.all) for family, score in scores.items()]
    yield from table(head, ([name, scores[str(name)].recordings, *rest] for name, *rest in rows))


def wrong(score: Score) -> Iterator[str]:
    if not score.wrong:
        yield "No answer is WRONG."
        return
    names = ("log", "field", "got", "expect", "visible")
    groups = Counter(tuple(json.dumps(one.get(name)) for name in names) for one in score.wrong)
    rows = [
        [*(cell.strip('"').replace("null", "") for cell in group), count] for group, count in sorted(groups.items())
    ]
    yield from table(("WRONG in", "field", "answer", "truth", "visible in", "checkpoints"), rows)


def without_output_watch(score: Score, watched: Score) -> Iterator[str]:
    """The fields that differ, and all."""
    rows = [row(f"`{f}`", score.fields[f]) for f in FIELDS if +score.fields[f] != +watched.fields[f]]
    yield from table(("without the watch", "checkpoints", *VERDICTS, "right %"), [*rows, row("all", score.all)])


def over_bad_links(truth_file: pathlib.Path) -> dict[str, Verdicts]:
    """The verdicts on a recording over each bad link."""
    recording = Recording(truth_file.with_name(truth_file.name.replace(".truth.json", ".tlog")))
    return {name: recording.over(name).verdicts() for name in BAD_LINKS}


def bad_links(paths: Iterable[pathlib.Path]) -> Iterator[str]:
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(over_bad_links, paths))
    rows = []
    for name in BAD_LINKS:
        total = functools.reduce(Verdicts.plus, (verdicts[name] for verdicts in found))
        change = f"{100 * (total.right / total.right_undamaged - 1):+.1f}"
        rows.append([name, total.checkpoints, total.right, change, len(total.wrong), len(total.safe), total.safe_lines])
    head = ("the link", "checkpoints", "right", "against undamaged %", "WRONG", 'of them "safe"', '"safe" lines')
    yield from table(head, rows)


@functools.cache
def blocks() -> dict[str, str]:
    """The generated blocks of the document, by name."""
    families = {family: paths for family, paths in truths().items() if paths}
    watched, unwatched = (
        {family: judge(paths, output_watch) for family, paths in families.items()} for output_watch in (True, False)
    )
    total = together(watched.values())
    if total.problems:
        raise RuntimeError(total.problems)
    lines = {
        "by field": by_field(total),
        "by family": by_family(watched),
        "wrong": wrong(total),
        "without output watch": without_output_watch(together(unwatched.values()), total),
        "bad links": bad_links(path for paths in families.values() for path in paths),
    }
    return {name: "\n".join(text) + "\n" for name, text in lines.items()}


def filled(document: str) -> str:
    """The document with fresh blocks."""
    for name, text in blocks().items():
        start, end = BLOCK.format(name, "\0").split("\0")
        before, _, rest = document.partition(start)
        document = before + BLOCK.format(name, text) + rest.partition(end)[2]
    return document


def main() -> int:
    if not SCORE.exists():
        print(f"the large set of recordings is not in {SHARED}: see tests/recorded/logs/README.md", file=sys.stderr)
        return 1
    if "--list" in sys.argv[1:]:
        for family, paths in truths().items():
            print(f"{family}: {', '.join(path.name.removesuffix('.truth.json') for path in paths)}")
        return 0
    DOCUMENT.write_text(filled(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
