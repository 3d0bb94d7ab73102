"""Samples, their medians against targets, and the tables."""

from __future__ import annotations

import json
from typing import Any

import pytest

from bench.report import BEGIN, END, into, render
from bench.results import OURS, PYMAVLINK, Sample, Skip, Target, collect

from ...docs.documents import ROOT

CPU = "CPU per frame, us"


def result(*targets: Target) -> dict[str, Any]:
    """Three rounds; the machine is slow in one."""
    rounds: list[list[Sample | Skip]] = [
        [Sample("parsing", CPU, OURS, mine), Sample("parsing", CPU, PYMAVLINK, theirs), Skip("", "MAVSDK", "not there")]
        for mine, theirs in ((1.0, 10.0), (5.0, 40.0), (1.0, 9.0))
    ]
    return collect("parse", "Parsing", rounds, targets)


@pytest.mark.parametrize(("factor", "met"), [(1 / 8, True), (1 / 9, True), (1 / 10, False)])
def test_a_ratio_is_that_of_each_round_so_a_busy_machine_does_not_change_it(factor: float, met: bool) -> None:
    target = result(Target("parsing", CPU, "", at_most=factor, peer=PYMAVLINK))["targets"][0]
    assert (target["value"], target["met"]) == (pytest.approx(0.111, abs=0.012), met)


@pytest.mark.parametrize(("limit", "met"), [(1.0, True), (0.9, False)])
def test_an_absolute_target_limits_the_median(limit: float, met: bool) -> None:
    assert result(Target("parsing", CPU, "", at_most=limit))["targets"][0]["met"] is met


def test_a_target_may_be_a_minimum() -> None:
    assert result(Target("parsing", CPU, "", at_least=1.1))["targets"][0]["met"] is False


def test_a_target_without_a_measurement_is_neither_met_nor_missed() -> None:
    target = result(Target("parsing", CPU, "", at_most=1.0, peer="MAVSDK"))["targets"][0]
    assert (target["value"], target["met"]) == (None, None)


def test_a_table_has_medians_with_extremes_ratios_and_missing_programs() -> None:
    text = render(whole(result(Target("parsing", CPU, "parsing: at most 1/9", at_most=1 / 9, peer=PYMAVLINK))))
    assert "| parsing: at most 1/9 | 1/9 pymavlink | yes |" in text
    assert "| parsing | CPU per frame, us | 1 (1-5) | 10 (9-40) | 1/9 |" in text
    assert text.count("- MAVSDK: not there") == 1


def whole(case: dict[str, Any]) -> dict[str, Any]:
    """The result of a run with one case."""
    machine = {"cpu": "a CPU", "cores": 2, "kernel": "6", "python": "3.11", "load": 0.1}
    return {
        "machine": machine, "versions": {"pymavlink": "2"}, "rounds": 3, "quick": False, "date": "today",
        "cases": [case],
    }  # fmt: skip


def test_a_table_replaces_the_text_between_the_marks_of_a_page() -> None:
    assert into(f"before\n{BEGIN}old\n{END}after\n", "new\n") == f"before\n{BEGIN}new\n{END}after\n"
    with pytest.raises(ValueError, match="lacks the lines"):
        into("a page\n", "new\n")


def test_the_table_in_the_documents_is_that_of_the_committed_result() -> None:
    page = (ROOT / "docs" / "performance.md").read_text()
    committed = json.loads((ROOT / "bench" / "results" / "results.json").read_text())
    assert into(page, render(committed)) == page, (
        "run python -m bench.report bench/results/results.json docs/performance.md"
    )
