"""The work of the parser for each byte, for bytes that make it work hard: `python -m fuzz.work`.

Prints nanoseconds of processor time for each byte, and the ratio to random bytes. Ends with 1 if a ratio is above MOST.
The fuzz target `work` and the tests count checks instead, which is the same on every machine.
"""

from __future__ import annotations

import random
import sys
import time
from binascii import crc_hqx
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.mavlink import framing
from mav_robot_status.mavlink.framing import Parser

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST: Final = 10.0
"""The most work for a byte, as a multiple of that for a random byte."""
SIZE: Final = 60_000
"""Bytes of each input."""
PIECES: Final = (SIZE, 1400, 280, 97, 16, 4, 1)
"""Bytes of one feed."""
HEADER_V1: Final = b"\xfe\xff\x00\x01\x01\x00"
HEADER_V2: Final = b"\xfd\xff\x00\x00\x00\x01\x01\x00\x00\x00"
RANDOM: Final = random.Random(1).randbytes(SIZE)


def _of(alphabet: bytes) -> bytes:
    return bytes(random.Random(2).choices(alphabet, k=SIZE))


def _repeated(part: bytes) -> bytes:
    return (part * (SIZE // len(part) + 1))[:SIZE]


SHAPES: Final[dict[str, bytes]] = {
    "magic of version 1": _repeated(b"\xfe"),
    "magic of version 2": _repeated(b"\xfd"),
    "both in turn": _repeated(b"\xfe\xfd"),
    "magic and zero": _repeated(b"\xfd\0"),
    "magic and a known id": _repeated(b"\xfe\x1e"),
    "magic and two zeros": _repeated(b"\xfe\0\0"),
    "headers of version 1, longest": _repeated(HEADER_V1),
    "headers of version 2, longest": _repeated(HEADER_V2),
    "headers of version 2, empty": _repeated(b"\xfd" + bytes(9)),
    "bad frames, empty": _repeated(b"\xfe\0\0\1\1\0\x12\x34"),
    "bad frames, a heartbeat": _repeated(b"\xfd\x09\0\0\0\1\1\0\0\0" + bytes(9) + b"\x12\x34"),
    "bad frames full of magic": _repeated(HEADER_V1 + b"\xfe" * 257),
    "bad frames full of headers": _repeated(HEADER_V1 + HEADER_V1 * 42 + b"12345"),
    "garbage before each bad frame": _repeated(b"\0\xfe\0\0\1\1\0\x12\x34"),
    "any mix of six bytes": _of(b"\xfe\xfd\x00\x01\x1e\xff"),
    "any mix of magic and zero": _of(b"\xfe\xfe\xfe\0"),
}


def checks(pieces: Sequence[bytes]) -> tuple[int, int]:
    """How many CRCs the parser computes of these pieces of a stream, and of how many bytes in total."""
    lengths: list[int] = []
    crc = crc_hqx

    def counted(data: Any, seed: int) -> int:
        lengths.append(len(data))
        return crc(data, seed)

    with mock.patch.object(framing, "crc_hqx", counted):
        parser = Parser(WANTED_IDS)
        for piece in pieces:
            parser.feed(piece)
    return len(lengths), sum(lengths)


def nanoseconds(data: bytes, piece: int, repeats: int = 5) -> float:
    """Processor time for each byte: the shortest of some runs."""
    pieces = cut(data, piece)
    best = float("inf")
    for _ in range(repeats):
        parser = Parser(WANTED_IDS)
        before = time.process_time()
        for one in pieces:
            parser.feed(one)
        best = min(best, time.process_time() - before)
    return best / len(data) * 1e9


def cut(data: bytes, piece: int) -> list[bytes]:
    """The data in pieces."""
    return [data[start : start + piece] for start in range(0, len(data), piece)]


def main() -> int:
    """Print the table."""
    worst = 0.0
    print(f"{'ns/byte (times random), bytes of a feed:':<42}{''.join(f'{piece:>14}' for piece in PIECES)}")
    base = {piece: nanoseconds(RANDOM[: piece * 4000], piece) for piece in PIECES}
    print(f"{'random':<42}{''.join(f'{base[piece]:>8.0f} (1.0)' for piece in PIECES)}")
    for name, data in SHAPES.items():
        found = {piece: nanoseconds(data[: piece * 4000], piece) for piece in PIECES}
        worst = max(worst, *(found[piece] / base[piece] for piece in PIECES))
        print(f"{name:<42}{''.join(f'{found[piece]:>8.0f} ({found[piece] / base[piece]:.1f})' for piece in PIECES)}")
    print(f"at most {worst:.1f} times the work for a random byte")
    return int(worst > MOST)


if __name__ == "__main__":
    sys.exit(main())
