"""The files of signing: the key, which the user writes, and the time stamp, which must survive a restart."""

from __future__ import annotations

import logging
import os
import re
import threading
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from stat import S_IRGRP, S_IROTH, S_IWGRP, S_IWOTH
from typing import Final

from ..errors import UsageError
from ..mavlink.signing import MAX_STAMP, UNITS_PER_SECOND, stamp_at

log = logging.getLogger(__name__)

MAX_BYTES: Final = 4096
"""The size limit of a key file."""
OF_OTHERS: Final = S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH
PREFIX: Final = "passphrase:"
FORM: Final = f"write one line, 64 hexadecimal digits or '{PREFIX} ...'"
HEX: Final = re.compile("[0-9a-fA-F]{64}")

RESERVE: Final = 40 * UNITS_PER_SECOND
"""Lead of the time stamp on disk. Less than the minute that a peer may be behind us after a crash."""
RENEW: Final = 10 * UNITS_PER_SECOND
"""When the lead falls below this, the next stamp is written: every 30 s, and 10 s before it is needed."""
PATIENCE: Final = 2.0  # s to wait for a running write at shutdown


def read_key(path: str | os.PathLike[str]) -> bytes:
    """Read the 32-byte key from a file: 64 hexadecimal digits, or `passphrase: ...`.

    The key of a passphrase is its SHA-256, as in MAVProxy and Mission Planner. Blanks around it are ignored. Raises
    UsageError; the message never contains the contents of the file.
    """
    name = os.path.expanduser(path)
    try:
        with open(name, "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if mode & OF_OTHERS:
                raise UsageError(f"{name}: other users can read or change this signing key: chmod 600 {name}")
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"{name}: cannot read the signing key: {reason}") from None
    return _key(data, name)


def _key(data: bytes, name: str) -> bytes:
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

    The name differs for each key, and does not reveal the key.
    """
    home = os.environ.get("XDG_STATE_HOME", "")
    if not os.path.isabs(home):  # a relative path is invalid: https://specifications.freedesktop.org/basedir-spec
        home = os.path.expanduser("~/.local/state")
    folder = os.environ.get("STATE_DIRECTORY", "").split(":")[0] or os.path.join(home, "mav-robot-status")
    name = sha256(b"stamp of " + sha256(key).digest()).hexdigest()[:16]
    return Path("/", folder, f"{name}.stamp")  # never relative to the current folder, if the home is unknown


class StampStore:
    """Stores the signing time stamp on disk ahead of its use, so that a crash or a clock step never reuses a stamp.

    The stored stamp leads the clock, so one write every 30 s is enough. A separate thread writes, because the loop
    must not wait for a disk. After a jump (a peer was far ahead) the stamp is on disk some milliseconds after its
    first use. A failed write is logged once, and signing continues.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._reserved = 0
        self._writer: threading.Thread | None = None
        self._warned = False

    def start(self, unix_us: int) -> int:
        """The first stamp at this time. Reads the file and writes it; both wait for the disk."""
        stamp = max(self._read(), stamp_at(unix_us))
        self._reserve(stamp)
        self._write(self._reserved)
        return stamp

    def keep(self, stamp: int) -> None:
        """Store the last stamp that was used or received, if it is due. Called in every turn; never waits."""
        if self._reserved - stamp >= RENEW or self._reserved == MAX_STAMP:
            return
        if self._writer is None or not self._writer.is_alive():
            self._reserve(stamp)
            self._writer = threading.Thread(target=self._write, args=(self._reserved,), name="stamp", daemon=True)
            self._writer.start()

    def close(self, stamp: int) -> None:
        """Write the last stamp without a lead, so that the next start skips no stamps."""
        if self.settle():
            self._write(stamp)

    def settle(self) -> bool:
        """Wait for a running write, at most PATIENCE seconds. True if no write is running."""
        if self._writer is not None:
            self._writer.join(PATIENCE)
        return self._writer is None or not self._writer.is_alive()

    def _reserve(self, stamp: int) -> None:
        self._reserved = min(stamp + RESERVE, MAX_STAMP)

    def _read(self) -> int:
        try:
            with open(self._path, "rb") as file:
                text = file.read(32).strip()
        except FileNotFoundError:
            return 0
        except OSError as error:
            self._warn(f"cannot read the last signing time stamp: {error.strerror}")
            return 0
        if not text.isdigit() or int(text) > MAX_STAMP:
            self._warn("this is not a signing time stamp")
            return 0
        return int(text)

    def _write(self, stamp: int) -> None:
        """Replace the file atomically: write a temporary file next to it, then rename."""
        temporary = self._path.with_suffix(f".{os.getpid()}")
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(b"%d\n" % stamp)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, self._path)
        except OSError as error:
            self._warn(f"cannot write the signing time stamp: {error.strerror}")
            with suppress(OSError):
                temporary.unlink()

    def _warn(self, what: str) -> None:
        if not self._warned:
            self._warned = True
            log.warning("%s: %s; signing continues with the clock alone", self._path, what)
