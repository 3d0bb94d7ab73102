from __future__ import annotations

import select
import socket

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.tcp_source import MINUTE, FaultLog, TcpSource


def at(seconds: float) -> Instant:
    return Instant(seconds, 1_800_000_000_000_000)


def test_each_connection_is_new_once_and_its_data_is_handed_over() -> None:
    heard: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as server:
        source = TcpSource("127.0.0.1", server.getsockname()[1], lambda data, now: heard.append(data))
        assert not source.is_new()
        for turn in range(2):
            clock = 100.0 * turn
            while not source.link.connected:
                clock += 1.0
                source.service(at(clock))
            assert source.is_new()
            assert not source.is_new()
            peer, _ = server.accept()
            with peer:
                peer.sendall(b"hello")
                assert select.select([source.fileno()], [], [], 10.0)[0]
                source.receive(at(clock), 64)
            source.link.reconnect()
            source.service(at(clock))
        source.close()
    assert b"".join(heard) == b"hellohello"


def test_a_host_may_be_an_ipv6_address() -> None:
    source = TcpSource("::1", 30004.0, lambda data, now: None)
    assert "[::1]:30004" in source.link.text
    source.close()


def test_a_fault_is_one_line_until_data_arrives_and_at_most_one_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    log = FaultLog("arm")
    log.fault("silent", 0.0)
    log.fault("garbage", MINUTE)
    log.works()
    log.fault("slow", MINUTE - 1)
    log.fault("silent again", MINUTE)
    assert caplog.messages == ["arm: silent", "arm: silent again"]
