"""Recordings of real firmware: each replays identically, keeps the invariants and agrees with the ground truth."""

from __future__ import annotations

import json
import pathlib
import subprocess
import sys
from collections import Counter
from datetime import datetime
from itertools import pairwise

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import RobotStatusMsg, validate
from mav_robot_status.publishers.json_lines import JsonLinesPublisher

from .replays import NO_LARGE_SET, OURS, SHARED, Judgement, broken_invariants, judged, lines_of, reasons_not_to_arm

LOGS = sorted(OURS.glob("*.tlog"))
TRUTHS = sorted(OURS.glob("*.truth.json"))
SHARED_LOGS = sorted(SHARED.glob("*/*.tlog"))
SCORE = SHARED.parent / "tools" / "score.py"

PAUSED = {"ardurover-4.5.6-link-silence": (1_795_201_449.0, 1_795_201_458.0)}
"""When (Unix seconds) a simulation ran on after a pause. It looks like a radio that held frames back: UNKNOWN."""

# The least share of right answers for the truth files of this folder. The other answers are UNKNOWN, as required.
LEAST_RIGHT = {
    "mode": 0.96,
    "e_stopped": 0.60,
    "drives_powered": 0.98,
    "motion_possible": 0.98,
    "in_motion": 0.85,
    "in_error": 0.96,
    "error_code": 0.90,
    "link": 1.0,
}


@pytest.fixture(autouse=True)
def _every_status_is_valid(monkeypatch: pytest.MonkeyPatch) -> None:
    publish = JsonLinesPublisher.publish

    def checked(self: JsonLinesPublisher, msg: RobotStatusMsg) -> None:
        assert validate(msg.status, msg.detail) is None, msg
        publish(self, msg)

    monkeypatch.setattr(JsonLinesPublisher, "publish", checked)


MAX_GAP = 60.0
"""The default of `max_gap`, seconds."""


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
    lost = [json.loads(text)["link"]["state"] == "LOST" for text in first]
    gaps = [(after - before).total_seconds() for before, after in pairwise(stamps)]
    for gap, silent in zip(gaps, lost, strict=False):
        assert 0 <= gap < 0.101 or (silent and gap > MAX_GAP), "ten lines a second, but for a long silence"


def test_the_recordings_are_present() -> None:
    assert len(LOGS) >= 10
    assert len(TRUTHS) >= 10


@pytest.mark.parametrize("log", LOGS, ids=name_of)
def test_a_recording_replays_identically_and_within_the_invariants(log: pathlib.Path) -> None:
    assert_replays_well(log)


def is_unknown(judgement: Judgement, truth: pathlib.Path) -> bool:
    """Whether an answer is UNKNOWN although the wire has it, and no pause excuses that."""
    begins, ends = PAUSED.get(name_of(truth), (0.0, 0.0))
    return judgement.verdict == "unknown" and not begins <= judgement.point["t"] <= ends


@pytest.mark.parametrize("truth", TRUTHS, ids=name_of)
def test_no_answer_is_wrong_or_missing_or_unknown_if_the_wire_has_it(truth: pathlib.Path) -> None:
    log = truth.with_name(truth.name.replace(".truth.json", ".tlog"))
    bad = [j for j in judged(truth, log) if j.verdict in ("WRONG", "missing") or is_unknown(j, truth)]
    assert not bad, "\n".join(f"{j.verdict} {j.field} {j.got} at {j.point['t']}: {j.point['why']}" for j in bad)


@pytest.mark.parametrize("truth", TRUTHS, ids=name_of)
def test_without_the_output_watch_only_answers_from_outputs_are_wrong(truth: pathlib.Path) -> None:
    log = truth.with_name(truth.name.replace(".truth.json", ".tlog"))
    for j in judged(truth, log, HardwareOptions(watch_outputs=False)):
        assert j.verdict != "missing"
        assert not is_unknown(j, truth)
        assert j.verdict != "WRONG" or j.point.get("visible") == "outputs only", j


def test_most_answers_are_right_rather_than_unknown() -> None:
    right: Counter[str] = Counter()
    total: Counter[str] = Counter()
    for truth in TRUTHS:
        if name_of(truth) in PAUSED:
            continue
        for j in judged(truth, truth.with_name(truth.name.replace(".truth.json", ".tlog"))):
            total[j.field] += 1
            right[j.field] += j.verdict == "right"
    shares = {field: right[field] / total[field] for field in total}
    assert set(shares) == set(LEAST_RIGHT)
    assert all(shares[field] >= least for field, least in LEAST_RIGHT.items()), shares


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        (20.0, [None]),
        (46.0, ["PreArm: Motors Emergency Stopped"]),
        (61.0, ["Arm: Hardware safety switch", "Arm: Check mag field (xy diff:171>100)"]),
        (75.0, ["PreArm: GPS 1: Bad fix"]),
        (89.0, ["Arm: Compass not healthy"]),
        (91.0, []),
    ],
)
def test_a_recorded_rover_names_every_reason_why_it_refuses_to_arm(seconds: float, expected: list[str | None]) -> None:
    assert reasons_not_to_arm(OURS / "ardurover-4.5.6-arm-denied.tlog", seconds) == expected


AT_FIRST = ["PreArm: Accels inconsistent", "PreArm: AHRS: waiting for home"]
BOOTS = {
    "arduboat-4.5.6": ["PreArm: AHRS: not using configured AHRS type"],
    "arducopter-4.5.6": ["PreArm: Need Position Estimate"],
    "arducopter-4.7.0-dev-90700977c5": ["PreArm: Need Position Estimate"],
    "arduplane-4.5.6": [],
    "arduquadplane-4.5.6": [],
    "ardurover-4.5.6": ["PreArm: AHRS: not using configured AHRS type"],
    "ardurover-4.7.0-dev-90700977c5": ["PreArm: AHRS: not using configured AHRS type"],
}
"""The reasons half a minute after the boot; a plane can be armed by then."""


@pytest.mark.skipif(not SHARED_LOGS, reason=NO_LARGE_SET)
@pytest.mark.parametrize("name", BOOTS)
def test_every_ardupilot_names_all_reasons_of_its_boot_and_none_that_ended(name: str) -> None:
    log = SHARED / "sitl" / f"{name}-boot.tlog"
    assert reasons_not_to_arm(log, 8.0) == AT_FIRST
    assert reasons_not_to_arm(log, 32.0) == BOOTS[name]
    assert reasons_not_to_arm(log, 42.0) == []


@pytest.mark.slow
@pytest.mark.skipif(not SHARED_LOGS, reason=NO_LARGE_SET)
@pytest.mark.parametrize("log", SHARED_LOGS or [SHARED], ids=name_of)
def test_a_recording_of_the_large_set_replays_identically_and_within_the_invariants(log: pathlib.Path) -> None:
    assert_replays_well(log)


@pytest.mark.slow
@pytest.mark.skipif(not SCORE.exists(), reason=NO_LARGE_SET)
def test_the_tables_of_the_scoreboard_are_those_of_the_recordings() -> None:
    docs = pathlib.Path(__file__).parents[2] / "docs"
    command = [sys.executable, "-c", "import make_scoreboard as m; print(m.filled(m.DOCUMENT.read_text()), end='')"]
    done = subprocess.run(command, cwd=docs, capture_output=True, text=True, check=True)
    assert done.stdout == (docs / "scoreboard.md").read_text(), "run python docs/make_scoreboard.py"
