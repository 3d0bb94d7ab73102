import logging
import math
import os
import select
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.errors import LinkError
from mav_robot_status.links import open_link
from mav_robot_status.links.base import Link, Received
from mav_robot_status.links.udp import ANSWER_SILENCE, UdpLink, UdpListener, UdpSender
from mav_robot_status.links.url import parse

from .conftest import Names
from .peers import port_of

Open = Callable[[str], UdpLink]


@pytest.fixture(name="open_")
def fixture_open() -> Iterator[Open]:
    links = []

    def open_(text: str) -> UdpLink:
        link = open_link(parse(text))
        assert isinstance(link, UdpLink)
        links.append(link)
        return link

    yield open_
    for link in links:
        link.close()


def heard(link: Link, limit: int = 64) -> list[Received]:
    select.select([link], [], [], 5)
    return link.receive(limit)


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_both_ends_receive_from_each_other(open_: Open, host: str) -> None:
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


def test_the_text_of_a_sender_names_its_peer(open_: Open) -> None:
    assert open_("[::1]:14550").text == "sending to [::1]:14550/udp"


def test_receiving_never_waits_and_returns_at_most_the_limit(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    assert listening.receive() == []
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    for number in range(10):
        sending.send(bytes([number]))
    assert [piece.data[0] for piece in heard(listening, 4)] == [0, 1, 2, 3]
    assert [piece.data[0] for piece in listening.receive(64)] == [4, 5, 6, 7, 8, 9]
    assert listening.receive() == []


def test_an_empty_and_the_longest_datagram_arrive_whole(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    for data in (b"", b"x" * 65507):
        assert sending.send(data)
        assert [piece.data for piece in heard(listening)] == [data]


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_a_port_in_use_is_an_error_that_names_the_owner(open_: Open, host: str) -> None:
    port = port_of(open_(f"udpin:{host}:0"))
    with open("/proc/self/comm", encoding="utf-8") as comm:
        name = comm.read().strip()
    with pytest.raises(LinkError) as raised:
        open_link(parse(f"udp:{host}:{port}"))
    assert str(raised.value) == (
        f"udp port {port} on {host.strip('[]')} is taken by {name} (pid {os.getpid()}); "
        "stop it or listen on another port"
    )


def test_a_port_is_not_shared_even_with_a_program_that_allows_it(open_: Open) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        other.bind(("127.0.0.1", 0))
        with pytest.raises(LinkError, match="is taken by"):
            open_link(parse(f"udp:127.0.0.1:{other.getsockname()[1]}"))


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("udp:a..b:14550", "'a..b' is not a known host"),
        ("udp:999.1.1.1:14550", "'999.1.1.1' is not a known host"),
    ],
)  # fmt: skip
def test_an_invalid_host_is_a_one_line_error(text: str, part: str) -> None:
    with pytest.raises(LinkError) as raised:
        open_link(parse(text))
    assert part in str(raised.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="needs a user without privileges: root may listen on every port")
def test_a_port_without_permission_is_a_one_line_error() -> None:
    with open("/proc/sys/net/ipv4/ip_unprivileged_port_start", encoding="ascii") as first:
        if int(first.read()) <= 1:
            pytest.skip("needs privileged ports: net.ipv4.ip_unprivileged_port_start is 0")
    with pytest.raises(LinkError, match=r"udp port 1 on 127\.0\.0\.1: no permission"):
        open_link(parse("udp:127.0.0.1:1"))


def test_a_missing_peer_is_not_an_error(open_: Open) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.settimeout(5)
        peer.bind(("127.0.0.1", 0))
        address = peer.getsockname()
        sending = open_(f"udpout:127.0.0.1:{address[1]}")
        sending.send(b"hello")
        assert peer.recv(100) == b"hello"
    for _ in range(3):  # ECONNREFUSED
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
def test_a_send_that_the_system_refuses_is_counted(open_: Open, to: str, data: bytes) -> None:
    link = open_(f"udpout:{to}")
    assert not link.send(data)
    assert link.dropped == 1


def test_a_listener_sends_only_to_an_address(open_: Open) -> None:
    link = open_("udpin:127.0.0.1:0")
    assert not link.send(b"x")
    assert link.dropped == 1


def test_a_sender_receives_from_every_address(open_: Open) -> None:
    peer, other = open_("udpin:127.0.0.1:0"), open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(peer)}")
    sending.send(b"x")
    [piece] = heard(peer)
    other.send(b"from elsewhere", piece.source)
    assert heard(sending) == [(b"from elsewhere", ("127.0.0.1", port_of(other)))]


def test_datagrams_that_the_kernel_drops_are_counted(open_: Open) -> None:
    listening = open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:127.0.0.1:{port_of(listening)}")
    sent = sum(sending.send(b"x" * 1400) for _ in range(10_000))
    received = 0
    while pieces := listening.receive():
        received += len(pieces)
    assert 0 < received < sent
    assert listening.dropped == sent - received


def test_a_name_that_does_not_resolve_yet_is_retried(
    open_: Open, names: Names, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    listening = open_("udpin:127.0.0.1:0")
    sending = open_(f"udpout:rover.test:{port_of(listening)}")
    assert (sending.fileno(), sending.due(), sending.port) == (-1, -math.inf, 0)
    assert sending.receive() == []
    assert not sending.send(b"too early")
    assert sending.dropped == 1
    for now in (100.0, 110.0):
        names.resolve(sending, now)
        assert sending.fileno() == -1
        assert now < sending.due() <= now + 0.4
    names.known["rover.test"] = "127.0.0.1"
    names.resolve(sending, 120.0)
    assert sending.due() == math.inf
    assert sending.send(b"now")
    assert [piece.data for piece in heard(listening)] == [b"now"]
    text = f"sending to rover.test:{port_of(listening)}/udp"
    assert caplog.messages == [
        f"{text}: the name rover.test does not resolve yet, trying again",
        f"{text}: rover.test is 127.0.0.1",
    ]


def test_a_closed_link_neither_sends_nor_receives(open_: Open) -> None:
    link = open_("udpout:127.0.0.1:9")
    link.close()
    assert link.fileno() == -1
    assert link.receive() == []
    assert not link.send(b"x")


@pytest.fixture(name="crowd")
def fixture_crowd() -> Iterator[list[socket.socket]]:
    """Two receivers of broadcasts on the loopback interface."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        for hearing in (one, two):
            hearing.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            hearing.bind(("127.255.255.255", one.getsockname()[1]))
            hearing.settimeout(5)
        yield [one, two]


def test_a_listener_drops_datagrams_of_other_addresses_and_counts_them(
    open_: Open, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_("udpin:127.0.0.1:0?from=127.0.0.5,127.0.1.0/24")
    for host in ("127.0.0.6", "127.0.0.5", "127.0.1.77", "127.0.0.7"):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.bind((host, 0))
            sender.sendto(host.encode(), ("127.0.0.1", link.port))
    assert isinstance(link, UdpListener)
    assert [piece.data for piece in link.receive(2)] == [b"127.0.0.5"]
    assert [piece.data for piece in link.receive_dated()] == [b"127.0.1.77"]
    assert link.due() == -math.inf
    link.service(100.0)
    assert link.due() == math.inf
    assert caplog.messages == [
        f"{link.text}: refused 2 datagrams from 127.0.0.7, which is not in from=127.0.0.5,127.0.1.0/24"
    ]
    assert link.text == f"listening on 127.0.0.1:{link.port}/udp, from 127.0.0.5, 127.0.1.0/24 only"


def test_a_broadcaster_sends_to_all_until_a_peer_answers(
    open_: Open, crowd: list[socket.socket], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"udpbcast:127.255.255.255:{crowd[0].getsockname()[1]}")
    assert link.due() == math.inf
    assert link.send(b"who is there")
    assert [hearing.recv(100) for hearing in crowd] == [b"who is there"] * 2

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.settimeout(5)
        peer.sendto(b"I am", ("127.0.0.1", link.port))
        (answer,) = heard(link)
        assert answer.data == b"I am"
        assert link.due() == math.inf  # no MAVLink yet
        assert isinstance(link, UdpSender)
        link.answered(answer.source)
        assert link.due() == -math.inf
        link.service(100.0)
        assert link.due() == 100.0 + ANSWER_SILENCE
        assert link.send(b"good")
        assert peer.recv(100) == b"good"

        peer.sendto(b"still here", ("127.0.0.1", link.port))
        assert [piece.data for piece in heard(link)] == [b"still here"]
        link.service(125.0)
        link.service(125.0 + ANSWER_SILENCE - 0.1)
        assert link.send(b"and still")
        assert peer.recv(100) == b"and still"

        link.service(125.0 + ANSWER_SILENCE)
        assert link.due() == math.inf
        assert link.send(b"who else")
        assert [hearing.recv(100) for hearing in crowd] == [b"who else"] * 2
        where = f"127.0.0.1:{peer.getsockname()[1]}"
    assert caplog.messages == [
        f"{link.text}: {where} answers, sending to it",
        f"{link.text}: {where} is silent, broadcasting again",
    ]


def test_a_broadcaster_drops_a_silent_peer_although_others_send(open_: Open, crowd: list[socket.socket]) -> None:
    link = open_(f"udpbcast:127.255.255.255:{crowd[0].getsockname()[1]}")
    peer, other = open_("udpin:127.0.0.1:0"), open_("udpin:127.0.0.1:0")
    assert link.send(b"who is there")
    peer.send(b"first", ("127.0.0.1", link.port))
    (answer,) = heard(link)
    assert isinstance(link, UdpSender)
    link.answered(answer.source)
    link.service(100.0)
    other.send(b"second", ("127.0.0.1", link.port))
    assert len(heard(link)) == 1
    assert link.due() == 100.0 + ANSWER_SILENCE


def test_a_broadcast_address_without_the_broadcast_kind_is_logged_once(
    open_: Open, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_("udpout:255.255.255.255:9")
    assert not any(link.send(b"x") for _ in range(3))
    assert link.dropped == 3
    assert caplog.messages == [
        "sending to 255.255.255.255:9/udp: cannot send to 255.255.255.255:9: that is a broadcast address; "
        "write udpbcast: to send to it"
    ]


NETWORKS = """
import logging, subprocess, sys
logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
from mav_robot_status.links import open_link
from mav_robot_status.links.url import parse
def ip(words): subprocess.run(["ip", *words.split()], check=True)
ip("link set lo up")
udp, tcp = (open_link(parse(text)) for text in ("udp:10.77.0.1:14550", "tcpin:10.77.0.1:5760"))
sending = open_link(parse("udpout:10.77.0.1:14550"))
now = 100.0
for _ in range(5):
    for link in (udp, tcp):
        assert link.due() <= now, link.due()
        link.service(now)
        assert now < link.due() <= now + 5
        assert link.receive() == []
    assert not sending.send(b"nobody")
    now += 5
assert udp.fileno() == -1 and not udp.send(b"x")
ip("addr add 10.77.0.1/32 dev lo")
for link in (udp, tcp):
    link.service(now)
    assert link.due() == float("inf"), link.due()
assert sending.send(b"here") and [piece.data for piece in udp.receive()] == [b"here"]
client = open_link(parse("tcp:10.77.0.1:5760"))
client.service(now)
assert client.send(b"there") and tcp.receive() == [] and [piece.data for piece in tcp.receive()] == [b"there"]
for link in (udp, tcp, sending, client): link.close()
"""


def test_a_link_waits_for_an_interface_that_comes_up_later() -> None:
    """In a separate network namespace, where the address is added later."""
    alone = ["unshare", "--user", "--map-root-user", "--net"]
    there = all(map(shutil.which, ("unshare", "ip")))
    if not there or subprocess.run([*alone, "ip", "link"], capture_output=True, check=False).returncode:
        pytest.skip("no network namespaces: run as root with CAP_SYS_ADMIN")
    done = subprocess.run([*alone, sys.executable, "-c", NETWORKS], capture_output=True, text=True, check=False)
    assert (done.stderr, done.returncode) == ("", 0)
    udp, tcp = "listening on 10.77.0.1:14550/udp", "listening on 10.77.0.1:5760/tcp"
    lines = done.stdout.splitlines()
    client = lines.pop().removesuffix(" has connected")
    assert client.startswith(f"{tcp}: 10.77.0.1:")
    assert lines == [
        f"{udp} waits for a network interface with this address",
        f"{tcp} waits for a network interface with this address",
        "sending to 10.77.0.1:14550/udp: cannot send to 10.77.0.1:14550: network is unreachable",
        f"{udp}: the address is available now",
        f"{tcp}: the address is available now",
        "sending to 10.77.0.1:14550/udp: can send to 10.77.0.1:14550 again",
        "connected to 10.77.0.1:5760/tcp",
    ]
