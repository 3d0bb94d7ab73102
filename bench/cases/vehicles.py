"""Many vehicles on one port, each with 80 frames a second: without publishing, and with every status at 10 Hz.

Each vehicle has phases of its own: their messages, and the times at which something is due, differ. A setup with all
vehicles in step shows what that hides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import free_port
from ..results import FIRST_MACHINE, OURS, PYMAVLINK, SECOND_MACHINE, Sample, Target
from ..workload import RATE

if TYPE_CHECKING:
    from pathlib import Path

NUMBERS, QUICK_NUMBERS = (10, 100, 254), (10, 254)
SILENT, JSON, BOTH = "nothing published", "JSON at 10 Hz", "JSON and MAVLink at 10 Hz"
IN_STEP = "all in step, "
SHARE, EACH, LINES = "CPU, % of a core", "CPU per vehicle, % of a core", "JSON lines per vehicle and second"
GROWTH = "CPU per vehicle, against 10 vehicles"
SECONDS = 4.0
KNOWN, QUICK_KNOWN = 3.0, 1.5
"""Seconds of warm-up. A new vehicle costs more at first; the case measures the steady state."""
OUR_COMPONENT = 192
ROBOT_STATUS, SET_MESSAGE_INTERVAL, PERIOD_US = 59900, 511, 100_000


def measure(bench: Bench) -> Found:
    """One round."""
    few: dict[str, float] = {}
    for vehicles in QUICK_NUMBERS if bench.quick else NUMBERS:
        for output in (SILENT, JSON, BOTH) if vehicles == NUMBERS[-1] else (SILENT, JSON):
            found = _ours(bench, vehicles, output)
            yield from found
            each = next(sample.value for sample in found if sample.metric == EACH)
            if output in few:
                yield Sample(_setup(vehicles, output), GROWTH, OURS, each / few[output])
            elif vehicles == NUMBERS[0]:
                few[output] = each
        yield from _pymavlink(bench, vehicles)
    if not bench.quick:
        for output in (SILENT, JSON):
            yield from _ours(bench, NUMBERS[-1], output, in_step=True)


def _setup(vehicles: int, output: str, *, in_step: bool = False) -> str:
    return f"{vehicles} vehicles, {IN_STEP if in_step else ''}{output}"


def _ours(bench: Bench, vehicles: int, output: str, *, in_step: bool = False) -> list[Sample]:
    setup = _setup(vehicles, output, in_step=in_step)
    port, rate = free_port(), vehicles * RATE
    lines = bench.place / "lines.jsonl"
    lines.unlink(missing_ok=True)
    arguments = {
        SILENT: ("--json", "none", "--rate", "0", "--passive"),
        JSON: ("--json", str(lines), "--passive"),
        BOTH: ("--json", str(lines)),
    }[output]
    frames = bench.frames(vehicles, in_step=in_step)
    with bench.contenders.start_ours(port, *arguments) as child, Feed(frames, port) as feed:
        child.listens(port)
        feed.warm_up(rate, QUICK_KNOWN if bench.quick else KNOWN)
        if output == BOTH:
            feed.raw(_request_ten_hertz())
            feed.warm_up(rate, 0.2)
        before = _size(lines)
        fed = feed.measure(child, rate, bench.lasting(SECONDS))
        found = [Sample(setup, SHARE, OURS, fed.share, fed.note), Sample(setup, EACH, OURS, fed.share / vehicles)]
        if output != SILENT:
            written = lines.read_bytes()[before:].count(b"\n")
            found.append(Sample(setup, LINES, OURS, written / vehicles / fed.seconds))
    return found


def _pymavlink(bench: Bench, vehicles: int) -> Found:
    setup = _setup(vehicles, SILENT)
    port, rate = free_port(), vehicles * RATE
    with bench.contenders.start_pymavlink(port, "0") as child, Feed(bench.frames(vehicles), port) as feed:
        child.listens(port)
        feed.warm_up(rate, QUICK_KNOWN if bench.quick else KNOWN)
        fed = feed.measure(child, rate, bench.lasting(SECONDS))
        yield Sample(setup, SHARE, PYMAVLINK, fed.share, fed.note)
        yield Sample(setup, EACH, PYMAVLINK, fed.share / vehicles)


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def _request_ten_hertz() -> bytes:
    """A ground station's request for ROBOT_STATUS at 10 Hz. It applies to every vehicle."""
    endpoint = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    command = dialect.MAVLink_command_long_message(
        1, OUR_COMPONENT, SET_MESSAGE_INTERVAL, 0, ROBOT_STATUS, PERIOD_US, 0, 0, 0, 0, 0
    )
    return bytes(command.pack(endpoint))


CASE = Case(
    "vehicles",
    f"Many vehicles, {RATE} frames/s each",
    measure,
    (
        Target(
            _setup(254, SILENT, in_step=True), SHARE, "254 vehicles in step, nothing published: below 10 % of a core",
            10.0, machine=FIRST_MACHINE,
        ),
        Target(
            _setup(254, SILENT), SHARE, "254 vehicles, nothing published: below 10 % of a core",
            10.0, machine=FIRST_MACHINE,
        ),
        Target(
            _setup(254, JSON), SHARE, "254 vehicles, JSON at 10 Hz: at most 45 % of a core",
            45.0, machine=SECOND_MACHINE,
        ),
        Target(_setup(254, JSON), LINES, "254 vehicles: 10 lines a second for each", at_least=9.5),
        Target(_setup(254, SILENT), GROWTH, "254 vehicles, no output: each costs at most 1.1 times one of 10", 1.1),
        Target(_setup(254, JSON), GROWTH, "254 vehicles, JSON at 10 Hz: each costs at most 1.1 times one of 10", 1.1),
    ),
)  # fmt: skip
