"""One MCAP file: its chunks are whole, whatever fails."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final, NamedTuple

from mcap.writer import Writer

from ...version import __version__

CHUNK: Final = 1 << 18  # bytes before compression


class Buffer:
    """What `mcap` writes to: bytes that wait for the file, and their position in it."""

    def __init__(self) -> None:
        self.waiting = bytearray()
        self.written = 0

    def write(self, data: bytes) -> int:
        """Append."""
        self.waiting += data
        return len(data)

    def tell(self) -> int:
        """The position of the next byte in the file."""
        return self.written + len(self.waiting)

    def flush(self) -> None:
        """`File.write_out` does it."""


class Schema(NamedTuple):
    """The type of the messages of a channel."""

    name: str
    encoding: str
    data: bytes
    message_encoding: str


class File:
    """One file. OSError of any method: the file ends after its last whole chunk."""

    def __init__(self, path: Path, profile: str) -> None:
        """Create it. Raises FileExistsError if it exists."""
        self.descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        self.path = path
        self.first_us: int | None = None
        self.waiting = 0
        """Messages that are not in the file yet."""
        self._buffer = Buffer()
        self._writer: Any = Writer(self._buffer, chunk_size=CHUNK)  # type: ignore[arg-type]
        self._writer.start(profile=profile, library=f"mav-robot-status {__version__}")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        try:
            self.write_out()
        except OSError:
            self.close()
            path.unlink()  # a full disk would get an empty file with each attempt
            raise

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self._buffer.written

    def add(self, topic: str, schema: Schema, us: int, data: bytes, seq: int) -> None:
        """Add a message. `us` is its time since 1970."""
        if topic not in self._channels:
            if schema.name not in self._schemas:
                self._schemas[schema.name] = self._writer.register_schema(*schema[:3])
            self._channels[topic] = self._writer.register_channel(
                topic, schema.message_encoding, self._schemas[schema.name]
            )
        self.first_us = us if self.first_us is None else self.first_us
        ns = max(0, us) * 1000
        self.waiting += 1
        self._writer.add_message(self._channels[topic], ns, data, ns, seq)
        self.write_out()

    def flush(self) -> None:
        """End the chunk and write it."""
        self._writer.flush()
        self.write_out()

    def write_out(self) -> None:
        """Write the bytes of whole chunks."""
        waiting = self._buffer.waiting
        if not waiting:
            return
        done = 0
        try:
            while done < len(waiting):
                done += os.write(self.descriptor, waiting[done:])
        except OSError:
            os.ftruncate(self.descriptor, self._buffer.written)
            raise
        self._buffer.written += done
        waiting.clear()
        self.waiting = 0

    def finish(self) -> None:
        """Write the rest and the index."""
        self._writer.finish()
        self.write_out()

    def close(self) -> None:
        """Release the file. A second call does nothing."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1
