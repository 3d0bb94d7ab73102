"""Notifications to systemd through a real socket."""

from __future__ import annotations

import contextlib
import math
import os
import pathlib
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.gateway.systemd import SystemdNotifier


class Manager:
    """The systemd end of the socket."""

    def __init__(self, address: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.bind(address)
        self.environment = {"NOTIFY_SOCKET": address.replace("\0", "@")}

    def heard(self) -> list[str]:
        messages = []
        with contextlib.suppress(BlockingIOError):
            while True:
                messages.append(self.socket.recv(4096).decode())
        return messages


@pytest.fixture
def manager(tmp_path: pathlib.Path) -> Iterator[Manager]:
    made = Manager(str(tmp_path / "notify"))
    yield made
    made.socket.close()


def notifier(manager: Manager, **more: str) -> contextlib.closing[SystemdNotifier]:
    return contextlib.closing(SystemdNotifier({**manager.environment, **more}))


def test_each_notification_uses_the_sd_notify_format(manager: Manager) -> None:
    with notifier(manager) as told:
        told.ready()
        told.reloading(12.5)
        told.stopping()
    assert manager.heard() == ["READY=1", "RELOADING=1\nMONOTONIC_USEC=12500000", "STOPPING=1"]


def test_abstract_sockets_are_supported() -> None:
    abstract = Manager(f"\0mav-robot-status-test-{os.getpid()}")
    with contextlib.closing(abstract.socket), notifier(abstract) as told:
        told.ready()
        assert abstract.heard() == ["READY=1"]


def test_the_watchdog_is_notified_at_half_its_timeout(manager: Manager) -> None:
    with notifier(manager, WATCHDOG_USEC="2000000") as told:
        for now in (10.0, 10.9, 11.0, 11.5, 12.0):
            told.turn(now)
            if manager.heard():
                assert told.next_due() == now + 1.0
        assert told.next_due() == 13.0


def test_the_watchdog_is_not_notified_without_a_turn(manager: Manager) -> None:
    with notifier(manager, WATCHDOG_USEC="2000000") as told:
        told.ready()
        assert told.next_due() == -math.inf
    assert manager.heard() == ["READY=1"]


@pytest.mark.parametrize("usec", ["", "0", "-1", "soon", "²"])
def test_nothing_is_sent_without_a_valid_watchdog_timeout(manager: Manager, usec: str) -> None:
    with notifier(manager, WATCHDOG_USEC=usec) as told:
        told.turn(1.0)
        assert told.next_due() == math.inf
    assert manager.heard() == []


def test_the_watchdog_of_another_process_is_ignored(manager: Manager) -> None:
    with notifier(manager, WATCHDOG_USEC="2000000", WATCHDOG_PID=str(os.getppid())) as told:
        told.turn(1.0)
    with notifier(manager, WATCHDOG_USEC="2000000", WATCHDOG_PID=str(os.getpid())) as told:
        told.turn(1.0)
    assert manager.heard() == ["WATCHDOG=1"]


@pytest.mark.parametrize("environment", [{}, {"NOTIFY_SOCKET": ""}, {"NOTIFY_SOCKET": "vsock:2:1"}])
def test_nothing_happens_without_a_notify_socket(environment: dict[str, str]) -> None:
    with contextlib.closing(SystemdNotifier({**environment, "WATCHDOG_USEC": "2000000"})) as told:
        told.ready()
        told.turn(1.0)
        assert told.next_due() == math.inf


def test_a_missing_notify_socket_is_ignored(tmp_path: pathlib.Path) -> None:
    with contextlib.closing(
        SystemdNotifier({"NOTIFY_SOCKET": str(tmp_path / "gone"), "WATCHDOG_USEC": "2000000"})
    ) as told:
        told.ready()
        told.turn(1.0)


def test_a_watchdog_notification_is_retried_soon_if_the_socket_is_full(manager: Manager) -> None:
    with notifier(manager, WATCHDOG_USEC="2000000") as told:
        for _ in range(10_000):  # until the socket is full
            told.ready()
        told.turn(1.0)
        full = manager.heard()
        assert "WATCHDOG=1" not in full
        assert 1.0 < told.next_due() <= 1.2
        told.turn(1.2)
    assert manager.heard() == ["WATCHDOG=1"]
