from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from mav_robot_status.diagnosis.doctor import probes
from mav_robot_status.diagnosis.doctor.findings import Place
from mav_robot_status.links.url import Url, parse
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

HEARTBEAT = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        yield made


def test_a_udp_port_refuses_only_without_a_listener(peer: socket.socket) -> None:
    port = peer.getsockname()[1]
    assert probes.udp_trouble("127.0.0.1", port, HEARTBEAT) == ""
    peer.close()
    assert probes.udp_trouble("127.0.0.1", port, HEARTBEAT) == "refused"


def test_an_answer_is_not_a_fault(peer: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(probes, "REFUSAL", 0.01)
    assert probes.udp_trouble("127.0.0.1", peer.getsockname()[1], HEARTBEAT) == ""
    assert peer.recv(300) == HEARTBEAT


@pytest.mark.parametrize("host", ["nowhere.invalid", "a..b"])
def test_an_unknown_host_name_is_reported(host: str) -> None:
    assert probes.udp_trouble(host, 1, HEARTBEAT) == "unknown name"
    assert probes.tcp_trouble(host, 1) == "unknown name"


def test_a_passive_probe_sends_nothing(peer: socket.socket) -> None:
    peer.setblocking(False)
    assert probes.place(parse(f"udpout:127.0.0.1:{peer.getsockname()[1]}"), b"") == Place()
    with pytest.raises(BlockingIOError):
        peer.recv(300)


def test_a_tcp_server_accepts_and_a_missing_server_refuses() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert probes.tcp_trouble("127.0.0.1", port) == ""
    assert probes.tcp_trouble("127.0.0.1", port) == "refused"


def test_the_first_connection_with_mavlink_traffic_is_found() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        any_port.bind(("127.0.0.1", 0))
        taken = any_port.getsockname()[1]
        quiet, loud = (_free_port() for _ in range(2))
        sender.connect(("127.0.0.1", loud))
        urls = [parse(f"udp:127.0.0.1:{port}") for port in (taken, quiet, loud)]
        assert probes.first_heard(_sending(urls, sender), 5.0) == f"udp:127.0.0.1:{loud}"
        assert probes.first_heard(urls, 0.05) == ""


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


def _sending(urls: list[Url], sender: socket.socket) -> Iterator[Url]:
    """The connections. A datagram goes to the last one once all are open."""
    yield from urls
    sender.send(b"noise")
    sender.send(HEARTBEAT)


def test_local_addresses_are_distinguished_from_remote_ones() -> None:
    assert probes.is_ours("127.0.0.1")
    assert probes.is_ours("0.0.0.0")
    assert probes.is_ours("")
    assert not probes.is_ours("198.51.100.7")
    assert all(probes.is_ours(address) and not address.startswith("127.") for address in probes.addresses())


def test_serial_devices_are_listed_once_by_their_persistent_name(tmp_path: Path) -> None:
    by_id = tmp_path / "serial" / "by-id"
    by_id.mkdir(parents=True)
    for name in ("ttyACM0", "ttyUSB1", "ttyS0"):
        (tmp_path / name).touch()
    (by_id / "usb-Autopilot").symlink_to(tmp_path / "ttyACM0")
    assert probes.serial_devices(str(tmp_path)) == (str(by_id / "usb-Autopilot"), str(tmp_path / "ttyUSB1"))


def test_a_locked_device_is_reported_as_held() -> None:
    master, slave = os.openpty()
    try:
        device = os.ttyname(slave)
        assert probes.holder(device) == ""
        fcntl.flock(slave, fcntl.LOCK_EX)
        assert probes.holder(device) != ""
    finally:
        os.close(master)
        os.close(slave)


def test_a_missing_device_is_not_held() -> None:
    assert probes.holder("/dev/ttyNONE") == ""
