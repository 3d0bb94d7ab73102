"""What came in on a link or in a log, counted by kind: what was read, and why the rest was not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

MAX_IDS: Final = 256
"""So many ids have a counter of their own in each table of `Counters`."""
OTHER_IDS: Final = -1
"""The key under which the ids beyond MAX_IDS are counted."""


@dataclass(slots=True)
class Counters:
    """What came in, by kind; all counted since the parser was made."""

    frames: int = 0
    """Frames of known ids with a good CRC, wanted or not."""
    frames_v1: int = 0
    """Those of them in MAVLink 1."""
    signed: int = 0
    """Those of them with a signature, verified or not."""
    lost: int = 0
    """Frames missing from the sequence of their source. Modulo 256: an outage can hide multiples of 256."""
    incompatible: int = 0
    """Frames of known ids with a good CRC whose incompatibility flags have an unknown bit: not delivered."""
    garbage_bytes: int = 0
    """Bytes skipped in search of the next frame."""
    bad_crc: dict[int, int] = field(default_factory=dict)
    """By message id: damaged frames, and frames of a definition other than ours."""
    unknown: dict[int, int] = field(default_factory=dict)
    """By message id: frames whose CRC_EXTRA is not known, so that they cannot be checked."""

    def add(self, other: Counters) -> None:
        """Add what another parser counted."""
        self.frames += other.frames
        self.frames_v1 += other.frames_v1
        self.signed += other.signed
        self.lost += other.lost
        self.incompatible += other.incompatible
        self.garbage_bytes += other.garbage_bytes
        for mine, theirs in ((self.bad_crc, other.bad_crc), (self.unknown, other.unknown)):
            for message_id, number in theirs.items():
                count(mine, message_id, number)


def count(table: dict[int, int], message_id: int, number: int = 1) -> None:
    """Add to the counter of an id, or to that of OTHER_IDS once the table is full."""
    if message_id not in table and len(table) >= MAX_IDS:
        message_id = OTHER_IDS
    table[message_id] = table.get(message_id, 0) + number
