"""What signing keeps in files: the key, which a person writes, and the time stamp, which outlasts a restart."""

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
"""Of a key file."""
OF_OTHERS: Final = S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH
PREFIX: Final = "passphrase:"
FORM: Final = f"write one line, 64 hexadecimal digits or '{PREFIX} ...'"
HEX: Final = re.compile("[0-9a-fA-F]{64}")

RESERVE: Final = 40 * UNITS_PER_SECOND
"""The stamp on disk is so far ahead: less than the minute that a peer may be behind us when we start after a crash."""
RENEW: Final = 10 * UNITS_PER_SECOND
"""With so little left it is written anew: once in 30 s, and ten seconds before it is needed."""
PATIENCE: Final = 2.0  # s to wait at the end for a write that has begun


def read_key(path: str | os.PathLike[str]) -> bytes:
    """The 32 bytes of a key file: 64 hexadecimal digits, or `passphrase: ...`, of which the key is the SHA-256.

    So it is with MAVProxy and Mission Planner. Blanks around the passphrase do not count. Raises UsageError, which
    never shows what is in the file.
    """
    name = os.path.expanduser(path)
    try:
        with open(name, "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if mode & OF_OTHERS:
                raise UsageError(f"{name}: others than its owner can read or change this signing key: chmod 600 {name}")
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
        raise UsageError(f"{name}: a signing key of zeros stands for 'unsigned' in MAVLink: choose another")
    return key


def stamp_path(key: bytes) -> Path:
    """Where the time stamp of a key is kept: systemd's STATE_DIRECTORY, else the user's folder for state.

    The name tells keys apart and is of no help in finding one.
    """
    home = os.environ.get("XDG_STATE_HOME", "")
    if not os.path.isabs(home):  # then it does not count: https://specifications.freedesktop.org/basedir-spec
        home = os.path.expanduser("~/.local/state")
    folder = os.environ.get("STATE_DIRECTORY", "").split(":")[0] or os.path.join(home, "mav-robot-status")
    name = sha256(b"stamp of " + sha256(key).digest()).hexdigest()[:16]
    return Path("/", folder, f"{name}.stamp")  # in a home that nobody knows it is nowhere, rather than here


class StampStore:
    """Keeps the signing time stamp on disk, ahead of its use: no stamp is used twice, whatever crashes or steps back.

    It is reserved for the time to come, so that it is written once in 30 s while it moves with the clock; in a thread
    of its own, for the loop must not wait for a disk. A stamp that jumps (a peer was far ahead) is on disk some
    milliseconds after its first use. If writing fails that is logged once, and all goes on.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._reserved = 0
        self._writer: threading.Thread | None = None
        self._complained = False

    def start(self, unix_us: int) -> int:
        """The stamp to go on from at this time, and the first write; both wait for the disk."""
        stamp = max(self._read(), stamp_at(unix_us))
        self._reserve(stamp)
        self._write(self._reserved)
        return stamp

    def keep(self, stamp: int) -> None:
        """Tell the last stamp that was used or heard; at every turn of the loop. Never waits."""
        if self._reserved - stamp >= RENEW or self._reserved == MAX_STAMP:
            return
        if self._writer is None or not self._writer.is_alive():
            self._reserve(stamp)
            self._writer = threading.Thread(target=self._write, args=(self._reserved,), name="stamp", daemon=True)
            self._writer.start()

    def close(self, stamp: int) -> None:
        """Write the last stamp as it is, so that the next start need not skip what was reserved."""
        if self.settle():
            self._write(stamp)

    def settle(self) -> bool:
        """Wait for a write that has begun, at most PATIENCE seconds; whether it has ended."""
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
            self._complain(f"cannot read the last signing time stamp: {error.strerror}")
            return 0
        if not text.isdigit() or int(text) > MAX_STAMP:
            self._complain("this is not a signing time stamp")
            return 0
        return int(text)

    def _write(self, stamp: int) -> None:
        """The whole file or nothing of it: beside it first, and then in its place."""
        beside = self._path.with_suffix(f".{os.getpid()}")
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with open(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(b"%d\n" % stamp)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, self._path)
        except OSError as error:
            self._complain(f"cannot keep the signing time stamp: {error.strerror}")
            with suppress(OSError):
                beside.unlink()

    def _complain(self, what: str) -> None:
        if not self._complained:
            self._complained = True
            log.warning("%s: %s; signing goes on by the clock alone", self._path, what)
