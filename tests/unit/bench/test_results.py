"""Samples, their medians against targets, and the tables."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import pytest

from bench.report import BEGIN, END, RESULTS, committed, into, render, write
from bench.results import FIRST_MACHINE, OURS, PYMAVLINK, Sample, Skip, Target, collect

from ...docs.documents import ROOT

CPU = "CPU per frame, us"


RATIO = Target("parsing", CPU, "parsing: at most 1/9", at_most=1 / 9, peer=PYMAVLINK)
NEW = Target("parsing", CPU, "parsing: new", at_most=1 / 90, peer=PYMAVLINK)
LIMIT = Target("parsing", CPU, "parsing: at most 4 us", at_most=4.0, machine=FIRST_MACHINE)


def result(*targets: Target, speed: float | None = None) -> dict[str, Any]:
    """Three rounds; the machine is slow in one."""
    rounds: list[list[Sample | Skip]] = [
        [Sample("parsing", CPU, OURS, mine), Sample("parsing", CPU, PYMAVLINK, theirs), Skip("", "MAVSDK", "not there")]
        for mine, theirs in ((1.0, 10.0), (5.0, 40.0), (1.0, 9.0))
    ]
    return collect("parse", "Parsing", rounds, targets, speed)


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


@pytest.mark.parametrize(("speed", "met"), [(FIRST_MACHINE, False), (3 * FIRST_MACHINE, True), (None, False)])
def test_an_absolute_target_of_a_machine_is_scaled_by_the_time_to_parse_a_frame(speed: float | None, met: bool) -> None:
    target = Target("parsing", CPU, "", at_most=0.5, machine=FIRST_MACHINE)
    assert result(target, speed=speed)["targets"][0]["met"] is met


def test_a_minimum_of_a_machine_is_lower_on_a_slower_one() -> None:
    target = Target("parsing", CPU, "", at_least=10.0, machine=FIRST_MACHINE)
    assert target.scaled(2 * FIRST_MACHINE).at_least == pytest.approx(5.0)


def test_a_table_has_medians_with_extremes_ratios_and_missing_programs() -> None:
    text = render(whole(result(RATIO)))
    assert "| parsing: at most 1/9 | 1/9 pymavlink | yes |" in text
    assert "| parsing | CPU per frame, us | 1 (1-5) | 10 (9-40) | 1/9 |" in text
    assert text.count("- MAVSDK: not there") == 1


def test_a_busy_machine_has_ratios_only() -> None:
    text = render({**whole(result(RATIO, LIMIT)), "busy": "eight test suites"})
    assert "The machine is busy: eight test suites." in text
    assert "| parsing: at most 1/9 | 1/9 pymavlink | yes |" in text
    assert "| parsing: at most 4 us | - | not measured |" in text
    assert "| parsing | CPU per frame, us | 1/9 |" in text
    assert "10 (9-40)" not in text


def test_a_variant_of_ours_is_compared_with_ours() -> None:
    rounds: list[list[Sample | Skip]] = [[Sample("a", CPU, OURS, 2.0), Sample("a", CPU, "ours, slow", 4.0)]]
    text = render(whole(collect("parse", "Parsing", rounds, ())))
    assert "|  |  | ours | ours, slow | ours, slow / ours |" in text
    assert "| a | CPU per frame, us | 2 | 4 | 2x |" in text


def test_the_result_of_an_earlier_run_is_a_column_of_the_targets() -> None:
    earlier = {**whole(result(RATIO, LIMIT)), "date": "yesterday"}
    text = render(whole(result(RATIO, NEW)), earlier)
    assert "Before: yesterday, mav-robot-status 1." in text
    assert "| target | before | measured | met |" in text
    assert "| parsing: at most 1/9 | 1/9 pymavlink | 1/9 pymavlink | yes |" in text
    assert "| parsing: new | - | 1/9 pymavlink | **no** |" in text


@pytest.mark.parametrize(("date", "compared"), [("yesterday", True), ("today", False)])
def test_the_committed_tables_compare_with_an_earlier_run_but_not_with_the_same(
    tmp_path: pathlib.Path, date: str, compared: bool
) -> None:
    (tmp_path / "results.json").write_text(json.dumps(whole(result(RATIO))))
    (tmp_path / "before.json").write_text(json.dumps({**whole(result(RATIO)), "date": date}))
    assert ("Before: " in committed(tmp_path)) is compared


def test_a_page_gets_the_targets_and_no_other_table(tmp_path: pathlib.Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"{BEGIN}{END}")
    (tmp_path / "results.json").write_text(json.dumps(whole(result(RATIO))))
    write(page, tmp_path)
    assert "| parsing: at most 1/9 | 1/9 pymavlink | yes |" in page.read_text()
    assert "### Parsing" not in page.read_text()


def whole(case: dict[str, Any]) -> dict[str, Any]:
    """The result of a run with one case."""
    machine = {"cpu": "a CPU", "cores": 2, "kernel": "6", "python": "3.11", "load": 0.1}
    return {
        "machine": machine, "busy": "", "versions": {"mav-robot-status": "1", "pymavlink": "2"}, "rounds": 3,
        "quick": False, "date": "today", "parse_us": 7.3, "cases": [case],
    }  # fmt: skip


def test_a_table_replaces_the_text_between_the_marks_of_a_page() -> None:
    assert into(f"before\n{BEGIN}old\n{END}after\n", "new\n") == f"before\n{BEGIN}new\n{END}after\n"
    with pytest.raises(ValueError, match="lacks the lines"):
        into("a page\n", "new\n")


def test_the_tables_in_the_documents_are_those_of_the_committed_results(tmp_path: pathlib.Path) -> None:
    page = (ROOT / "docs" / "performance.md").read_text()
    copy = tmp_path / "page.md"
    copy.write_text(page)
    write(copy, RESULTS)
    assert copy.read_text() == page, "run python -m bench.report docs/performance.md"
