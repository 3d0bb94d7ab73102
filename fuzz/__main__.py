"""`python -m fuzz TARGET [--count N]`: run a target on mutations of its corpus, with atheris or the plain mutator.

The target `belief` is a simulation and has no corpus.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from . import belief
from .mutate import inputs
from .targets import TARGETS, UNITS

BELIEF = "belief"
CORPUS = Path(__file__).parent / "corpus"
TOKENS = {
    "configuration": b"links: outs: vehicles: identity: hardware: requests: signing: type: publishers: url: passive: "
    b"- { } [ ] ' \" # | > & * !! ~ null true .inf 1e999 0x10 1_000 10ms 3.5 -1 \t \xc3\xa9 \xe2\x80\xa8".split(b" "),
    "connection": b"udp: udpin: udpout: tcp: tcpin: serial: // : , @ [ ] 127.0.0.1 ::1 /dev/tty 14550 %".split(),
}


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("target", choices=sorted((*TARGETS, BELIEF)))
    parser.add_argument("--count", type=int, default=100_000, help="units (frames, files) to try (100000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the plain mutator (1)")
    parser.add_argument(
        "--atheris",
        action="store_true",
        help="guide the mutations by coverage with atheris; needs `pip install atheris`",
    )
    options = parser.parse_args()
    if options.target == BELIEF:
        return simulated(options.count, options.seed)
    if options.atheris:
        return coverage_guided(options.target, options.count)
    target = TARGETS[options.target]
    corpus = [path.read_bytes() for path in sorted((CORPUS / options.target).iterdir())]
    done = number = 0
    started = time.monotonic()
    for number, data in enumerate(inputs(corpus, TOKENS.get(options.target, ()), options.seed), 1):
        if done >= options.count:
            break
        try:
            done += target(data)
        except Exception:
            print(f"input {number} of seed {options.seed}: {data!r}", file=sys.stderr)
            raise
    seconds = time.monotonic() - started
    print(
        f"{options.target}: {done} {UNITS.get(options.target, 'frames')} in {number} inputs, {seconds:.0f} s: no defect"
    )
    return 0


def simulated(count: int, seed: int) -> int:
    """Random steps of two senders with one id. Prints the steps to a defect."""
    started = time.monotonic()
    found = belief.run(count, seed)
    if found is not None:
        print(found, file=sys.stderr)
        return 1
    print(f"{BELIEF}: {count} steps of seed {seed}, {time.monotonic() - started:.0f} s: no defect")
    return 0


def coverage_guided(name: str, count: int) -> int:
    """Run under atheris. It ends the process, and writes its findings to the current folder."""
    import atheris

    with atheris.instrument_imports(include=["mav_robot_status"]):
        for module in [m for m in sys.modules if m.startswith("mav_robot_status")]:
            del sys.modules[module]
        import importlib

        targets = importlib.reload(importlib.import_module("fuzz.targets"))

    def one(data: bytes) -> None:
        targets.TARGETS[name](data)

    grown = tempfile.mkdtemp(prefix="corpus-")  # atheris adds inputs to the first folder; ours stays unchanged
    atheris.Setup([sys.argv[0], f"-runs={count}", "-max_len=4096", grown, str(CORPUS / name)], one)
    atheris.Fuzz()
    return 0


if __name__ == "__main__":
    sys.exit(main())
