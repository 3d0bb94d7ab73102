"""Damages recordings as bad links do: frames are lost, come again, or come late. No frame is changed or invented.

Every damage is a pure function of the records, in order of arrival, and a seeded generator: a run can be repeated
anywhere. On such a link a status may become UNKNOWN; it may not become untrue.
"""

from __future__ import annotations

import math
import pathlib
import random
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from mav_robot_status.mavlink import definitions
from mav_robot_status.mavlink.framing import STAMP_SIZE, Frame, Parser

SECOND: Final = 1_000_000  # µs
NO_STREAMS: Final = {
    definitions.Heartbeat,
    definitions.Statustext,
    definitions.CommandAck,
    definitions.Event,
    definitions.CurrentEventSequence,
}


class Record(NamedTuple):
    """A frame, and when it arrived: microseconds since 1970. The undamaged recording has it at `frame.stamp`."""

    arrival: int
    frame: Frame


Records = Sequence[Record]
Damage = Callable[[Records, random.Random], Iterator[Record]]


class BadLink(NamedTuple):
    """A damage, and how long it excuses an answer that was true."""

    damage: Damage
    excused: float
    """Seconds for which news may be late or lost."""


def read(log: pathlib.Path) -> list[Record]:
    """The records of a log, in order of arrival."""
    frames = Parser(None, stamped=True).feed(log.read_bytes())
    return sorted((Record(frame.stamp, frame) for frame in frames), key=_arrival)


def written(records: Records) -> bytes:
    """The log with these records."""
    return b"".join(record.arrival.to_bytes(STAMP_SIZE, "big") + record.frame.raw for record in records)


def damaged(records: Records, name: str, seed: object = 0) -> list[Record]:
    """The records in the order in which they arrive over the bad link of this name."""
    return sorted(BAD_LINKS[name].damage(records, random.Random(f"{name} {seed}")), key=_arrival)


def _arrival(record: Record) -> int:
    return record.arrival


def _later(record: Record, seconds: float) -> Record:
    return record._replace(arrival=record.arrival + int(seconds * SECOND))


# -- frames come again ------------------------------------------------------------------------------------------------


def _copied(share: float, least: float, most: float) -> Damage:
    """A share of the frames come again, between `least` and `most` seconds later."""

    def damage(records: Records, rng: random.Random) -> Iterator[Record]:
        for record in records:
            yield record
            if rng.random() < share:
                yield _later(record, rng.uniform(least, most))

    return damage


# -- frames come late -------------------------------------------------------------------------------------------------


def _delayed(most: float) -> Damage:
    """Each frame takes up to `most` seconds, by itself: later ones overtake it."""
    return lambda records, rng: (_later(record, rng.uniform(0, most)) for record in records)


def _held(length: int, every: int) -> Damage:
    """Once in `every` seconds the link holds the frames of `length` seconds, and delivers them at once at the end."""

    def damage(records: Records, rng: random.Random) -> Iterator[Record]:
        for window, group in groupby(records, _window(records[0].arrival, every)):
            start = records[0].arrival + int((window * every + rng.uniform(0, every - length)) * SECOND)
            end = start + length * SECOND
            for record in group:
                yield record._replace(arrival=end) if start <= record.arrival < end else record

    return damage


def _window(start: int, seconds: int) -> Callable[[Record], int]:
    """The number of the window of so many seconds in which a record lies."""
    return lambda record: (record.arrival - start) // (seconds * SECOND)


# -- frames are lost --------------------------------------------------------------------------------------------------


def _lost(share: float) -> Damage:
    """A share of the frames is lost, each by itself."""
    return lambda records, rng: (record for record in records if rng.random() >= share)


def _silent(share: float, least: float, most: float) -> Damage:
    """For a share of the time the link is silent, between `least` and `most` seconds at a time."""
    heard = (least + most) / 2 * (1 - share) / share  # s from one silence to the next, on average

    def damage(records: Records, rng: random.Random) -> Iterator[Record]:
        start, end = -math.inf, float(records[0].arrival)
        for record in records:
            while record.arrival >= end:
                start = end + rng.expovariate(1 / heard) * SECOND
                end = start + rng.uniform(least, most) * SECOND
            if record.arrival < start:
                yield record

    return damage


def _first(number: int) -> Damage:
    """The first frames of each second get through.

    Autopilots send HEARTBEAT at the same point of each second. Seconds begin shortly before it: else a recording would
    lose all of them or none, by chance.
    """

    def damage(records: Records, rng: random.Random) -> Iterator[Record]:
        heartbeats = (r.arrival for r in records if isinstance(r.frame.message, definitions.Heartbeat))
        start = next(heartbeats, records[0].arrival) - SECOND // 100
        for _, group in groupby(records, _window(start, 1)):
            yield from list(group)[:number]

    return damage


def _thinned(interval: int) -> Damage:
    """A stream has one message in `interval` seconds. HEARTBEATs, and what is sent once, all get through."""

    def damage(records: Records, rng: random.Random) -> Iterator[Record]:
        due: dict[tuple[int, tuple[int, int]], int] = {}
        for record in records:
            stream = record.frame.message_id, record.frame.ids
            if type(record.frame.message) in NO_STREAMS:
                yield record
            elif record.arrival >= due.get(stream, 0):
                due[stream] = record.arrival + interval * SECOND
                yield record

    return damage


ALL_ARRIVE: Final = 0.0  # s
UNTIL_LOST: Final = 3.7  # s without a HEARTBEAT until a vehicle is LOST, 3.5, and two lines

BAD_LINKS: Final = {
    "each frame again after 5 ms": BadLink(_copied(1.0, 0.005, 0.005), ALL_ARRIVE),
    "each frame again after 100 to 200 ms": BadLink(_copied(1.0, 0.1, 0.2), ALL_ARRIVE),
    "30 % of the frames again within 10 ms": BadLink(_copied(0.3, 0.0, 0.01), ALL_ARRIVE),
    "each frame up to 200 ms late": BadLink(_delayed(0.2), 0.3),
    "5 s of 20 s held, then delivered at once": BadLink(_held(5, 20), UNTIL_LOST),
    "30 % of the frames lost": BadLink(_lost(0.3), UNTIL_LOST),
    "60 % of the frames lost": BadLink(_lost(0.6), UNTIL_LOST),
    "silent for 1 to 4 s, 20 % of the time": BadLink(_silent(0.2, 1.0, 4.0), UNTIL_LOST),
    "5 frames a second": BadLink(_first(5), UNTIL_LOST),
    "streams of one message in 5 s": BadLink(_thinned(5), UNTIL_LOST),
}
"""By their description."""
