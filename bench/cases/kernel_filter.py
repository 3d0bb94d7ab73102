"""UDP to status with and without the filter in the kernel, at the rates of a ground station. One frame a datagram."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from mav_robot_status.hardware.mavlink.message_table import WANTED_IDS
from mav_robot_status.mavlink.definitions import CRC_EXTRA
from mav_robot_status.mavlink.encode import with_crc
from mav_robot_status.mavlink.wire import REVERSED

from .. import workload
from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import Child, free_port
from ..results import OURS, Sample, Target

RATES = (80, 800)
WITHOUT = "ours, --no-kernel-filter"
METRIC, WAKE_UPS = "CPU per frame sent, us", "wake-ups a second"
SECONDS = 6.0
BEGINS = 2.0
"""Seconds of traffic after which the filter is on."""


def measure(bench: Bench) -> Found:
    """One round, with a quarter and with half of the frames needed."""
    for share, frames in (("27 %", bench.frames()), ("50 %", _half(bench))):
        for who in (OURS, WITHOUT):
            port = free_port()
            start = partial(bench.contenders.start_ours, port, filtered=who == OURS)
            with start() as child, Feed(frames, port) as feed:
                child.listens(port)
                feed.warm_up()
                feed.send(RATES[0], BEGINS)
                for rate in RATES:
                    before = _wake_ups(child)
                    fed = feed.measure(child, rate, bench.lasting(SECONDS))
                    setup = f"{rate} frames/s, {share} needed"
                    yield Sample(
                        setup, METRIC, who, fed.cpu * 1e6 / fed.sent
                    )  # the kernel counts filtered ones as lost
                    yield Sample(setup, WAKE_UPS, who, (_wake_ups(child) - before) / fed.seconds)


def _half(bench: Bench) -> Path:
    """The frames of `workload`, needed and not needed in turn, with consecutive sequence numbers."""
    path = bench.place / "half.frames"
    if not path.exists():
        made = workload.frames()
        needed = [one for one in made if _id(one) in WANTED_IDS]
        others = [one for one in made if _id(one) not in WANTED_IDS]
        count = len(needed) // 128 * 128
        turns = [one for pair in zip(needed[:count], others[:count], strict=True) for one in pair]
        workload.save(path, [_numbered(one, number & 255) for number, one in enumerate(turns)])
    return path


def _id(frame: bytes) -> int:
    return int.from_bytes(frame[7:10], "little")


def _numbered(frame: bytes, sequence: int) -> bytes:
    extra = CRC_EXTRA[_id(frame)]
    return with_crc(frame[:4] + bytes([sequence]) + frame[5:-2], REVERSED[extra : extra + 1])


def _wake_ups(child: Child) -> int:
    """How often the process has waited so far."""
    status = Path(f"/proc/{child.process.pid}/status").read_text()
    return int(re.findall(r"^voluntary_ctxt_switches:\s+(\d+)", status, re.MULTILINE)[0])


CASE = Case(
    "kernel_filter",
    "The filter in the kernel",
    measure,
    (
        Target(
            "80 frames/s, 50 % needed", METRIC, "80 frames/s: at most 0.7 times as much as without", 0.7, peer=WITHOUT
        ),
        Target(
            "800 frames/s, 50 % needed",
            METRIC,
            "800 frames/s: at most 0.85 times as much as without",
            0.85,
            peer=WITHOUT,
        ),
    ),
)
