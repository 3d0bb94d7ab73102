"""The profile accounts for each instruction that the guard counts."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter

import pytest

from bench import guard
from bench.profile import EVENTS, part_of, profile, table

from ...deadline import allow
from ...docs.documents import ROOT


@pytest.mark.parametrize(
    ("file", "part"),
    [
        ("/x/mav_robot_status/controller.py", "controller.py"),
        ("/x/mav_robot_status/gateway/pace.py", "gateway/pace.py"),
        ("/x/mav_robot_status/hardware/mavlink/faults/rule.py", "hardware/mavlink/faults"),
        ("/y/mav_robot_status/lib/mav_robot_status/links/udp.py", "links"),
        ("/usr/lib/python3.11/json/encoder.py", "standard library and generated code"),
        ("<string>", "standard library and generated code"),
    ],
)
def test_a_file_belongs_to_the_part_that_its_folder_names(file: str, part: str) -> None:
    assert part_of(file) == part


def test_small_parts_are_one_row_and_the_rows_add_up() -> None:
    rows = table(Counter({"large": 990, "small": 4, "smaller": 6, "smallest": 0})).splitlines()
    assert [row.split(maxsplit=3)[0::3] for row in rows] == [
        ["990", "large"], ["6", "smaller"], ["4", "other files"], ["1000", "all"],
    ]  # fmt: skip


def test_a_profile_has_the_parts_that_take_part() -> None:
    found = profile(guard.changes())
    assert {"links", "mavlink", "hardware/mavlink/faults", "controller.py", "publishers"} <= set(found)


def test_the_command_prints_each_event() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bench.profile"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=allow(120),
        check=True,
    )
    assert all(f"instructions for {event}:" in done.stdout for event in EVENTS)
