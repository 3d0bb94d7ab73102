import logging
import math

import pytest

from mav_robot_status.links.senders import Senders
from mav_robot_status.links.url import parse


def heard(url: str, *hosts: str) -> list[bool]:
    senders = Senders(parse(url), "datagram")
    return [senders.admits(host) for host in hosts]


def test_without_from_every_address_is_heard() -> None:
    assert heard("udp:14550", "10.0.0.5", "fe80::1") == [True, True]


def test_addresses_and_networks_of_both_families_are_heard() -> None:
    url = "udp:[::]:14550?from=10.0.0.5,10.1.0.0/16,fe80::/10,2001:db8::1"
    yes = heard(url, "10.0.0.5", "::ffff:10.0.0.5", "10.1.255.1", "::ffff:10.1.2.3", "fe80::1%eth0", "2001:db8::1")
    assert yes == [True] * 6
    assert heard(url, "10.0.0.6", "::ffff:10.0.0.6", "10.2.0.1", "2001:db8::2", "::1") == [False] * 5


def test_refused_datagrams_are_counted_in_one_line_in_30_s(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    senders = Senders(parse("udp:14550?from=10.0.0.5,10.0.1.0/24"), "datagram")
    assert senders.due() == math.inf
    assert not senders.admits("10.0.0.8")
    assert senders.due() == -math.inf
    senders.service(100.0, "a link")
    for _ in range(11):
        senders.admits("10.0.0.7")
    assert not senders.admits("10.0.0.9")
    senders.service(101.0, "a link")
    assert senders.due() == 130.0
    senders.service(130.0, "a link")
    assert senders.due() == math.inf
    assert caplog.messages == [
        "a link: refused 1 datagram from 10.0.0.8, which is not in from=10.0.0.5,10.0.1.0/24",
        "a link: refused 12 datagrams from 10.0.0.9, which is not in from=10.0.0.5,10.0.1.0/24",
    ]
