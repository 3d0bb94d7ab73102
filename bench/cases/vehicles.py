"""Many vehicles on one port: 20,000 frames a second without publishing, and with every status at 10 Hz."""

from __future__ import annotations

from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import free_port
from ..results import OURS, PYMAVLINK, Sample, Target

NUMBERS = (1, 10, 100, 254)
RATE = 20_000
SILENT, JSON, BOTH = "nothing published", "JSON at 10 Hz", "JSON and MAVLink at 10 Hz"
SHARE, FRAME, LINES = "CPU, % of a core", "CPU per frame, us", "JSON lines per vehicle and second"
SECONDS = 4.0
KNOWN = 3.0
"""Seconds of warm-up. A new vehicle costs more at first; the case measures the steady state."""
OUR_COMPONENT = 192
ROBOT_STATUS, SET_MESSAGE_INTERVAL, PERIOD_US = 59900, 511, 100_000


def measure(bench: Bench) -> Found:
    """One round."""
    for vehicles in NUMBERS:
        for output in (SILENT, JSON, BOTH):
            yield from _ours(bench, vehicles, output)
        setup = _setup(vehicles, SILENT)
        port = free_port()
        with bench.contenders.start_pymavlink(port, "0") as child, Feed(bench.frames(vehicles), port) as feed:
            child.listens(port)
            feed.warm_up(RATE, KNOWN)
            fed = feed.measure(child, RATE, bench.lasting(SECONDS))
            yield Sample(setup, SHARE, PYMAVLINK, fed.share, fed.note)
            yield Sample(setup, FRAME, PYMAVLINK, fed.per_frame)


def _setup(vehicles: int, output: str) -> str:
    return f"{vehicles} vehicle{'s' if vehicles > 1 else ''}, {output}"


def _ours(bench: Bench, vehicles: int, output: str) -> Found:
    setup = _setup(vehicles, output)
    port = free_port()
    lines = bench.place / "lines.jsonl"
    lines.unlink(missing_ok=True)
    arguments = {
        SILENT: ("--json", "none", "--rate", "0", "--passive"),
        JSON: ("--json", str(lines), "--passive"),
        BOTH: ("--json", str(lines)),
    }[output]
    with bench.contenders.start_ours(port, *arguments) as child, Feed(bench.frames(vehicles), port) as feed:
        child.listens(port)
        feed.warm_up(RATE, KNOWN)
        if output == BOTH:
            feed.raw(_request_ten_hertz())
            feed.warm_up(RATE, 0.2)
        before = _size(lines)
        fed = feed.measure(child, RATE, bench.lasting(SECONDS))
        yield Sample(setup, SHARE, OURS, fed.share, fed.note)
        if output == SILENT:
            yield Sample(setup, FRAME, OURS, fed.per_frame)
        else:
            written = lines.read_bytes()[before:].count(b"\n")
            yield Sample(setup, LINES, OURS, written / vehicles / fed.seconds)


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
    f"Many vehicles, {RATE:,} frames/s together",
    measure,
    (
        Target(_setup(254, SILENT), SHARE, "254 vehicles, nothing published: below 10 % of a core", 10.0),
        Target(_setup(254, JSON), SHARE, "254 vehicles, all statuses at 10 Hz: within one core", 100.0),
        Target(_setup(254, JSON), LINES, "254 vehicles: 10 lines a second for each", at_least=9.5),
    ),
)
