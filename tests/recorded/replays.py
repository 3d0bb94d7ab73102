"""Replays a log as the command does, and compares its lines with the ground truth."""

from __future__ import annotations

import bisect
import json
import pathlib
import tempfile
from collections.abc import Iterator
from datetime import datetime
from typing import Any, NamedTuple

from mav_robot_status.config import Config, ControllerConfig, PublisherConfig
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER
from mav_robot_status.gateway.replay import replay
from mav_robot_status.hardware.mavlink.options import HardwareOptions

HERE = pathlib.Path(__file__).parent
OURS = HERE / "logs"
SHARED = HERE.parents[2] / "shared" / "recordings"
NO_LARGE_SET = f"the large set of recordings is not in {SHARED}: see tests/recorded/logs/README.md"
OLDEST = 2.0  # s: an older line does not count
FIELDS = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")


def lines_of(log: pathlib.Path, options: HardwareOptions | None = None) -> list[str]:
    """The JSON lines of a log, at 10 Hz and on change."""
    controller = ControllerConfig(
        DEFAULT_CONTROLLER.name,
        DEFAULT_CONTROLLER.type,
        {"publish_rate": 10},
        DEFAULT_CONTROLLER.where,
        (PublisherConfig("json"),),
    )
    config = Config(hardware=options or HardwareOptions(), controllers=(controller,))
    with tempfile.TemporaryFile("w+") as out:
        replay(config, str(log), out)
        out.seek(0)
        return out.readlines()


def broken_invariants(line: dict[str, Any]) -> Iterator[str]:
    """The rules that a line breaks: the invariants I1 to I4, and others."""
    if line["e_stopped"] is True and line["drives_powered"] is not False:
        yield "I1"
    if line["drives_powered"] is False and line["motion_possible"] is not False:
        yield "I2"
    if (line["error_code"] != 0) != (line["in_error"] is True):
        yield "I3"
    if line["link"]["state"] != "CONNECTED" and (
        line["mode"] != "UNKNOWN" or line["error_code"] or any(line[f] is not None for f in FIELDS[1:])
    ):
        yield "I4"
    if (line["motion_possible"] is True) != (line["inhibits"] == []):
        yield "inhibits are empty exactly while motion is possible"
    if [e["code"] for e in line["errors"]][:1] != ([line["error_code"]] if line["error_code"] else []):
        yield "error_code is the first of errors"


def reasons_not_to_arm(log: pathlib.Path, seconds: float) -> list[str | None]:
    """The texts of the reasons why the vehicle of a log cannot be armed, `seconds` after its first line."""
    rows = [json.loads(line) for line in lines_of(log)]
    stamps = [datetime.fromisoformat(row["stamp"].replace("Z", "+00:00")).timestamp() for row in rows]
    row = rows[bisect.bisect_right(stamps, stamps[0] + seconds) - 1]
    return [inhibit["text"] for inhibit in row["inhibits"] if inhibit["name"] == "PREARM_FAILING"]


class Judgement(NamedTuple):
    """The verdict on one checkpoint: right, honest (an accepted UNKNOWN), unknown, WRONG or missing."""

    verdict: str
    field: str
    got: object
    point: dict[str, Any]


class Lines(NamedTuple):
    """The lines of one vehicle, in order."""

    stamps: list[float]
    """Unix seconds."""
    rows: list[dict[str, Any]]

    def at(self, t: float) -> dict[str, Any] | None:
        """The last line at a time; None if there is none, or it is too old to count."""
        i = bisect.bisect_right(self.stamps, t + 5e-7) - 1
        return None if i < 0 or t - self.stamps[i] > OLDEST else self.rows[i]


def answer(row: dict[str, Any], field: str) -> object:
    """What a line says of a field of the ground truth."""
    return row["link"]["state"] if field == "link" else row[field]


def lines_of_vehicle(log: pathlib.Path, ids: tuple[int, int], options: HardwareOptions | None = None) -> Lines:
    """The lines of the vehicle with these ids: system, component."""
    rows = [row for row in map(json.loads, lines_of(log, options)) if (row["system"], row["component"]) == ids]
    return Lines([datetime.fromisoformat(row["stamp"].replace("Z", "+00:00")).timestamp() for row in rows], rows)


def judged(truth_file: pathlib.Path, log: pathlib.Path, options: HardwareOptions | None = None) -> list[Judgement]:
    """The verdict on every checkpoint of a truth file."""
    truth = json.loads(truth_file.read_text(encoding="utf-8"))
    return judgements(truth["checkpoints"], lines_of_vehicle(log, (truth["system"], truth["component"]), options))


def judgements(points: list[dict[str, Any]], lines: Lines) -> list[Judgement]:
    """The verdict on every checkpoint; where `in_error` is as expected, `error_code` has one as well."""
    out = []
    for point in points:
        field, row = point["field"], lines.at(point["t"])
        if row is None:
            out.append(Judgement("missing", field, None, point))
            continue
        got = answer(row, field)
        verdict = _verdict(got, point["expect"], point["acceptable"])
        out.append(Judgement(verdict, field, got, point))
        if field == "in_error" and got == point["expect"]:
            out.append(_judged_code(row["error_code"], point))
    return out


def _verdict(got: object, expect: object, acceptable: list[object]) -> str:
    unknown = (None, "UNKNOWN")
    if got == expect or (got in unknown and expect in unknown):
        return "right"
    if got in unknown:
        return "honest" if any(a in unknown for a in acceptable) else "unknown"
    return "right" if got in acceptable else "WRONG"


def _judged_code(code: int, point: dict[str, Any]) -> Judgement:
    wanted = point.get("code_in") if point["expect"] else [0]
    if wanted is None or code in wanted:
        return Judgement("right", "error_code", code, point)
    verdict = "honest" if code in point.get("code_vague", ()) else "WRONG"
    return Judgement(verdict, "error_code", code, point)
