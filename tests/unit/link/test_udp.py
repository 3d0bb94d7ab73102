import os
import select
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mav_robot_status.errors import LinkError
from mav_robot_status.link import udp
from mav_robot_status.link.base import Link, Received
from mav_robot_status.link.udp import UdpLink, port_owner
from mav_robot_status.link.url import parse

Open = Callable[[str], UdpLink]


@pytest.fixture(name="open_")
def fixture_open() -> Iterator[Open]:
    links = []

    def open_(text: str) -> UdpLink:
        links.append(UdpLink(parse(text)))
        return links[-1]

    yield open_
    for link in links:
        link.close()


def port_of(link: UdpLink) -> int:
    return int(link.text.rpartition(":")[2].removesuffix("/udp"))


def heard(link: Link, limit: int = 64) -> list[Received]:
    select.select([link], [], [], 5)
    return link.receive(limit)


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_both_ends_hear_each_other(open_: Open, host: str) -> None:
    listening = open_(f"udpin:{host}:0")
    sending = open_(f"udpout:{host}:{port_of(listening)}")
    assert sending.send(b"one")
    assert sending.send(b"two")
    first, second = heard(listening)
    assert (first.data, second.data) == (b"one", b"two")
    assert isinstance(first, Received)
    assert first.source == second.source
    assert listening.send(b"answer", first.source)
    [answer] = heard(sending)
    assert answer.data == b"answer"
    assert isinstance(answer.source, tuple)
    assert answer.source[:2] == (host.strip("[]"), port_of(listening))
    assert listening.dropped == sending.dropped == 0


def test_port_0_is_a_free_port_and_the_text_names_it(open_: Open) -> None:
    link = open_("udpin:127.0.0.1:0")
    assert port_of(link) > 0
    assert link.text == f"listening on 127.0.0.1:{port_of(link)}/udp"
    assert not link.stream


def test_a_sender_says_whom_it_sends_to(open_: Open) -> None:
    assert open_("[::1]:14550").text == "sending to [::1]:14550/udp"


def test_receiving_never_waits_and_takes_no_more_than_the_limit(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    assert listening.receive() == []
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    for number in range(10):
        sending.send(bytes([number]))
    assert [piece.data[0] for piece in heard(listening, 4)] == [0, 1, 2, 3]
    assert [piece.data[0] for piece in listening.receive(64)] == [4, 5, 6, 7, 8, 9]
    assert listening.receive() == []


def test_an_empty_and_the_longest_datagram_come_whole(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    for data in (b"", b"x" * 65507):
        assert sending.send(data)
        assert [piece.data for piece in heard(listening)] == [data]


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_a_port_that_is_taken_is_named_with_its_owner(open_: Open, host: str) -> None:
    port = port_of(open_(f"udpin:{host}:0"))
    with open("/proc/self/comm", encoding="utf-8") as comm:
        name = comm.read().strip()
    with pytest.raises(LinkError) as raised:
        UdpLink(parse(f"udp:{host}:{port}"))
    assert str(raised.value) == (
        f"udp port {port} on {host.strip('[]')} is taken by {name} (pid {os.getpid()}); "
        "stop it or listen on another port"
    )


def test_a_port_is_not_shared_even_with_a_program_that_would(open_: Open) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        other.bind(("127.0.0.1", 0))
        with pytest.raises(LinkError, match="is taken by"):
            UdpLink(parse(f"udp:127.0.0.1:{other.getsockname()[1]}"))


def test_a_port_that_nobody_holds_has_no_owner(open_: Open) -> None:
    link = open_("udpin:127.0.0.1:0")
    port = port_of(link)
    link.close()
    assert port_owner(port) == ""


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("udp:192.0.2.1:14550", "udp port 14550 on 192.0.2.1: this machine has no such address; listen on one"),
        ("udp:a..b:14550", "'a..b' is not a known host"),
        ("udp:999.1.1.1:14550", "'999.1.1.1' is not a known host"),
    ],
)  # fmt: skip
def test_an_address_that_cannot_be_listened_on_is_said_in_one_line(text: str, part: str) -> None:
    with pytest.raises(LinkError) as raised:
        UdpLink(parse(text))
    assert part in str(raised.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may listen on every port")
def test_a_port_without_permission_is_said_in_one_line() -> None:
    with open("/proc/sys/net/ipv4/ip_unprivileged_port_start", encoding="ascii") as first:
        if int(first.read()) <= 1:
            pytest.skip("every port is open to everybody here")
    with pytest.raises(LinkError, match=r"udp port 1 on 127\.0\.0\.1: no permission"):
        UdpLink(parse("udp:127.0.0.1:1"))


def test_a_peer_that_is_not_there_yet_is_survived(open_: Open) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.settimeout(5)
        peer.bind(("127.0.0.1", 0))
        address = peer.getsockname()
        sending = open_(f"udpout:127.0.0.1:{address[1]}")
        sending.send(b"hello")
        assert peer.recv(100) == b"hello"
    for _ in range(3):  # refused now
        sending.send(b"is anybody there")
        assert sending.receive() == []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.settimeout(5)
        peer.bind(address)
        assert sending.send(b"again")
        assert peer.recv(100) == b"again"


@pytest.mark.parametrize(
    ("to", "data"), [("127.0.0.1:9", b"x" * 70000), ("255.255.255.255:9", b"x"), ("[ff02::1]:9", b"x" * 70000)]
)
def test_what_the_system_will_not_send_is_counted(open_: Open, to: str, data: bytes) -> None:
    link = open_(f"udpout:{to}")
    assert not link.send(data)
    assert link.dropped == 1


def test_a_listener_sends_only_to_somebody(open_: Open) -> None:
    link = open_("udpin:127.0.0.1:0")
    assert not link.send(b"x")
    assert link.dropped == 1


def test_a_sender_also_hears_others_than_its_peer(open_: Open) -> None:
    peer, other = open_("udpin:127.0.0.1:0"), open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(peer)}")
    sending.send(b"x")
    [piece] = heard(peer)
    other.send(b"from elsewhere", piece.source)
    assert heard(sending) == [(b"from elsewhere", ("127.0.0.1", port_of(other)))]


def test_what_the_kernel_dropped_is_counted(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    sent = sum(sending.send(b"x" * 1400) for _ in range(10_000))
    received = 0
    while pieces := listening.receive():
        received += len(pieces)
    assert 0 < received < sent
    assert listening.dropped == sent - received


def test_a_name_that_does_not_resolve_yet_is_asked_for_again(open_: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    listening = open_("udpin:127.0.0.1:0")
    known = threading.Event()
    real = socket.getaddrinfo

    def getaddrinfo(host: str, *args: Any, **options: Any) -> Any:
        if host == "rover.test" and not known.is_set():
            raise socket.gaierror(socket.EAI_AGAIN, "not yet")
        return real("127.0.0.1", *args, **options)

    monkeypatch.setattr(udp, "RESOLVE_EVERY", 0.01)
    monkeypatch.setattr(udp, "RESOLVE_WAIT", 0.0)
    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    sending = open_(f"udpout:rover.test:{port_of(listening)}")
    assert sending.fileno() == -1
    assert sending.receive() == []
    assert not sending.send(b"too early")
    assert sending.dropped == 1
    known.set()
    for thread in threading.enumerate():
        if thread.name == "resolve rover.test":
            thread.join(5)
    assert sending.send(b"now")
    assert [piece.data for piece in heard(listening)] == [b"now"]


def test_asking_for_a_name_stops_when_the_link_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    def getaddrinfo(*args: Any, **options: Any) -> Any:
        raise socket.gaierror(socket.EAI_NONAME, "unknown")

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    link = UdpLink(parse("udpout:nowhere.test:9"))
    [thread] = [thread for thread in threading.enumerate() if thread.name == "resolve nowhere.test"]
    link.close()
    thread.join(5)
    assert not thread.is_alive()
    assert not link.send(b"x")


def test_a_closed_link_gives_and_takes_nothing(open_: Open) -> None:
    link = open_("udpout:127.0.0.1:9")
    link.close()
    assert link.fileno() == -1
    assert link.receive() == []
    assert not link.send(b"x")
