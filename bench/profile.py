"""Where the work of an event goes: its bytecode instructions by part of the package.

`python -m bench.profile` prints a table of the events that `bench.guard` counts. The numbers are the same in every run.
"""

from __future__ import annotations

import argparse
import logging
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Final

from . import guard
from .instructions import by_file

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

PACKAGE: Final = "mav_robot_status"
EVENTS: Final = {
    "a datagram": guard.wake_ups,
    "a HEARTBEAT that arms": guard.changes,
    "a line at 10 Hz": guard.publications,
}
LEAST: Final = 0.5
"""Per cent below which a part has no row."""
REST: Final = "other files"


def part_of(file: str) -> str:
    """The folder of a file in the package; the module itself at the top of the package, and in `gateway`."""
    path = Path(file)
    if PACKAGE not in path.parts:
        return "standard library and generated code"
    inside = path.parts[len(path.parts) - path.parts[::-1].index(PACKAGE) :]
    return "/".join(inside) if len(inside) == 1 or inside[0] == "gateway" else "/".join(inside[:-1])


def profile(event: AbstractContextManager[guard.Work]) -> Counter[str]:
    """The instructions of one event, by part."""
    with event as (run, units):
        files = by_file(run, without=guard.__file__)
    found: Counter[str] = Counter()
    for file, number in files.items():
        found[part_of(file)] += number
    return Counter({part: round(number / units) for part, number in found.items()})


def table(found: Counter[str]) -> str:
    """The parts as lines, the largest first."""
    whole = found.total()
    large = {part: number for part, number in found.items() if number >= whole * LEAST / 100}
    rows = sorted(large.items(), key=lambda row: -row[1])
    rows.append((REST, whole - sum(large.values())))
    rows.append(("all", whole))
    return "\n".join(f"{number:>7}  {100 * number / whole:5.1f} %  {part}" for part, number in rows)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.profile", description=__doc__)
    parser.add_argument("--list", action="store_true", help="print the names of the events only")
    if parser.parse_args().list:
        print("\n".join(EVENTS))
        return
    logging.disable(logging.CRITICAL)
    for name, make in EVENTS.items():
        with make() as (run, _):  # fills the caches
            run()
        print(f"instructions for {name}:\n{table(profile(make()))}\n")


if __name__ == "__main__":
    main()
