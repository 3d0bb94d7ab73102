"""A process with its own core that sends frames to a UDP port, one a datagram. Standard input has the commands.

Lines in: `RATE SECONDS BURST` (frames a second, over and over, BURST of them at once) or `raw HEX`. Line out: frames
sent and seconds taken. At slow rates each frame is one system call at an absolute deadline. At fast rates sendmmsg
sends several frames at once; otherwise Python would be the bottleneck.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import socket
import sys
import time
from pathlib import Path

FAST = 21_000  # above this rate in frames a second one system call sends several
STEPS = 4000  # system calls a second at such a rate
MOST = 64  # the most frames of one system call
SLEEP = 0.0006  # s; the rest of a wait is a busy loop


class _Piece(ctypes.Structure):
    _fields_ = (("base", ctypes.c_char_p), ("size", ctypes.c_size_t))


class _Message(ctypes.Structure):
    """struct msghdr of Linux."""

    _fields_ = (
        ("name", ctypes.c_void_p), ("name_size", ctypes.c_uint), ("pieces", ctypes.POINTER(_Piece)),
        ("pieces_count", ctypes.c_size_t), ("control", ctypes.c_void_p), ("control_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )  # fmt: skip


class _Header(ctypes.Structure):
    """struct mmsghdr of Linux."""

    _fields_ = (("message", _Message), ("sent", ctypes.c_uint))


class Sender:
    """Frames that are sent in a loop to one port."""

    def __init__(self, frames: list[bytes], port: int) -> None:
        self._frames = frames
        self._next = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._headers: ctypes.Array[_Header] | None = None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def raw(self, data: bytes) -> None:
        """Send one datagram."""
        with contextlib.suppress(OSError):
            self._socket.send(data)

    def run(self, rate: int, seconds: float, burst: int = 1) -> tuple[int, float]:
        """Send for `seconds`, evenly or in bursts. Return the number of frames and the seconds that this took.

        The frames of a burst follow each other within a fraction of a millisecond; the bursts are evenly spaced.
        """
        total = round(rate * seconds)
        batch = 1 if rate <= FAST else min(MOST, max(1, rate // STEPS))
        if batch > 1 and self._headers is None:
            self._headers = _headers(self._frames)
        start = time.perf_counter()
        sent = 0
        while sent < total:
            wait = start + sent / rate - time.perf_counter()
            if wait > SLEEP:
                time.sleep(wait - SLEEP / 2)
                continue
            if wait > 0:
                continue
            if batch > 1:
                sent += self._some(min(batch, total - sent))
            else:
                sent += sum(self._one() for _ in range(min(burst, total - sent)))
        time.sleep(max(0.0, start + sent / rate - time.perf_counter()))  # the pause after the last burst
        return sent, time.perf_counter() - start

    def _one(self) -> int:
        with contextlib.suppress(OSError):  # the receiver does not listen yet
            self._socket.send(self._frames[self._next])
        self._next = (self._next + 1) % len(self._frames)
        return 1

    def _some(self, number: int) -> int:
        assert self._headers is not None
        number = min(number, len(self._frames) - self._next)
        first = ctypes.byref(self._headers, self._next * ctypes.sizeof(_Header))
        done = max(0, int(_LIBC.sendmmsg(self._socket.fileno(), first, number, 0)))
        self._next = (self._next + done) % len(self._frames)
        return done


_LIBC = ctypes.CDLL(None, use_errno=True)


def _headers(frames: list[bytes]) -> ctypes.Array[_Header]:
    pieces = (_Piece * len(frames))(*[_Piece(frame, len(frame)) for frame in frames])
    headers = (_Header * len(frames))()
    size = ctypes.sizeof(_Piece)
    for i, header in enumerate(headers):
        header.message.pieces = ctypes.cast(ctypes.addressof(pieces) + i * size, ctypes.POINTER(_Piece))
        header.message.pieces_count = 1
    headers.keep = pieces  # type: ignore[attr-defined]  # the headers point into it
    return headers


def main() -> None:
    """Execute the commands on standard input."""
    from .workload import load

    cores = sorted(os.sched_getaffinity(0))
    if len(cores) > 1:
        os.sched_setaffinity(0, {cores[-1]})
    sender = Sender(list(load(Path(sys.argv[1]))), int(sys.argv[2]))
    for line in sys.stdin:
        first, second, *third = line.split()
        if first == "raw":
            sender.raw(bytes.fromhex(second))
        else:
            print(*sender.run(int(first), float(second), *map(int, third)), flush=True)


if __name__ == "__main__":
    main()
