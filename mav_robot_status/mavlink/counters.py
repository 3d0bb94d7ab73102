"""Counters of one link or log: the frames that were read, and the reasons why other bytes were not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

MAX_IDS: Final = 256
"""The most ids with a separate counter in each table of `Counters`."""
OTHER_IDS: Final = -1
"""The key that counts all ids beyond MAX_IDS."""


@dataclass(slots=True)
class Counters:
    """All counts start when the parser is created."""

    frames: int = 0
    """Frames of known ids with a valid CRC, wanted or not."""
    frames_v1: int = 0
    """The part of `frames` in MAVLink 1."""
    signed: int = 0
    """The part of `frames` with a signature, verified or not."""
    lost: int = 0
    """Gaps in the sequence numbers of each source. The numbers are modulo 256: an outage can hide multiples of 256."""
    incompatible: int = 0
    """Frames of known ids with a valid CRC and an unknown incompatibility flag; they are not delivered."""
    garbage_bytes: int = 0
    """Bytes skipped in search of the next frame."""
    bad_crc: dict[int, int] = field(default_factory=dict)
    """By message id: damaged frames, and frames of a different definition."""
    unknown: dict[int, int] = field(default_factory=dict)
    """By message id: frames that cannot be checked, because their CRC_EXTRA is not known."""

    def add(self, other: Counters) -> None:
        """Add the counts of another parser."""
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
    """Add to the counter of an id, or to OTHER_IDS if the table is full."""
    if message_id not in table and len(table) >= MAX_IDS:
        message_id = OTHER_IDS
    table[message_id] = table.get(message_id, 0) + number
