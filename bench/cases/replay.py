"""Replaying a recorded log without publishing.

mavutil's reader returns every message; its index of the log is not in the figure. With `type=` it builds the index
and returns only the messages that a status needs; both are in the figure.
"""

from __future__ import annotations

from .. import workload
from ..case import Bench, Case, Found
from ..results import OURS, PYMAVLINK, Sample, Target
from ..workload import WORKLOADS
from .parse import METRIC, job

TYPED = "mavutil, type="
JOBS = {OURS: "replay-ours", PYMAVLINK: "replay-pymavlink", TYPED: "replay-typed"}
FRAMES, QUICK_FRAMES = 120_000, 30_000


def measure(bench: Bench) -> Found:
    """One round."""
    logs = {}
    for traffic in WORKLOADS:
        logs[_setup(traffic)] = made = bench.place / f"{traffic.name}.tlog"
        if not made.exists():
            workload.write_log(made, QUICK_FRAMES if bench.quick else FRAMES, traffic)
    if bench.log:
        logs[bench.log.name] = bench.log
    for setup, path in logs.items():
        for who, name in JOBS.items():
            yield Sample(setup, METRIC, who, job(name, path.resolve()))


def _setup(traffic: workload.Workload) -> str:
    return f"a log, {traffic.name}"


CASE = Case(
    "replay",
    "Replaying a recorded log",
    measure,
    (
        *(
            Target(
                _setup(traffic), METRIC, f"replay, {traffic.name}: at most 1/10 of the CPU of pymavlink's log reader",
                1 / 10, peer=PYMAVLINK,
            )
            for traffic in WORKLOADS
        ),
        Target(
            _setup(workload.HALF), METRIC, "replay, half needed: at most 1/3 of the CPU of mavutil with type=",
            1 / 3, peer=TYPED,
        ),
    ),
)  # fmt: skip
