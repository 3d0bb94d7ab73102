"""The tables of PX4's events on disk, by the checksum that COMPONENT_METADATA names.

The folder is `events` in systemd's CACHE_DIRECTORY or in the user's cache folder (XDG). A file is `CRC.json.xz`: xz has
its own checksum, so a damaged file is recognised. Every function here except `default_folder` waits for the disk: call
it off the loop. A gateway without a PX4 needs none of this, so what takes long to import is imported on use.
"""

from __future__ import annotations

import logging
import os
import re
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from ...mavlink.ftp.metadata import MOST_TABLE, XZ
from ...user_files import cache_folder

if TYPE_CHECKING:
    from collections.abc import Mapping

log = logging.getLogger(__name__)

MOST_FILES: Final = 64
"""The file that was used least recently goes first."""
MODE: Final = 0o644
NEW: Final = ".new-"
ABANDONED: Final = 3600.0
"""Seconds after which an unfinished file counts as left behind by a killed program."""
NAME: Final = re.compile(r"[0-9A-F]{8}\.json\.xz")


def default_folder(environment: Mapping[str, str] = os.environ) -> str:
    """Where the tables are."""
    return os.path.join(cache_folder(environment), "events")


class EventTableCache:
    """A bounded number of tables in one folder. Nothing here raises: without a disk there is no cache."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._folder = os.fspath(folder)
        self._complained = False

    def load(self, crc: int) -> bytes | None:
        """The table with this checksum, if it is there."""
        path = self._path(crc)
        try:
            with open(path, "rb") as file:
                data = file.read(MOST_TABLE + 1)
        except OSError:
            return None
        if len(data) > MOST_TABLE or not data.startswith(XZ):
            return None
        with suppress(OSError):
            os.utime(path)
        return data

    def store(self, crc: int, data: bytes) -> None:
        """Keep a table. A failure is logged once."""
        try:
            os.makedirs(self._folder, 0o755, exist_ok=True)
            if not data.startswith(XZ):
                import lzma

                data = lzma.compress(data)
            self._write(self._path(crc), data)
            self._remove_oldest()
        except OSError as error:
            if not self._complained:
                self._complained = True
                log.warning("no cache for the tables of PX4's events: %s: %s", self._folder, error.strerror or error)

    def _path(self, crc: int) -> str:
        return os.path.join(self._folder, f"{crc:08X}.json.xz")

    def _write(self, path: str, data: bytes) -> None:
        """Write a file as a whole: another process sees the old one or the new one."""
        import tempfile

        descriptor, name = tempfile.mkstemp(dir=self._folder, prefix=NEW)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
                os.fchmod(file.fileno(), MODE)
            os.replace(name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(name)
            raise

    def _remove_oldest(self) -> None:
        names = os.listdir(self._folder)
        for path in [os.path.join(self._folder, name) for name in names if name.startswith(NEW)]:
            if time.time() - _used_at(path) > ABANDONED:
                _remove(path)
        files = [os.path.join(self._folder, name) for name in names if NAME.fullmatch(name)]
        for path in sorted(files, key=_used_at)[: max(0, len(files) - MOST_FILES)]:
            _remove(path)


def _used_at(path: str) -> float:
    try:
        return os.stat(path).st_mtime
    except OSError:  # another process has removed it
        return 0.0


def _remove(path: str) -> None:
    with suppress(FileNotFoundError):  # another process has removed it
        os.unlink(path)
