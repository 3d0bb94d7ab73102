"""Floods of ids, of clients and of descriptors: the real vehicle keeps its place, and nobody is flooded in turn."""

from __future__ import annotations

import contextlib
import re
import resource
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest

from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

from ..deadline import wait_until
from .gateway_process import Gateway
from .wire import Wire

RADIO = 1500
"""Bytes a second that a real vehicle may get: our heartbeat and statuses once a second, and requests."""


def forged(number: int) -> bytes:
    """The HEARTBEAT of a rover that does not exist; the ids of the first 254 x 250 differ."""
    ids = number % 250 + 2, number // 250 % 250 + 2
    return encode(Heartbeat(0, 10, 3, 65, 4, 3), system=ids[0], component=ids[1], sequence=0)


def is_real(status: dict[str, object]) -> bool:
    return (status["system"], status["component"]) == (1, 1) and status["drives_powered"] is False


def burst(to: tuple[str, int], count: int) -> None:
    """Heartbeats of so many vehicles, from one address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(count):
            sender.sendto(forged(number), to)
            if number % 50 == 49:
                time.sleep(0.02)


@contextlib.contextmanager
def flood(to: tuple[str, int], rate: float) -> Iterator[None]:
    """Heartbeats of new vehicles all the time."""
    stop = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            number = 0
            while not stop.wait(0.02):
                for _ in range(round(rate * 0.02)):
                    sender.sendto(forged(number), to)
                    number += 1

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.mark.slow
def test_a_vehicle_gets_a_status_after_forged_heartbeats_have_filled_the_table(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--rate", "1")
    burst(gate.address, 256)
    gate.wait_for(lambda s: s["system"] != 1)
    wire(gate.address).beating()
    gate.wait_for(is_real, what="status of the real vehicle", seconds=30)
    assert sum("table of vehicles is full" in line for line in gate.log) <= 1

    def only_the_real_one() -> bool:
        since = time.monotonic() - 3
        return all(is_real(line.status) for line in list(gate.lines) if line.at > since)

    wait_until(only_the_real_one, 30, "the lines of the ghosts do not end")
    assert gate.stop() == 0


def test_a_vehicle_gets_a_status_while_forged_heartbeats_of_new_ids_arrive(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--changes-only")
    with flood(gate.address, 300):
        gate.wait_for_log("table of vehicles is full")
        wire(gate.address).beating()
        gate.wait_for(is_real, what="status of the real vehicle", seconds=30)
        assert sum("heard vehicle" in line for line in gate.log) < 300
    assert gate.stop() == 0


def test_a_configured_vehicle_keeps_its_handle_in_a_flood(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], tmp_path: pytest.TempPathFactory
) -> None:
    config = f"{tmp_path}/one.yaml"
    with open(config, "w", encoding="ascii") as file:
        file.write("links: [udpin:127.0.0.1:0]\nvehicles: [{handle: crane}]\n")
    gate = gateway("--config", config)
    burst(gate.address, 10)  # the first one takes the slot
    gate.wait_for(lambda s: s["handle"] == "crane" and s["system"] is not None)
    wire(gate.address).beating()
    gate.wait_for(lambda s: s["handle"] == "crane" and is_real(s), what="status of the real vehicle", seconds=30)


def bytes_a_second(rover: Wire, seconds: float = 4.0) -> float:
    """What a vehicle gets."""
    rover.settle()
    since, before = time.monotonic(), len(rover.heard())
    rover.wait_for("HEARTBEAT", after=since + seconds)
    heard = rover.heard()[before:]
    return sum(len(one.data) for one in heard) / (heard[-1].at - since)


def senders(wire: Wire) -> set[int]:
    """The systems under whose id the gateway has sent a HEARTBEAT."""
    return {one.message.get_srcSystem() for one in wire.heard("HEARTBEAT")}


def test_forged_vehicles_do_not_make_the_gateway_flood_a_real_one(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    rover = wire(gate.address).beating()
    rover.wait_for("ROBOT_STATUS")
    burst(gate.address, 254)
    rover.wait_for("HEARTBEAT", after=time.monotonic() + 1)
    assert bytes_a_second(rover) < RADIO
    assert senders(rover) == {1}


@pytest.mark.slow
def test_what_is_sent_unasked_on_one_link_is_bounded_fair_and_counted(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    """All vehicles are behind the same radio: a router at one address."""
    router = wire()
    gate = gateway(f"udpout:127.0.0.1:{router.address[1]}", "--json", "none", "--http", "127.0.0.1:0")
    page = gate.wait_for_log(r"the page is at (\S+)")[1]
    router.wait_for("HEARTBEAT")  # the link speaks first
    router.to = find_peer(router)
    stop = threading.Event()

    def beat() -> None:
        while not stop.wait(0.5):
            for number in range(120):
                router.send(encode(Heartbeat(0, 10, 3, 65, 4, 3), system=number + 1, component=1, sequence=0))

    thread = threading.Thread(target=beat)
    thread.start()
    try:
        router.wait_for("HEARTBEAT", lambda m: m.get_srcSystem() == 120)
        assert bytes_a_second(router) < RADIO
        wait_until(lambda: set(range(1, 121)) <= senders(router), 20, "the heartbeats of some vehicles starve")
    finally:
        stop.set()
        thread.join()
    with urllib.request.urlopen(f"{page}metrics") as answer:
        text = answer.read().decode()
    assert re.search(r'connection_unasked_bytes_total\{connection="udpout:.*"\} [1-9]', text)
    assert re.search(r'connection_held_back_total\{connection="udpout:.*"\} [1-9]', text)
    assert gate.stop() == 0
    assert any(re.search(r"sent [1-9]\d* (bytes|kB); [1-9]\d* messages had to wait", line) for line in gate.log)


def find_peer(router: Wire) -> tuple[str, int]:
    """The address of the gateway that sends to this socket."""
    found: list[tuple[str, int]] = []

    def look() -> bool:
        with contextlib.suppress(OSError):
            found.append(router.socket.recvfrom(65535)[1])
        return bool(found)

    wait_until(look)
    return found[0]


@pytest.mark.slow
def test_an_out_gets_every_status_of_a_fleet(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    """An out is an order to send: it has no bound of its own."""
    station = wire()
    gate = gateway("udpin:127.0.0.1:0", "--json", "none", "--out", f"udpout:127.0.0.1:{station.address[1]}")
    for number in range(8):
        wire(gate.address, system=number + 1).beating()
        station.wait_for("ROBOT_STATUS", partial(is_about, number + 1), count=3)


def is_about(system: int, message: Any) -> bool:
    return bool(message.subject_system == system)


def test_idle_clients_do_not_lock_a_vehicle_out_of_a_server(gateway: Callable[..., Gateway]) -> None:
    gate = gateway("tcpin:127.0.0.1:0")
    port = int(gate.wait_for_log(r"listening on \S+:(\d+)/tcp")[1])
    with contextlib.ExitStack() as clients:
        for _ in range(8):
            clients.enter_context(socket.create_connection(("127.0.0.1", port)))
        wait_until(lambda: sum("has connected" in line for line in gate.log) == 8)
        stop = threading.Event()
        thread = threading.Thread(target=tcp_vehicle, args=(port, stop))
        thread.start()
        try:
            gate.wait_for(is_real, what="status of the real vehicle", seconds=20)
        finally:
            stop.set()
            thread.join()


def test_clients_that_speak_as_ground_stations_do_not_lock_a_vehicle_out_of_a_server(
    gateway: Callable[..., Gateway],
) -> None:
    gate = gateway("tcpin:127.0.0.1:0")
    port = int(gate.wait_for_log(r"listening on \S+:(\d+)/tcp")[1])
    stop = threading.Event()
    station = encode(Heartbeat(0, 6, 8, 0, 4, 3), system=255, component=190, sequence=0)
    threads = [threading.Thread(target=tcp_vehicle, args=(port, stop, station)) for _ in range(8)]
    for thread in threads:
        thread.start()
    try:
        wait_until(lambda: sum("has connected" in line for line in gate.log) == 8)
        threads.append(threading.Thread(target=tcp_vehicle, args=(port, stop)))
        threads[-1].start()
        gate.wait_for(is_real, what="status of the real vehicle", seconds=20)
        since = time.monotonic()
        gate.wait_for(lambda s: s["link"]["heartbeat_age"] is not None, after=since + 8, seconds=20)
        assert all(line.status["link"]["state"] == "CONNECTED" for line in gate.lines if line.at > since)
    finally:
        stop.set()
        for thread in threads:
            thread.join()


REAL = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)


def tcp_vehicle(port: int, stop: threading.Event, beat: bytes = REAL) -> None:
    """A vehicle, or another sender, that connects again when it is refused."""
    while not stop.is_set():
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            while not stop.wait(0.3):
                connection.sendall(beat)
        stop.wait(0.3)


@pytest.mark.slow
def test_a_gateway_without_free_descriptors_logs_one_line_and_rests(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "tcpin:127.0.0.1:0", "--http", "127.0.0.1:0")
    port = int(gate.wait_for_log(r"listening on \S+:(\d+)/tcp")[1])
    page = int(gate.wait_for_log(r"the page is at http://127.0.0.1:(\d+)/")[1])
    rover = wire(gate.address).beating()
    gate.wait_for(is_real)
    resource.prlimit(gate.process.pid, resource.RLIMIT_NOFILE, (20, 20))
    with contextlib.ExitStack() as clients:
        for number in range(60):
            clients.enter_context(socket.create_connection(("127.0.0.1", page if number % 2 else port)))
        gate.wait_for_log("too many open files|Too many open files")
        lines, used, since = len(gate.log), gate.cpu(), time.monotonic()
        rover.wait_for("HEARTBEAT", after=since + 5)
        assert (gate.cpu() - used) / (time.monotonic() - since) < 0.15
        assert len(gate.log) - lines < 20
        sent = rover.beat(armed=True)
        gate.wait_for(lambda s: s["drives_powered"] is True, after=sent)
    assert not any("Traceback" in line for line in gate.log)
    assert gate.stop() == 0
