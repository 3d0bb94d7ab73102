"""Real firmware's recordings: every one replays, the same twice, within the invariants, and true."""

from __future__ import annotations

import json
import pathlib
import re
import subprocess
import sys
from collections import Counter
from datetime import datetime
from itertools import pairwise
from typing import Any

import pytest

from mav_robot_status.hardware import horizon
from mav_robot_status.hardware.options import HardwareOptions

from .replays import OURS, SHARED, broken_invariants, judged, lines_of

LOGS = sorted(OURS.glob("*.tlog"))
TRUTHS = sorted(OURS.glob("*.truth.json"))
SHARED_LOGS = sorted(SHARED.glob("*/*.tlog"))
SCORE = SHARED.parent / "tools" / "score.py"

# What the truth files of this folder must give at least, as shares of right answers (the rest is honestly unknown).
LEAST_RIGHT = {
    "mode": 0.98,
    "e_stopped": 0.60,
    "drives_powered": 1.0,
    "motion_possible": 1.0,
    "in_motion": 0.85,
    "in_error": 0.96,
    "error_code": 0.90,
    "link": 1.0,
}


def name_of(path: pathlib.Path) -> str:
    return path.name.split(".t")[0]


def assert_replays_well(log: pathlib.Path) -> None:
    first = lines_of(log)
    assert first, "a recording of an autopilot gives at least one line"
    assert first == lines_of(log), "the same lines every time"
    for text in first:
        line = json.loads(text)
        assert not list(broken_invariants(line)), text
    stamps = [datetime.fromisoformat(json.loads(t)["stamp"].replace("Z", "+00:00")) for t in first]
    gaps = [(after - before).total_seconds() for before, after in pairwise(stamps)]
    assert all(0 <= gap < 0.101 for gap in gaps), "ten lines a second, through silences too"


def test_there_are_recordings_to_test_with() -> None:
    assert len(LOGS) >= 10
    assert len(TRUTHS) >= 10


@pytest.mark.parametrize("log", LOGS, ids=name_of)
def test_a_recording_replays_the_same_twice_and_within_the_invariants(log: pathlib.Path) -> None:
    assert_replays_well(log)


class Unlike(dict[Any, object]):
    """What mattered, and is never as it was."""

    def __getitem__(self, kind: object) -> object:
        return None

    def __ne__(self, other: object) -> bool:
        return True


@pytest.mark.parametrize("log", LOGS, ids=name_of)
def test_a_status_that_is_derived_after_every_message_is_the_same(
    log: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sparing = lines_of(log)
    monkeypatch.setattr(horizon, "matters", lambda *_: Unlike())
    assert lines_of(log) == sparing


@pytest.mark.parametrize("truth", TRUTHS, ids=name_of)
def test_nothing_is_wrong_missing_or_unknown_though_the_wire_tells(truth: pathlib.Path) -> None:
    log = truth.with_name(truth.name.replace(".truth.json", ".tlog"))
    bad = [j for j in judged(truth, log) if j.verdict in ("WRONG", "missing", "unknown")]
    assert not bad, "\n".join(f"{j.verdict} {j.field} {j.got} at {j.point['t']}: {j.point['why']}" for j in bad)


@pytest.mark.parametrize("truth", TRUTHS, ids=name_of)
def test_without_the_output_watch_only_what_the_outputs_alone_show_is_wrong(truth: pathlib.Path) -> None:
    log = truth.with_name(truth.name.replace(".truth.json", ".tlog"))
    for j in judged(truth, log, HardwareOptions(watch_outputs=False)):
        assert j.verdict not in ("missing", "unknown")
        assert j.verdict != "WRONG" or j.point.get("visible") == "outputs only", j


def test_most_answers_are_right_rather_than_unknown() -> None:
    right: Counter[str] = Counter()
    total: Counter[str] = Counter()
    for truth in TRUTHS:
        for j in judged(truth, truth.with_name(truth.name.replace(".truth.json", ".tlog"))):
            total[j.field] += 1
            right[j.field] += j.verdict == "right"
    shares = {field: right[field] / total[field] for field in total}
    assert set(shares) == set(LEAST_RIGHT)
    assert all(shares[field] >= least for field, least in LEAST_RIGHT.items()), shares


@pytest.mark.skipif(not SHARED_LOGS, reason="the large set of recordings is not beside this checkout")
@pytest.mark.parametrize("log", SHARED_LOGS, ids=name_of)
def test_a_recording_of_the_large_set_replays_the_same_twice_and_within_the_invariants(log: pathlib.Path) -> None:
    assert_replays_well(log)


@pytest.mark.skipif(not SCORE.exists(), reason="the large set of recordings is not beside this checkout")
@pytest.mark.parametrize("output_watch", [True, False])
def test_the_large_set_is_scored_as_the_document_says(output_watch: bool, tmp_path: pathlib.Path) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(f"hardware: {{watch_outputs: {str(output_watch).lower()}}}\n")
    truths = sorted(str(path) for path in (SHARED / "sitl").glob("*.truth.json"))
    command = f"{sys.executable} -m mav_robot_status.cli run -q --config {config} {{log}} --rate 10"
    done = subprocess.run(
        [sys.executable, str(SCORE), "--command", command, "--max-unknown", "0", *truths],
        capture_output=True,
        text=True,
        check=False,
    )
    table = [line.split() for line in done.stdout.splitlines()[-10:]]
    assert table[0][:7] == ["field", "n", "right", "honest", "unknown", "WRONG", "missing"], done.stdout + done.stderr
    scored = {("all" if field == "TOTAL" else field): list(map(int, row[:6])) for field, *row in table[1:]}
    document = (pathlib.Path(__file__).parents[2] / "docs" / "scoreboard.md").read_text()
    rows = [[cell.strip(" `") for cell in row.split("|")[1:-1]] for row in re.findall(r"^\| .*$", document, re.M)]
    documented = {row[0]: list(map(int, row[1:7])) for row in rows if len(row) == 8 and row[1].isdigit()}
    unwatched = {row[0]: list(map(int, row[1:])) for row in rows if len(row) == 5 and row[1].isdigit()}
    if output_watch:
        assert done.returncode == 0, done.stdout + done.stderr
        assert scored == documented
    else:
        assert "all" in unwatched
        for field, (n, right, honest, unknown, wrong, missing) in scored.items():
            assert (unknown, missing) == (0, 0)
            assert [n, right, honest, wrong] == unwatched.get(field, [*documented[field][:3], 0])
