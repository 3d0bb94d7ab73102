from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.commands.check_config import run
from mav_robot_status.errors import ConfigError

from .said import said


def test_it_describes_a_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "c.yaml"
    config.write_text("links: [udp:127.0.0.1:14550]\n")
    assert run(said("check-config", str(config))) == 0
    assert "listening on 127.0.0.1:14550/udp" in capsys.readouterr().out


@pytest.mark.parametrize("value", ["auto", "true", "false", "never"])
def test_it_says_that_a_key_has_no_effect_any_more(
    value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "c.yaml"
    config.write_text(f"kernel_filter: {value}\n")
    assert run(said("check-config", str(config))) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "kernel_filter" in line)
    assert line.startswith(f"{config}:1:1: kernel_filter has no effect any more: ")


@pytest.mark.parametrize(
    ("publisher", "fault"),
    [
        ("{type: jsn}", "nothing is registered as 'jsn' in mav_robot_status.publishers; did you mean 'json'?"),
        ("{type: json, pth: x}", "json: unknown option 'pth'; did you mean 'path'?"),
        ("{type: json, format: xml}", "json: format: must be one of native, ros1, ros2, not 'xml'"),
        ("{type: json, changes_only: 7}", "json: changes_only: must be true or false, not 7"),
        ("{type: mavlink, rate: 4}", "mavlink: unknown option 'rate'; there are none"),
        ("{type: mirror, rate: 4}", "mirror: unknown option 'rate'; there are none"),
        ("{type: http, port: 1}", "http: unknown option 'port'; the options are listen, token_file, open, hosts"),
        ("{type: mqtt, url: broker}", "mqtt: "),
    ],
)
def test_a_fault_in_publisher_options_is_reported_with_its_position(publisher: str, fault: str, tmp_path: Path) -> None:
    config = tmp_path / "c.yaml"
    kind = "mav_robot_status/IndustrialRobotStatusController"
    config.write_text(f"mine:\n  type: {kind}\n  publishers:\n    - mavlink\n    - {publisher}\n")
    with pytest.raises(ConfigError) as raised:
        run(said("check-config", str(config)))
    assert str(raised.value).startswith(f"{config}:5:7: {fault}")
    assert "\n" not in str(raised.value)
