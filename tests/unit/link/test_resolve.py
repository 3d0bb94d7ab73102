import socket
import threading
from typing import Any

import pytest

from mav_robot_status.link.resolve import Lookup, addresses

from .conftest import Names


def test_an_address_is_known_without_asking(names: Names) -> None:
    assert Lookup("192.0.2.1", 14550, socket.SOCK_DGRAM).ask() == [(socket.AF_INET, ("192.0.2.1", 14550))]
    assert Lookup("::1", 5760, socket.SOCK_STREAM).ask() == [(socket.AF_INET6, ("::1", 5760, 0, 0))]
    assert names.asked == 0


def test_a_name_with_both_kinds_of_address_is_taken_for_ipv4_first(names: Names) -> None:
    names.known["rover.test"] = "::1 127.0.0.1"
    found = addresses("rover.test", 14550, socket.SOCK_DGRAM)
    assert [family for family, _ in found] == [socket.AF_INET, socket.AF_INET6]


@pytest.mark.parametrize("host", ["nobody.test", "a..b", "x" * 300, "999.1.1.1"])
def test_a_host_that_is_not_known_has_no_addresses(names: Names, host: str) -> None:
    assert Lookup(host, 14550, socket.SOCK_DGRAM).ask(wait=5) == []


def test_who_is_not_known_is_asked_for_again(names: Names) -> None:
    lookup = Lookup("rover.test", 14550, socket.SOCK_DGRAM)
    assert lookup.ask(wait=5) == []
    names.known["rover.test"] = "192.0.2.1"
    assert lookup.ask(wait=5) == [(socket.AF_INET, ("192.0.2.1", 14550))]
    names.known["rover.test"] = "192.0.2.2"
    assert lookup.ask(wait=5) == [(socket.AF_INET, ("192.0.2.2", 14550))]


def test_a_name_server_that_does_not_answer_makes_nobody_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    answered = threading.Event()
    really: Any = socket.getaddrinfo

    def getaddrinfo(host: str, *args: Any, flags: int = 0, **options: Any) -> Any:
        if not flags & socket.AI_NUMERICHOST:
            answered.wait(5)
            host = "192.0.2.1"
        return really(host, *args, flags=flags, **options)

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    lookup = Lookup("rover.test", 14550, socket.SOCK_DGRAM)
    assert lookup.ask() is None
    assert lookup.ask() is None
    assert [thread.name for thread in threading.enumerate()].count("resolve rover.test") == 1
    answered.set()
    assert lookup.ask(wait=5) == [(socket.AF_INET, ("192.0.2.1", 14550))]
