"""Tests of the command that installs an extra."""

from __future__ import annotations

import shlex
import sys

import pytest

from mav_robot_status.extras import install, packages


def test_the_command_is_that_of_the_running_python() -> None:
    assert shlex.split(install("watch", "web")) == [
        sys.executable,
        "-m",
        "pip",
        "install",
        "mav-robot-status[watch,web]",
    ]


def test_a_folder_with_blanks_is_quoted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/home/an other/.venv/bin/python")
    assert shlex.split(install("web"))[0] == "/home/an other/.venv/bin/python"


def test_in_an_environment_of_pipx_it_is_pipx(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", "/home/me/.local/share/pipx/venvs/mav-robot-status")
    assert install("web") == "pipx inject mav-robot-status tornado"
    assert install("mqtt", "web") == "pipx inject mav-robot-status paho-mqtt tornado"


def test_an_extra_has_its_packages() -> None:
    assert packages("web") == ["tornado"]
    assert packages("none of that name") == []
