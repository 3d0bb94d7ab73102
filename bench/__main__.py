"""`python -m bench`: run the benchmarks and compare with other programs on the same machine, in the same run."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import tempfile
import time
from contextlib import closing
from datetime import datetime, timezone
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Final

from .case import Bench, Case
from .cases import (
    arm,
    forward,
    latency,
    logs,
    memory,
    parse,
    replay,
    resident,
    ros2,
    saturate,
    signed,
    silent,
    start,
    udp,
    vehicles,
)
from .contenders import MAVPROXY, MAVSDK, ROUTER, Contenders
from .machine import machine, versions
from .process import BenchError
from .report import RESULTS, into, render, write
from .results import OURS, Sample, Skip, collect

if TYPE_CHECKING:
    from collections.abc import Sequence

CASES: Final[dict[str, Case]] = {
    module.CASE.name: module.CASE
    for module in (
        parse, replay, udp, saturate, forward, latency, arm, silent, vehicles, memory, resident, logs,
        start, signed, ros2,
    )
}  # fmt: skip
"""The cases, in the order of a round."""
ROUNDS, QUICK_ROUNDS = 3, 1
PLACES: Final = {MAVPROXY: "MAVPROXY", MAVSDK: "MAVSDK_PYTHON", ROUTER: "MAVLINK_ROUTERD"}
"""Program -> environment variable with its path."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    made.add_argument("--only", action="append", choices=CASES, metavar="CASE", help=f"one of {', '.join(CASES)}")
    made.add_argument("--rounds", type=int, metavar="N",
                      help=f"rounds; medians are shown ({ROUNDS}, with --quick {QUICK_ROUNDS})")  # fmt: skip
    made.add_argument("--quick", action="store_true",
                      help="two minutes: a tenth of the time, without the slowest programs")  # fmt: skip
    made.add_argument("--long", action="store_true", help="memory: ten million frames")
    made.add_argument("--log", type=Path, metavar="FILE", help="also replay this recorded log")
    made.add_argument("--out", type=Path, metavar="DIR", help="write results.json and results.md to this folder")
    made.add_argument("--write", type=Path, metavar="PAGE",
                      help="put the tables into this page, and results.json into bench/results")  # fmt: skip
    made.add_argument("--busy", metavar="TEXT",
                      help="what else the machine does: then the tables have ratios only, and say this")  # fmt: skip
    made.add_argument("--list", action="store_true", help="list the cases and exit")
    for peer, variable in PLACES.items():
        option = "--mavsdk-python" if peer == MAVSDK else f"--{peer.lower()}"
        made.add_argument(option, dest=variable, default=os.environ.get(variable), metavar="PATH",
                          help=f"path of {peer} if it is not on the PATH; or ${variable}")  # fmt: skip
    return made


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the selected cases."""
    options = parser().parse_args(arguments)
    if options.write:
        _check_page(options.write, whole=not options.only)
    rounds = options.rounds or (QUICK_ROUNDS if options.quick else ROUNDS)
    cases = [CASES[name] for name in CASES if not options.only or name in options.only]
    if options.list:
        print("\n".join(f"{case.name:<15}{case.title}" for case in cases))
        return 0
    paths = {peer: getattr(options, variable) for peer, variable in PLACES.items() if getattr(options, variable)}
    with tempfile.TemporaryDirectory() as place, closing(Contenders(Path(place), paths)) as contenders:
        bench = Bench(Path(place), contenders, options.quick, options.long, options.log)
        result = {
            "date": f"{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC",
            "machine": machine(),
            "busy": options.busy or "",
            "versions": versions() | contenders.versions(),
            "rounds": rounds,
            "quick": options.quick,
            **_run(bench, cases, rounds),
        }
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "results.json").write_text(json.dumps(result, indent=1) + "\n")
        (options.out / "results.md").write_text(render(result))
    if options.write:
        (RESULTS / "results.json").write_text(json.dumps(result, indent=1) + "\n")
        write(options.write, RESULTS)
    print(render(result), end="")
    return 0


def _check_page(page: Path, *, whole: bool) -> None:
    """End with one line if the page cannot take the tables, before everything is measured."""
    if not whole:
        parser().error("--write needs a whole run: leave out --only")
    try:
        into(page.read_text(), "")
    except (OSError, ValueError) as error:
        parser().error(f"--write {page}: {error}")


def _run(bench: Bench, cases: list[Case], rounds: int) -> dict[str, Any]:
    """Run every case once in each round, so that a short load does not affect all samples of one case."""
    found: dict[str, list[list[Sample | Skip]]] = {case.name: [] for case in cases}
    speeds = []
    for number in range(1, rounds + 1):
        speeds.append(parse.speed(bench))
        for case in cases:
            start = time.monotonic()
            found[case.name].append(_round(bench, case))
            took = time.monotonic() - start
            print(f"round {number} of {rounds}: {case.name}, {took:.0f} s", file=sys.stderr, flush=True)
    speed = median(speeds)
    return {
        "parse_us": speed,
        "cases": [collect(case.name, case.title, found[case.name], case.targets, speed) for case in cases],
    }


def _round(bench: Bench, case: Case) -> list[Sample | Skip]:
    found: list[Sample | Skip] = []
    try:
        for item in case.measure(bench):
            found.append(item)  # one by one: the samples before an error stay
    except (BenchError, OSError) as error:  # a process has ended; the other cases still run
        found.append(Skip(case.title, OURS, str(error)))
    return found


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the measured programs too
    sys.exit(main())
