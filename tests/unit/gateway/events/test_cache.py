from __future__ import annotations

import lzma
import os
import stat
import time
from pathlib import Path

import pytest

from mav_robot_status.gateway.events.cache import MOST_FILES, EventTableCache, default_folder
from mav_robot_status.mavlink.ftp.metadata import MOST_TABLE

DATA = lzma.compress(b'{"components": {}}')


def test_a_stored_table_is_loaded_by_its_checksum(tmp_path: Path) -> None:
    cache = EventTableCache(tmp_path / "new" / "events")
    assert cache.load(0x1A2B) is None
    cache.store(0x1A2B, DATA)
    assert cache.load(0x1A2B) == DATA
    (file,) = (tmp_path / "new" / "events").iterdir()
    assert file.name == "00001A2B.json.xz"
    assert stat.S_IMODE(file.stat().st_mode) == 0o644


def test_a_table_that_is_not_packed_is_packed(tmp_path: Path) -> None:
    cache = EventTableCache(tmp_path)
    cache.store(1, b"{}")
    assert lzma.decompress(cache.load(1) or b"") == b"{}"


def test_the_number_of_files_is_bounded_and_the_one_used_least_recently_goes(tmp_path: Path) -> None:
    cache = EventTableCache(tmp_path)
    (tmp_path / "notes.txt").write_text("somebody else's")
    for crc in range(MOST_FILES):
        cache.store(crc, DATA)
        os.utime(tmp_path / f"{crc:08X}.json.xz", (crc, crc))
    assert cache.load(0) == DATA  # used now
    cache.store(MOST_FILES, DATA)
    assert [crc for crc in range(MOST_FILES + 1) if cache.load(crc) is None] == [1]
    assert (tmp_path / "notes.txt").exists()
    assert not list(tmp_path.glob(".new-*"))


def test_what_a_killed_program_has_left_is_removed(tmp_path: Path) -> None:
    for name, age in ((".new-old", 4000), (".new-young", 10)):
        (tmp_path / name).write_bytes(b"half")
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    EventTableCache(tmp_path).store(1, DATA)
    assert {path.name for path in tmp_path.iterdir()} == {".new-young", "00000001.json.xz"}


def test_a_file_that_is_no_table_is_not_loaded(tmp_path: Path) -> None:
    cache = EventTableCache(tmp_path)
    (tmp_path / "00000001.json.xz").write_bytes(b"{}")
    (tmp_path / "00000002.json.xz").write_bytes(b"\xfd7zXZ\0" + bytes(MOST_TABLE))
    (tmp_path / "00000003.json.xz").mkdir()
    assert [cache.load(crc) for crc in (1, 2, 3)] == [None] * 3


def test_a_cache_that_cannot_be_written_is_one_log_line(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("")
    cache = EventTableCache(tmp_path / "file" / "events")
    for crc in range(3):
        cache.store(crc, DATA)
        assert cache.load(crc) is None
    assert len(caplog.records) == 1
    assert str(tmp_path / "file") in caplog.text


def test_the_folder_is_that_of_the_service_or_of_the_user() -> None:
    assert default_folder({"CACHE_DIRECTORY": "/var/cache/x:/y", "XDG_CACHE_HOME": "/c"}) == "/var/cache/x/events"
    assert default_folder({"XDG_CACHE_HOME": "/c"}) == "/c/mav-robot-status/events"
    home = os.path.expanduser("~/.cache/mav-robot-status/events")
    assert default_folder({"XDG_CACHE_HOME": "relative"}) == default_folder({}) == home
