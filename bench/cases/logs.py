"""The most memory that a replay and a report of a log of 100 MB need."""

from __future__ import annotations

from .. import workload
from ..case import Bench, Case, Found
from ..process import Child
from ..results import OURS, Sample, Target

COMMANDS = ("replay", "report")
PEAK = "largest resident memory, MB"
SIZE = 100  # MB
LONGEST = 600.0  # s


def measure(bench: Bench) -> Found:
    """One round. A quick run has a tenth of the log, which says nothing about the target."""
    size = bench.number(SIZE)
    log = bench.place / "long.tlog"
    if not log.exists():
        workload.write_long_log(log, size * 1_000_000)
    silent = (str(log), "--json", "none", "--rate", "0")
    page = str(bench.place / "report.html")
    for command, arguments in zip(COMMANDS, (silent, ("report", str(log), "-o", page)), strict=True):
        with Child(bench.contenders.ours(*arguments)) as child:
            peak = child.peak_memory(LONGEST)
        yield Sample(_setup(command, size), PEAK, OURS, peak)


def _setup(command: str, size: int) -> str:
    return f"{command} of {size} MB"


CASE = Case(
    "logs",
    "Memory for a long log",
    measure,
    tuple(
        Target(_setup(command, SIZE), PEAK, f"memory of a {command} of {SIZE} MB: at most 60 MB", 60.0)
        for command in COMMANDS
    ),
)
