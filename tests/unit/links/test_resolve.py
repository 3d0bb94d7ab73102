import socket
import threading
from typing import Any

import pytest

from mav_robot_status.links.resolve import Lookup, addresses

from .conftest import Names


def test_a_numeric_address_needs_no_lookup(names: Names) -> None:
    assert Lookup("192.0.2.1", 14550, socket.SOCK_DGRAM).result() == [(socket.AF_INET, ("192.0.2.1", 14550))]
    assert Lookup("::1", 5760, socket.SOCK_STREAM).result() == [(socket.AF_INET6, ("::1", 5760, 0, 0))]
    assert names.lookups == 0


def test_ipv4_addresses_of_a_name_come_first(names: Names) -> None:
    names.known["rover.test"] = "::1 127.0.0.1"
    found = addresses("rover.test", 14550, socket.SOCK_DGRAM)
    assert [family for family, _ in found] == [socket.AF_INET, socket.AF_INET6]


@pytest.mark.parametrize("host", ["nobody.test", "a..b", "x" * 300, "999.1.1.1"])
def test_an_unknown_host_has_no_addresses(names: Names, host: str) -> None:
    assert Lookup(host, 14550, socket.SOCK_DGRAM).result(wait=5) == []


def test_an_unknown_name_is_looked_up_again(names: Names) -> None:
    lookup = Lookup("rover.test", 14550, socket.SOCK_DGRAM)
    assert lookup.result(wait=5) == []
    names.known["rover.test"] = "192.0.2.1"
    assert lookup.result(wait=5) == [(socket.AF_INET, ("192.0.2.1", 14550))]
    names.known["rover.test"] = "192.0.2.2"
    assert lookup.result(wait=5) == [(socket.AF_INET, ("192.0.2.2", 14550))]


def test_a_slow_name_server_does_not_block(monkeypatch: pytest.MonkeyPatch) -> None:
    answered = threading.Event()
    really: Any = socket.getaddrinfo

    def getaddrinfo(host: str, *args: Any, flags: int = 0, **options: Any) -> Any:
        if not flags & socket.AI_NUMERICHOST:
            answered.wait(5)
            host = "192.0.2.1"
        return really(host, *args, flags=flags, **options)

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    lookup = Lookup("rover.test", 14550, socket.SOCK_DGRAM)
    assert lookup.result() is None
    assert lookup.result() is None
    assert [thread.name for thread in threading.enumerate()].count("resolve rover.test") == 1
    answered.set()
    assert lookup.result(wait=5) == [(socket.AF_INET, ("192.0.2.1", 14550))]
