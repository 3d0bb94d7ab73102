"""Parsing from memory. Both parsers check the CRC of each known frame and count lost frames."""

from __future__ import annotations

import json
import subprocess
import sys

from ..case import Bench, Case, Found
from ..contenders import PEERS
from ..process import ROOT, BenchError
from ..results import OURS, PYMAVLINK, Sample, Target
from ..workload import WORKLOADS

CHUNKS, FRAMES = "chunks of 1400 bytes", "frame by frame"
SIZES = {CHUNKS: 1400, FRAMES: 0}
METRIC = "CPU per frame, us"


def job(name: str, path: object, size: int = 0) -> float:
    """CPU time per frame, in microseconds, of one job of `peers/in_memory.py`. The job has its own process."""
    command = [sys.executable, str(PEERS / "in_memory.py"), name, str(path), str(size)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode:
        raise BenchError(f"{name}: {done.stderr.strip().splitlines()[-1]}")
    found = json.loads(done.stdout)
    return float(found["seconds"] * 1e6 / found["frames"])


def speed(bench: Bench) -> float:
    """The speed of this machine: microseconds in which pymavlink parses a frame. Absolute limits depend on it."""
    return job(f"parse-{PYMAVLINK}", bench.frames(), SIZES[CHUNKS])


def measure(bench: Bench) -> Found:
    """One round."""
    for traffic in WORKLOADS:
        for words, size in SIZES.items():
            for who in (OURS, PYMAVLINK):
                value = job(f"parse-{who}", bench.frames(traffic=traffic), size)
                yield Sample(f"{words}, {traffic.name}", METRIC, who, value)


CASE = Case(
    "parse",
    "Parsing from memory",
    measure,
    tuple(
        Target(
            f"{CHUNKS}, {traffic.name}", METRIC, f"parsing, {traffic.name}: at most 1/9 of pymavlink's CPU", 1 / 9,
            peer=PYMAVLINK,
        )
        for traffic in WORKLOADS
    ),
)  # fmt: skip
