from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.commands.check_config import run
from mav_robot_status.errors import ConfigError

from .said import said


def test_it_says_what_a_configuration_means(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "c.yaml"
    config.write_text("links: [udp:127.0.0.1:14550]\n")
    assert run(said("check-config", str(config))) == 0
    assert "listening on 127.0.0.1:14550/udp" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("publisher", "fault"),
    [
        ("{type: jsn}", "nothing is registered as 'jsn' in mav_robot_status.publishers; did you mean 'json'?"),
        ("{type: json, pth: x}", "json: unknown option 'pth'; there are path, format and changes_only"),
        ("{type: json, format: xml}", "json: format 'xml' is none of native, ros1, ros2"),
        ("{type: json, changes_only: 7}", "json: changes_only must be true or false, not '7'"),
        ("{type: mavlink, rate: 4}", "mavlink: unknown option 'rate'; there are none"),
        ("{type: mirror, rate: 4}", "mirror: unknown option 'rate'; there are none"),
        ("{type: http, port: 1}", "http: unknown option 'port'; there are listen, token_file, open, hosts"),
        ("{type: mqtt, url: broker}", "mqtt: "),
    ],
)
def test_a_fault_in_a_publishers_options_is_found_at_its_place(publisher: str, fault: str, tmp_path: Path) -> None:
    config = tmp_path / "c.yaml"
    kind = "mav_robot_status/IndustrialRobotStatusController"
    config.write_text(f"mine:\n  type: {kind}\n  publishers:\n    - mavlink\n    - {publisher}\n")
    with pytest.raises(ConfigError) as raised:
        run(said("check-config", str(config)))
    assert str(raised.value).startswith(f"{config}:5:7: {fault}")
    assert "\n" not in str(raised.value)
