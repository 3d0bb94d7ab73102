"""A flood of bytes that look like the starts of frames: statuses stay in time, and the vehicle stays in sight."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest

from ..deadline import allow
from .gateway_process import Gateway
from .wire import Wire

SHAPES = {
    "fe": b"\xfe" * 65_000,
    "headers": b"\xfe\xff\x00\x01\x01\x00" * 10_000,
    "headers of version 2": b"\xfd\xff\x00\x00\x00\x01\x01\x00\x00\x00" * 6_000,
    "bad frames": (b"\xfe\xff\x00\x01\x01\x00" + b"\xfe" * 257) * 240,
}
FLOOD = 1100  # datagrams
GAP = 0.5  # s between two lines, on an idle machine


@pytest.fixture
def flood() -> Iterator[Callable[[tuple[str, int], bytes], threading.Thread]]:
    """Send datagrams from a thread, as many as the receive buffer takes, for five seconds."""
    threads = []

    def send(address: tuple[str, int], data: bytes) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.connect(address)
            for _ in range(FLOOD):
                out.send(data)
                time.sleep(5 / FLOOD)

    def start(address: tuple[str, int], data: bytes) -> threading.Thread:
        threads.append(threading.Thread(target=send, args=(address, data)))
        threads[-1].start()
        return threads[-1]

    yield start
    for thread in threads:
        thread.join()


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_statuses_are_in_time_during_a_flood(
    gateway: Callable[..., Gateway],
    wire: Callable[..., Wire],
    flood: Callable[[tuple[str, int], bytes], threading.Thread],
    shape: str,
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address)
    rover.armed = True
    rover.beating()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    began = time.monotonic()
    flooding = flood(gate.address, SHAPES[shape])
    flooding.join()
    rover.beat(armed=False)
    last = gate.wait_for(lambda s: s["drives_powered"] is False, after=began, what="the disarm")
    times = [line.at for line in gate.lines if began < line.at <= last.at]
    assert max(after - before for before, after in pairwise([began, *times])) < allow(GAP)
    assert gate.stop() == 0
