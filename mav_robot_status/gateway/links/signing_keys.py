"""The files of signing: the key, which the user writes, and the time stamps, which must survive a restart."""

from __future__ import annotations

import math
import os
import re
import zlib
from hashlib import sha256
from pathlib import Path
from typing import Final

from ...errors import UsageError
from ...mavlink.signing import MAX_STAMP, MAX_STREAMS, UNITS_PER_SECOND, Stamps, stamp_at
from ...user_files import read_secret, state_folder
from .state_file import StateFile

MAX_BYTES: Final = 4096
"""The size limit of a key file."""
PREFIX: Final = "passphrase:"
FORM: Final = f"write one line, 64 hexadecimal digits or '{PREFIX} ...'"
HEX: Final = re.compile("[0-9a-fA-F]{64}")

RESERVE: Final = 40 * UNITS_PER_SECOND
"""Lead of the time stamp on disk. Less than the minute that a peer may be behind us after a crash."""
RENEW: Final = 10 * UNITS_PER_SECOND
"""When the lead falls below this, the next stamp is written: every 30 s, and 10 s before it is needed."""
HEARD_PERIOD: Final = 2.0  # s between two writes of the stamps that were heard
LINE: Final = len(f"255 255 {MAX_STAMP}\n")  # bytes of one stamp that was heard, at most


def read_key(path: str | os.PathLike[str]) -> bytes:
    """Read the 32-byte key from a file: 64 hexadecimal digits, or `passphrase: ...`.

    The key of a passphrase is its SHA-256, as in MAVProxy and Mission Planner. Blanks around it are ignored. Raises
    UsageError; the message never contains the contents of the file.
    """
    name, data = read_secret(path, "signing key", MAX_BYTES + 1)
    try:
        text = data.decode("utf-8-sig").strip()
    except UnicodeDecodeError:
        raise UsageError(f"{name}: the signing key is not UTF-8 text: {FORM}") from None
    if not text:
        raise UsageError(f"{name}: the signing key is empty: {FORM}")
    passphrase = text.removeprefix(PREFIX).strip()
    if text.startswith(PREFIX) and passphrase and text.isprintable() and len(data) <= MAX_BYTES:
        return sha256(passphrase.encode()).digest()
    if not HEX.fullmatch(text):
        raise UsageError(f"{name}: this is not a signing key: {FORM}")
    key = bytes.fromhex(text)
    if not any(key):
        raise UsageError(f"{name}: a signing key of zeros means 'unsigned' in MAVLink: choose another")
    return key


def stamp_path(key: bytes) -> Path:
    """The file of a key's time stamp, in systemd's STATE_DIRECTORY or the user's state folder.

    The name differs for each key, and does not reveal the key. The stamps that were heard are in a file beside it.
    """
    name = sha256(b"stamp of " + sha256(key).digest()).hexdigest()[:16]
    return Path(state_folder(), f"{name}.stamp")


class StampStore:
    """Stores the signing time stamp on disk ahead of its use, so that a crash or a clock step never reuses a stamp.

    The stored stamp leads the clock, so one write every 30 s is enough. A separate thread writes, because the loop
    must not wait for a disk. After a jump (a peer was far ahead) the stamp is on disk some milliseconds after its
    first use. A failed write is logged once, and signing continues.
    """

    def __init__(self, path: Path) -> None:
        self._file = StateFile(path, "signing time stamp", "signing continues with the clock alone")
        self._reserved = 0

    def start(self, unix_us: int) -> int:
        """The first stamp at this time. Reads the file and writes it; both wait for the disk."""
        stamp = max(self._read(), stamp_at(unix_us))
        self._file.write(self._reserve(stamp))
        return stamp

    def keep(self, stamp: int) -> None:
        """Store the last stamp that was used or received, if it is due. Called in every turn; never waits."""
        if self._reserved - stamp >= RENEW or self._reserved == MAX_STAMP:
            return
        if not self._file.writing:
            self._file.write_later(self._reserve(stamp))

    def close(self, stamp: int) -> None:
        """Write the last stamp without a lead, so that the next start skips no stamps."""
        if self.settle():
            self._file.write(b"%d\n" % stamp)

    def settle(self) -> bool:
        """Wait for a running write, see `StateFile.settle`."""
        return self._file.settle()

    def _reserve(self, stamp: int) -> bytes:
        self._reserved = min(stamp + RESERVE, MAX_STAMP)
        return b"%d\n" % self._reserved

    def _read(self) -> int:
        data = self._file.read(32)
        if data is None:
            return 0
        text = data.strip()
        if not text.isdigit() or int(text) > MAX_STAMP:
            self._file.warn("this is not a signing time stamp")
            return 0
        return int(text)


class HeardStore:
    """Stores the newest verified stamp of each sender, so that what was recorded before a restart is not news after it.

    A kill of the process loses at most HEARD_PERIOD. The disk is not synced: a power failure may lose half a minute.
    """

    def __init__(self, path: Path) -> None:
        self._file = StateFile(
            path, "list of the time stamps heard", "frames recorded before this start are refused only by their age"
        )
        self._written = b""
        self._due = -math.inf

    def start(self) -> Stamps:
        """The stamps of the run before; none if the file is absent or damaged. Waits for the disk."""
        data = self._file.read(LINE * (MAX_STREAMS + 1))
        if data is None:
            return {}
        try:
            return _heard(data)
        except ValueError:
            self._file.warn("this is not a list of the time stamps heard")
            return {}

    def keep(self, newest: Stamps, now: float) -> None:
        """Store the stamps if they are due and have changed; `now` is monotonic seconds. Never waits."""
        if now < self._due or self._file.writing:
            return
        self._due = now + HEARD_PERIOD
        data = _list(newest)
        if data != self._written:
            self._written = data
            self._file.write_later(data, sync=False)

    def close(self, newest: Stamps) -> None:
        """Write the last stamps."""
        if self._file.settle():
            self._file.write(_list(newest))


def _list(newest: Stamps) -> bytes:
    """A checksum, then a line for each sender. Of more than MAX_STREAMS, those with the newest stamps."""
    rows = sorted(newest.items(), key=lambda row: -row[1])[:MAX_STREAMS]
    text = "".join(f"{system} {component} {stamp}\n" for (system, component), stamp in rows).encode()
    return b"%08x\n%s" % (zlib.crc32(text), text)


def _heard(data: bytes) -> Stamps:
    """The stamps in a list. Raises ValueError if it is damaged."""
    checksum, _, text = data.partition(b"\n")
    if checksum != b"%08x" % zlib.crc32(text):
        raise ValueError
    stamps = {}
    for line in text.splitlines():
        system, component, stamp = map(int, line.split())
        stamps[system, component] = min(stamp, MAX_STAMP)
    return stamps
