from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.commands.run import run
from mav_robot_status.errors import UsageError

from .said import said


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("udp:127.0.0.1:0",), "replayed alone"),
        (("--out", "127.0.0.1:1"), "replayed alone"),
        (("--http", ":0"), "write `mav-robot-status report a.tlog`"),
        (("--mqtt", "mqtt://b/x"), "without --mqtt"),
        (("--simple-message", ":0"), "without --simple-message"),
        (("--record", "x"), "without --record and --forward"),
        (("--forward",), "without --record and --forward"),
        (("udp:nowhere",), "udp:nowhere"),
    ],
)
def test_a_log_is_replayed_alone(arguments: tuple[str, ...], told: str) -> None:
    with pytest.raises(UsageError, match=told):
        run(said("run", "a.tlog", *arguments))


def test_a_log_in_the_configuration_is_replayed_too(tmp_path: Path) -> None:
    config = tmp_path / "c.yaml"
    config.write_text("links: [a.tlog, udp:127.0.0.1:14550]\n")
    with pytest.raises(UsageError, match="a recorded log is replayed alone"):
        run(said("run", "--config", str(config)))
