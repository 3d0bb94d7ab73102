"""Replaying a recorded log without publishing."""

from __future__ import annotations

from .. import workload
from ..case import Bench, Case, Found
from ..results import OURS, PYMAVLINK, Sample, Target
from .parse import METRIC, job

GENERATED = "a log of the workload"
FRAMES = 120_000


def measure(bench: Bench) -> Found:
    """One round."""
    made = bench.place / "workload.tlog"
    if not made.exists():
        workload.write_log(made, round(bench.lasting(FRAMES)))
    logs = {GENERATED: made} | ({bench.log.name: bench.log} if bench.log else {})
    for setup, path in logs.items():
        for who in (OURS, PYMAVLINK):
            yield Sample(setup, METRIC, who, job(f"replay-{who}", path.resolve()))


CASE = Case(
    "replay",
    "Replaying a recorded log",
    measure,
    (Target(GENERATED, METRIC, "replay: at most 1/10 of the CPU of pymavlink's log reader", 0.1, peer=PYMAVLINK),),
)
