from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.commands.applet import run
from mav_robot_status.errors import LinkError

from .said import said

SCRIPT = (Path(__file__).parents[3] / "contrib" / "ardupilot" / "robot_status.lua").read_text("utf-8")


def test_the_script_goes_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(said("applet")) == 0
    assert capsys.readouterr().out == SCRIPT


def test_the_script_is_written_to_the_given_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot_status.lua"
    assert run(said("applet", "-o", str(file))) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert file.read_text("utf-8") == SCRIPT


def test_a_file_that_cannot_be_written_is_an_error_of_one_line(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot write .*: Is a directory"):
        run(said("applet", "-o", str(tmp_path)))
