from __future__ import annotations

import os
from pathlib import Path

import pytest

from mav_robot_status.commands.dialect import run

from .said import said


def test_the_files_are_written_to_the_given_directory(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(said("dialect", "-o", str(tmp_path))) == 0
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / "mav_robot_status.xml"), str(tmp_path / "mav_robot_status.lua"),
    ]  # fmt: skip
    assert sorted(os.listdir(tmp_path)) == ["mav_robot_status.lua", "mav_robot_status.xml"]
