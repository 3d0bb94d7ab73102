from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.commands.check_config import run

from .said import said


def test_it_says_what_a_configuration_means(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "c.yaml"
    config.write_text("links: [udp:127.0.0.1:14550]\n")
    assert run(said("check-config", str(config))) == 0
    assert "listening on 127.0.0.1:14550/udp" in capsys.readouterr().out
