"""Detects slower code without a clock: counts bytecode instructions and compares them with committed numbers.

`python -m bench.guard` compares, `--update` writes the numbers of this Python. Instructions of the standard library
count too, so work that only moves still counts. Instructions inside C code do not.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import socket
import sys
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from mav_robot_status.clock import Instant, later
from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.gateway.event_loop import EventLoop
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.mavlink.framing import Parser

from . import workload
from .instructions import count

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BASELINE: Final = Path(__file__).with_name("baseline.json")
TOLERANCE: Final = 0.05
"""Patch releases of Python compile a little differently."""
THIS_PYTHON: Final = f"{sys.version_info.major}.{sys.version_info.minor}"
START: Final = Instant(1000.0, 1_800_000_000_000_000)
FRAMES: Final = 1600
TURNS: Final = 20
FLEET: Final = 100


class Verdict(NamedTuple):
    """One number and its baseline. A new number has the baseline 0, and fails until its baseline is committed."""

    name: str
    counted: float
    baseline: float

    @property
    def worse(self) -> bool:
        """Whether the number exceeds the baseline by more than the tolerance."""
        return self.counted > self.baseline * (1 + TOLERANCE)

    def __str__(self) -> str:
        stale = self.counted < self.baseline * (1 - TOLERANCE)
        mark = "MORE" if self.worse else "less, see --update" if stale else "the same"
        return f"{self.name:<48}{self.counted:>10.1f}{self.baseline:>10.1f}  {mark}"


# the counted calls: each returns the function to run and the number of units of one run

Work = tuple["Callable[[], object]", int]


@contextmanager
def parse_stream() -> Iterator[Work]:
    """Parse a stream that is read in pieces."""
    pieces = workload.chunks(workload.frames(FRAMES))
    parser = Parser(WANTED_IDS)
    yield lambda: [parser.feed(piece) for piece in pieces], FRAMES


@contextmanager
def parse_datagrams() -> Iterator[Work]:
    """Parse one frame at a time."""
    pieces = workload.frames(FRAMES)
    parser = Parser(WANTED_IDS)
    yield lambda: [parser.feed(piece) for piece in pieces], FRAMES


@contextmanager
def take() -> Iterator[Work]:
    """Process the frames that a status needs."""
    frames = Parser(WANTED_IDS).feed(b"".join(workload.frames(FRAMES)))
    hw = MavlinkRobotHW()
    yield lambda: [hw.on_frame(frame, later(START, i / 9.2)) for i, frame in enumerate(frames)], len(frames)


@contextmanager
def wake_ups() -> Iterator[Work]:
    """Turns of the event loop, each with one datagram, at 400 a second."""
    sent = 0
    with _gateway(lambda: later(START, sent / 400)) as (gateway, send):
        left = iter(workload.frames(FRAMES))

        def until() -> bool:
            nonlocal sent
            piece = next(left, None)
            if piece is not None:
                send(piece)
                sent += 1
            return piece is None

        yield lambda: gateway.run(until), FRAMES


@contextmanager
def changes() -> Iterator[Work]:
    """HEARTBEATs that arm and disarm, each with the turn that publishes the change."""
    with _gateway(lambda: START) as (gateway, send):
        (source,) = gateway.hardware.all.sources()
        now = START
        for i, frame in enumerate(workload.frames(FRAMES)):
            now = later(START, i / workload.RATE)
            send(frame)
            source.receive(now, 1)
        gateway.turn(now)
        beats = [workload.heartbeat(armed=i % 2 == 0, sequence=(FRAMES + i) & 255) for i in range(TURNS)]

        def run() -> None:
            for i, beat in enumerate(beats):
                at = later(now, (i + 1) * 0.3)
                send(beat)
                source.receive(at, 1)
                gateway.turn(at)

        yield run, TURNS


@contextmanager
def idle_turns() -> Iterator[Work]:
    """Turns of the event loop without work."""
    with _with_vehicle() as (gateway, now):
        yield lambda: _turns(gateway, now, 1e-6), TURNS


@contextmanager
def publications() -> Iterator[Work]:
    """Turns in which a JSON line is due, and sometimes our HEARTBEAT and ROBOT_STATUS."""
    with _with_vehicle() as (gateway, now):
        yield lambda: _turns(gateway, now, 0.101), TURNS


@contextmanager
def fleet_turns() -> Iterator[Work]:
    """Turns of a gateway with many vehicles in which the line of one of them is due."""
    with _gateway(lambda: START) as (gateway, _):
        frames = Parser(WANTED_IDS).feed(b"".join(workload.frames(FLEET)))
        for number in range(FLEET):
            now = later(START, number / FLEET / 10)
            for frame in frames:
                gateway.hardware.mavlink.vehicles.on_frame(frame._replace(ids=(1 + number, 1)), now)
            gateway.turn(now)
        now = later(START, 1.0)  # later than all that their first messages change
        gateway.turn(now)
        yield lambda: _turns(gateway, now, 0.1 / FLEET), TURNS


COUNTED: Final[dict[str, Callable[[], AbstractContextManager[Work]]]] = {
    "Parser.feed, 1400 bytes: per frame": parse_stream,
    "Parser.feed, a datagram: per frame": parse_datagrams,
    "MavlinkRobotHW.on_frame: per frame that is needed": take,
    "EventLoop.run: per turn with a datagram": wake_ups,
    "EventLoop.turn: with a HEARTBEAT that arms": changes,
    "EventLoop.turn: nothing to do": idle_turns,
    "EventLoop.turn: statuses at 10 Hz": publications,
    "EventLoop.turn: one line of 100 vehicles": fleet_turns,
}


@contextmanager
def _gateway(clock: Callable[[], Instant]) -> Iterator[tuple[EventLoop, Callable[[bytes], object]]]:
    """A gateway with a manual clock, and a function that sends it a datagram."""
    with open(os.devnull, "w") as nowhere, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        config = Config(links=(LinkConfig("udpin:127.0.0.1:0"),))
        gateway = EventLoop(config, nowhere, clock)
        try:
            link: Any = gateway.endpoints[0].link
            out.connect(("127.0.0.1", link.port))
            yield gateway, out.send
        finally:
            gateway.close()


@contextmanager
def _with_vehicle() -> Iterator[tuple[EventLoop, Instant]]:
    """A gateway that has received messages of one vehicle for some minutes, and the current time."""
    with _gateway(lambda: START) as (gateway, _):
        for i, frame in enumerate(Parser(WANTED_IDS).feed(b"".join(workload.frames(FRAMES)))):
            now = later(START, i / 9.2)
            gateway.hardware.mavlink.vehicles.on_frame(frame, now)
        gateway.turn(now)
        yield gateway, now


def _turns(gateway: EventLoop, now: Instant, step: float) -> None:
    for i in range(TURNS):
        gateway.turn(later(now, (i + 1) * step))


# counting


def measure() -> dict[str, float]:
    """All numbers for this version of Python."""
    logging.disable(logging.CRITICAL)
    try:
        return {name: round(_per_unit(make), 1) for name, make in COUNTED.items()}
    finally:
        logging.disable(logging.NOTSET)


def _per_unit(make: Callable[[], AbstractContextManager[Work]]) -> float:
    with make() as (run, _):  # fills the caches
        run()
    with make() as (run, units):
        return count(run, without=__file__) / units


# comparing


def baselines() -> dict[str, dict[str, float]]:
    """The committed numbers, by version of Python."""
    found: dict[str, dict[str, float]] = json.loads(BASELINE.read_text()) if BASELINE.exists() else {}
    return found


def compare(counted: dict[str, float], baseline: dict[str, float]) -> list[Verdict]:
    """A table of all numbers and baselines."""
    return [Verdict(name, value, baseline.get(name, 0.0)) for name, value in counted.items()]


def main() -> int:
    """Return 0 if every number is within the tolerance, else 1."""
    parser = argparse.ArgumentParser(prog="python -m bench.guard", description=__doc__)
    parser.add_argument("--update", action="store_true", help="write the numbers of this Python as the baseline")
    options = parser.parse_args()
    committed = baselines()
    counted = measure()
    if options.update:
        committed[THIS_PYTHON] = counted
        BASELINE.write_text(json.dumps(dict(sorted(committed.items())), indent=2) + "\n")
    if THIS_PYTHON not in committed:
        print(f"no baseline for Python {THIS_PYTHON}; --update writes one")
        return 0
    verdicts = compare(counted, committed[THIS_PYTHON])
    print(f"{'instructions, Python ' + THIS_PYTHON:<48}{'now':>10}{'baseline':>10}")
    print("\n".join(map(str, verdicts)))
    return int(any(verdict.worse for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
