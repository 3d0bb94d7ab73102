"""A small file in the state directory, replaced as a whole. A thread can write it: the loop waits for no disk."""

from __future__ import annotations

import logging
import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Final

log = logging.getLogger(__name__)

PATIENCE: Final = 2.0  # s to wait for a running write at shutdown


class StateFile:
    """One file. Its first fault is logged, and none is raised."""

    def __init__(self, path: Path, what: str, without: str) -> None:
        """`what` names the contents in messages; `without` says how it goes on without the file."""
        self._path, self._what, self._without = path, what, without
        self._writer: threading.Thread | None = None
        self._warned = False

    @property
    def writing(self) -> bool:
        """Whether the thread is writing."""
        return self._writer is not None and self._writer.is_alive()

    def read(self, most: int) -> bytes | None:
        """The first `most` bytes; None if there is no file, or it cannot be read. Waits for the disk."""
        try:
            with open(self._path, "rb") as file:
                return file.read(most)
        except FileNotFoundError:
            return None
        except OSError as error:
            self.warn(f"cannot read the {self._what}: {error.strerror}")
            return None

    def write_later(self, data: bytes, *, sync: bool = True) -> None:
        """As `write`, in a thread. Only called while none is `writing`."""
        self._writer = threading.Thread(target=self.write, args=(data, sync), name="state", daemon=True)
        self._writer.start()

    def write(self, data: bytes, sync: bool = True) -> None:
        """Replace the file atomically: write a temporary file next to it, then rename."""
        temporary = self._path.with_name(f"{self._path.name}.{os.getpid()}")
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(data)
                file.flush()
                if sync:
                    os.fsync(file.fileno())
            os.replace(temporary, self._path)
        except OSError as error:
            self.warn(f"cannot write the {self._what}: {error.strerror}")
            with suppress(OSError):
                temporary.unlink()

    def settle(self) -> bool:
        """Wait for a running write, at most PATIENCE seconds. True if no write is running."""
        if self._writer is not None:
            self._writer.join(PATIENCE)
        return not self.writing

    def warn(self, text: str) -> None:
        """Log a fault of the file, unless one was logged."""
        if not self._warned:
            self._warned = True
            log.warning("%s: %s; %s", self._path, text, self._without)
