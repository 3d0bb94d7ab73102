"""The man page matches the help, and roff renders it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mav_robot_status.commands import COMMANDS
from mav_robot_status.commands.completion import completed

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "man" / "mav-robot-status.1"


def test_the_man_page_is_up_to_date(tmp_path: Path) -> None:
    fresh = tmp_path / "page.1"
    subprocess.run([sys.executable, str(DOCS / "make_man.py"), str(fresh)], check=True)
    assert fresh.read_text("utf-8") == PAGE.read_text("utf-8"), "run python docs/make_man.py"


def test_the_man_page_has_every_command_and_every_option() -> None:
    text = PAGE.read_text("utf-8").replace("\\-", "-")
    assert re.findall(r"^\.SS (.*)$", text, re.MULTILINE) == list(COMMANDS)
    options = {name for command in completed().values() for flag in command.flags for name in flag.names}
    assert {name for name in options - {"-h", "--help"} if f"\\fB{name}\\fR" not in text} == set()


def test_the_man_page_renders_without_a_warning() -> None:
    if shutil.which("groff") is None:
        pytest.skip("needs groff: apt-get install groff")
    done = subprocess.run(["groff", "-man", "-ww", "-Tutf8", str(PAGE)], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert "serve the status of one vehicle to ROS" in re.sub(r"\s+", " ", re.sub(r"\x1b\[[0-9;]*m", "", done.stdout))
