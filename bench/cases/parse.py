"""Parsing from memory. Both parsers check the CRC of each known frame and count lost frames."""

from __future__ import annotations

import json
import subprocess
import sys

from ..case import Bench, Case, Found
from ..contenders import PEERS
from ..process import ROOT, BenchError
from ..results import OURS, PYMAVLINK, Sample, Target

SIZES = {"chunks of 1400 bytes": 1400, "frame by frame": 0}
METRIC = "CPU per frame, us"


def job(name: str, path: object, size: int = 0) -> float:
    """CPU time per frame, in microseconds, of one job of `peers/in_memory.py`. The job has its own process."""
    command = [sys.executable, str(PEERS / "in_memory.py"), name, str(path), str(size)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode:
        raise BenchError(f"{name}: {done.stderr.strip().splitlines()[-1]}")
    found = json.loads(done.stdout)
    return float(found["seconds"] * 1e6 / found["frames"])


def measure(bench: Bench) -> Found:
    """One round."""
    for setup, size in SIZES.items():
        for who in (OURS, PYMAVLINK):
            yield Sample(setup, METRIC, who, job(f"parse-{who}", bench.frames(), size))


CASE = Case(
    "parse",
    "Parsing from memory",
    measure,
    (Target("chunks of 1400 bytes", METRIC, "parsing: at most 1/9 of pymavlink's CPU", 1 / 9, peer=PYMAVLINK),),
)
