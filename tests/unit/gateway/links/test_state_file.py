"""A small file that is replaced as a whole. `test_signing_keys.py` has its faults and its thread."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from mav_robot_status.gateway.links.state_file import StateFile


def test_what_was_written_is_read_up_to_a_limit(tmp_path: Path) -> None:
    file = StateFile(tmp_path / "made" / "a.state", "state", "it goes on")
    assert file.read(5) is None
    file.write_later(b"0123456789")
    assert file.settle()
    assert not file.writing
    assert file.read(5) == b"01234"


def test_files_that_differ_in_their_ending_do_not_share_a_temporary_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary, replace = set(), os.replace

    def note(old: Path, new: Path) -> None:
        temporary.add(old)
        replace(old, new)

    monkeypatch.setattr(os, "replace", note)
    for name in ("a.stamp", "a.heard"):
        StateFile(tmp_path / name, "state", "it goes on").write(b"x")
    assert len(temporary) == 2
    assert sorted(os.listdir(tmp_path)) == ["a.heard", "a.stamp"]


def test_only_the_first_fault_is_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").touch()
    file = StateFile(tmp_path / "file" / "a.state", "state", "it goes on")
    assert file.read(5) is None
    file.write(b"x")
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path}/file/a.state: cannot read the state: Not a directory; it goes on"
    ]
