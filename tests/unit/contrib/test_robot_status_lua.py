"""The applet, run by a real Lua 5.3, the version in ArduPilot, against scripted bindings (`autopilot.lua`)."""

from __future__ import annotations

import shutil
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

from mav_robot_status.data_files import data_file

HERE = Path(__file__).parent
APPLET = data_file("robot_status.lua", "contrib/ardupilot")
LUA = shutil.which("lua5.3")
FREE, STOPPED, SAFE, BOTH, SILENT = "false false", "true false", "false true", "true true", "nil nil"

pytestmark = pytest.mark.skipif(LUA is None, reason="lua5.3 is not installed: sudo apt-get install lua5.3")


class Said(NamedTuple):
    """What the applet did."""

    sent: list[tuple[int, float]]
    """Milliseconds and value of each RS_STOP."""
    texts: list[str]
    runs: int
    allocated: float


def played(milliseconds: int, *steps: tuple[int, str], late: int = 0) -> Said:
    """Run the applet for some time, with what the bindings return from each time on."""
    script = [word for at, words in steps for word in (str(at), *words.split())]
    command = [str(LUA), str(HERE / "autopilot.lua"), str(APPLET), str(milliseconds), str(late), *script]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    assert all(name == "RS_STOP" for kind, *rest in rows if kind == "sent" for name in rest[1:2])
    return Said(
        [(int(row[1]), float(row[3])) for row in rows if row[0] == "sent"],
        [row[2] for row in rows if row[0] == "text"],
        *(int(row[1]) for row in rows if row[0] == "runs"),
        *(float(row[1]) for row in rows if row[0] == "allocated"),
    )


@pytest.mark.parametrize(("state", "value"), [(FREE, 0), (STOPPED, 1), (SAFE, 2), (BOTH, 3)])
def test_the_value_has_a_bit_for_the_stop_and_a_bit_for_the_safety_switch(state: str, value: float) -> None:
    assert {said for _, said in played(5000, (0, state)).sent} == {value}


def test_it_sends_at_once_and_then_once_a_second() -> None:
    times = [at for at, _ in played(60_000, (0, FREE)).sent]
    assert times[0] == 0
    assert {after - before for before, after in pairwise(times)} == {1000}


@pytest.mark.parametrize("at", [2001, 2013, 2999, 3000, 3024])
@pytest.mark.parametrize("late", [0, 10, 20])
def test_it_sends_a_change_within_50_ms_although_the_scheduler_is_late(at: int, late: int) -> None:
    changes = played(10_000, (0, FREE), (at, STOPPED), (at + 4000, FREE), late=late).sent
    stopped = next(when for when, value in changes if value == 1)
    released = next(when for when, value in changes if value == 0 and when > stopped)
    assert 0 <= stopped - at <= 50
    assert 0 <= released - (at + 4000) <= 50


def test_a_scheduler_that_is_late_does_not_make_it_silent() -> None:
    times = [at for at, _ in played(60_000, (0, FREE), late=25).sent]
    assert max(after - before for before, after in pairwise(times)) <= 2000


def test_it_sends_nothing_while_a_binding_returns_nil_and_goes_on_after_it() -> None:
    said = played(10_000, (0, FREE), (2500, SILENT), (6500, STOPPED))
    assert not [at for at, _ in said.sent if 2500 <= at < 6500]
    assert said.sent[-4:] == [(6500, 1), (7500, 1), (8500, 1), (9500, 1)]


def test_firmware_without_the_bindings_is_told_once_and_the_script_ends() -> None:
    said = played(5000, (0, "none none"))
    assert said.sent == []
    assert said.texts == ["robot_status.lua: firmware lacks its bindings"]
    assert len(said.texts[0]) <= 50, "one STATUSTEXT"
    assert said.runs == 1


def test_no_run_allocates_memory() -> None:
    said = played(60_000, (0, FREE), (5000, STOPPED), (9000, BOTH), (20_000, FREE))
    assert said.runs > 2000
    assert said.allocated == 0
