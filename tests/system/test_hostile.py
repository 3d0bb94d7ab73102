"""Hostile input from the network: it neither disturbs the gateway nor makes it grow."""

from __future__ import annotations

import random
import socket
import time
from collections.abc import Callable

from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from .gateway_process import Gateway
from .wire import Wire


def test_random_datagrams_do_not_disturb(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    before = gate.memory()
    rng = random.Random(1)
    noise = rng.randbytes(1 << 16)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(gate.address)
        for number in range(20_000):
            start, size = rng.randrange(60_000), rng.randrange(400)
            start_byte = (b"\xfd", b"\xfe", b"")[number % 3]
            sender.send(start_byte + noise[start : start + size])
    sent = rover.beat(armed=True)
    gate.wait_for(lambda s: s["drives_powered"] is True, after=sent)
    assert all(line.status["system"] == 1 for line in gate.lines)
    assert gate.memory() - before < 15
    assert gate.stop() == 0
    assert any("bytes of garbage" in line for line in gate.log)


def test_memory_is_bounded_for_a_thousand_senders_and_every_id(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    rover = wire(gate.address, system=200).beating()
    rover.wait_for("ROBOT_STATUS")
    mav = MAVLink(None)
    for number in range(1500):
        mav.srcSystem, mav.srcComponent = number % 255 + 1, number // 255 + 1
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(MAVLink_heartbeat_message(10, 3, 65, 0, 4, 3).pack(mav), gate.address)
    sent = rover.beat(armed=True)
    rover.wait_for("ROBOT_STATUS", lambda m: m.subject_system == 200 and m.drives_powered == 1, after=sent)
    assert gate.memory() < 60
    assert gate.stop() == 0


def test_an_idle_gateway_uses_little_processor_time(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    before, since = gate.cpu(), time.monotonic()
    rover.wait_for("HEARTBEAT", after=since, count=3)
    assert (gate.cpu() - before) / (time.monotonic() - since) < 0.2
