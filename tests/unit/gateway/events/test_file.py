"""The file of PX4's events: read at the start, and every error is one line."""

from __future__ import annotations

import json
import lzma
from pathlib import Path

import pytest

from mav_robot_status.config import Config
from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.events.file import event_table
from mav_robot_status.gateway.mavlink_hardware import robot_hw
from mav_robot_status.hardware.mavlink.options import HardwareOptions

from ...hardware.mavlink.px4_reports import NO_FIX, document


def naming(path: Path | str) -> Config:
    return Config(hardware=HardwareOptions(px4_events=str(path)))


def test_without_the_option_there_is_no_table() -> None:
    assert event_table(Config()) is None


@pytest.mark.parametrize("name", ["all_events.json", "all_events.json.xz"])
def test_json_and_xz_are_read(tmp_path: Path, name: str) -> None:
    data = json.dumps(document()).encode()
    (tmp_path / name).write_bytes(lzma.compress(data) if name.endswith("xz") else data)
    table = event_table(naming(tmp_path / name))
    assert table is not None
    assert NO_FIX in table.events
    robot_hw(naming(tmp_path / name))


def test_a_file_that_cannot_be_used_is_one_line_with_its_name(tmp_path: Path) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{}")
    for path, word in ((tmp_path / "absent.json", "No such file"), (tmp_path, "directory"), (bad, "no event")):
        with pytest.raises(UsageError, match=word) as error:
            event_table(naming(path))
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)
    with pytest.raises(UsageError, match="null"):
        event_table(naming("a\0b"))
