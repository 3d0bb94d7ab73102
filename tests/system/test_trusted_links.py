"""Who is heard on a link: the addresses that from= names, and of a crowd everybody for whom there is room."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

from ..deadline import SOON, wait_until
from .gateway_process import Gateway
from .wire import Wire

StartGateway = Callable[..., Gateway]


def heartbeat(system: int, sequence: int, *, armed: bool = False) -> bytes:
    message = Heartbeat(0, 10, 3, 193 if armed else 65, 4, 3)
    return encode(message, system=system, component=1, sequence=sequence % 256)


@contextlib.contextmanager
def vehicles(hosts: list[str], to: tuple[str, int], period: float = 1.0) -> Iterator[None]:
    """A vehicle at each of these addresses, with the system ids 1, 2, ..."""
    stop = threading.Event()
    with contextlib.ExitStack() as opened:
        sockets = [opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in hosts]
        for host, sender in zip(hosts, sockets, strict=True):
            sender.bind((host, 0))

        def beat() -> None:
            sequence = 0
            while True:
                for system, sender in enumerate(sockets, 1):
                    sender.sendto(heartbeat(system, sequence), to)
                    if stop.wait(period / len(sockets)):
                        return
                sequence += 1

        thread = threading.Thread(target=beat)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()


def systems(gate: Gateway, after: float = 0.0) -> set[object]:
    """The system ids of the vehicles that are connected."""
    return {
        line.status["system"]
        for line in list(gate.lines)
        if line.at > after and line.status["link"]["state"] == "CONNECTED"
    }


def test_only_the_addresses_of_from_are_heard_and_one_line_counts_the_others(gateway: StartGateway) -> None:
    gate = gateway("udp:127.0.0.1:0?from=127.0.0.5,127.7.0.0/16")
    gate.wait_for_log(r"listening on 127.0.0.1:\d+/udp, from 127.0.0.5, 127.7.0.0/16 only")
    with vehicles(["127.0.0.9", "127.0.0.5", "127.7.1.1"], gate.address, 0.3):
        wait_until(lambda: systems(gate) >= {2, 3})
        gate.wait_for_log(r"refused \d datagrams? from 127.0.0.9, which is not in from=127.0.0.5,127.7.0.0/16")
        gate.wait_for_lines(10, after=time.monotonic())
    assert systems(gate) == {2, 3}
    assert gate.stop() == 0
    assert sum("refused" in line for line in gate.log) == 1


def test_a_server_serves_only_the_addresses_of_from_in_the_file(gateway: StartGateway, tmp_path: Path) -> None:
    config = tmp_path / "one.yaml"
    config.write_text("links: [{url: 'tcpin:127.0.0.1:0', from: [127.0.0.5]}]\n")
    gate = gateway("--config", str(config))
    port = int(gate.wait_for_log(r"listening on \S+:(\d+)/tcp, from 127.0.0.5 only")[1])
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", port)) as stranger, contextlib.suppress(ConnectionResetError):
            stranger.settimeout(SOON)
            assert stranger.recv(1) == b""
    gate.wait_for_log(r"refused \d connections? from 127.0.0.1, which is not in from=127.0.0.5")
    with socket.create_connection(("127.0.0.1", port), SOON, ("127.0.0.5", 0)) as vehicle:
        vehicle.sendall(heartbeat(7, 0))
        gate.wait_for(lambda status: status["system"] == 7)


def test_a_flood_from_other_addresses_costs_little_and_hides_no_vehicle(gateway: StartGateway) -> None:
    gate = gateway("udp:127.0.0.1:0?from=127.0.0.5")
    stop = threading.Event()
    to = gate.address

    def flood() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.9", 0))
            while not stop.wait(0.01):
                for number in range(30):
                    stranger.sendto(heartbeat(number + 1, 0), to)

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        with vehicles(["127.0.0.5"], to, 0.3):
            wait_until(lambda: 1 in systems(gate))
            gate.wait_for_lines(10, after=time.monotonic())
            assert systems(gate) == {1}
    finally:
        stop.set()
        thread.join()


@pytest.mark.parametrize("number", [70, 254])
def test_each_vehicle_of_a_fleet_at_addresses_of_its_own_has_a_status_within_10_s(
    number: int, gateway: StartGateway
) -> None:
    gate = gateway("udp:127.0.0.1:0", "--changes-only")
    to = gate.address
    with vehicles([f"127.1.{1 + at // 200}.{1 + at % 200}" for at in range(number)], to):
        wait_until(lambda: systems(gate) >= set(range(1, number + 1)), 10, f"only {len(systems(gate))} are heard")
        assert not any("not heard" in line for line in gate.log)
    assert gate.memory() < 120
    assert gate.stop() == 0


def test_the_fleet_may_be_behind_one_address(gateway: StartGateway) -> None:
    gate = gateway("udp:127.0.0.1:0", "--changes-only")
    with vehicles(["127.0.0.1"] * 254, gate.address):
        wait_until(lambda: systems(gate) >= set(range(1, 255)), 10, "some have no status")


def test_one_address_holds_at_most_a_quarter_of_a_port(gateway: StartGateway) -> None:
    gate = gateway("udp:127.0.0.1:0", "--changes-only")
    to = gate.address
    with vehicles(["127.0.0.9"] * 254, to, 2.0), vehicles(["127.0.0.9"] * 50, to):
        gate.wait_for_log(
            r"\d+ senders are not heard, 127.0.0.9:\d+ for one: there is room for 1024, and for 256 at one"
        )
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.8", 0))
            before = time.monotonic()
            other.sendto(encode(Heartbeat(0, 2, 12, 65, 4, 3), system=255, component=1, sequence=0), to)
            gate.wait_for(lambda status: status["system"] == 255, after=before)


def test_of_ten_vehicles_on_one_port_each_is_forwarded(gateway: StartGateway, wire: Callable[..., Wire]) -> None:
    station = wire()
    gate = gateway("udp:127.0.0.1:0", "--forward", "--out", f"udpout:127.0.0.1:{station.address[1]}")

    def forwarded() -> set[int]:
        found = (one.message for one in station.heard("HEARTBEAT"))
        return {message.get_srcSystem() for message in found if message.get_srcComponent() == 1}

    with vehicles([f"127.1.1.{at + 1}" for at in range(10)], gate.address):
        wait_until(lambda: forwarded() >= set(range(1, 11)), 8, "some are not forwarded")


def test_a_vehicle_that_pauses_on_a_broadcast_link_is_heard_when_it_comes_back(
    gateway: StartGateway, wire: Callable[..., Wire]
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hearing:
        hearing.bind(("127.255.255.255", 0))
        hearing.settimeout(SOON)
        gate = gateway(f"udpbcast:127.255.255.255:{hearing.getsockname()[1]}")
        port = hearing.recvfrom(1000)[1][1]
    first, second = wire(("127.0.0.1", port), system=1).beating(), wire(("127.0.0.1", port), system=2)
    gate.wait_for_log(rf"127.0.0.1:{first.address[1]} answers, sending to it")
    first.wait_for("HEARTBEAT")
    second.beating()
    gate.wait_for(lambda s: s["system"] == 2 and s["link"]["state"] == "CONNECTED")
    assert not second.heard()
    first.beating(False)
    gate.wait_for(lambda s: s["system"] == 1 and s["link"]["state"] == "LOST")
    gate.wait_for_log(rf"127.0.0.1:{second.address[1]} answers, sending to it")
    back = time.monotonic()
    first.beating()
    gate.wait_for(lambda s: s["system"] == 1 and s["link"]["state"] == "CONNECTED", after=back)
    gate.wait_for(lambda s: s["system"] == 2 and s["link"]["state"] == "CONNECTED", after=back)
