from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway.links.membership import Membership, close

ONE, TWO = (LinkConfig(f"udpout:127.0.0.1:{port}") for port in (9, 10))
OUT = LinkConfig("udpout:127.0.0.1:11")


@pytest.fixture
def members() -> Iterator[Membership]:
    made = Membership()
    yield made
    close(made.endpoints)


def change(members: Membership, config: Config) -> list[Any]:
    closed = members.close_others(config)
    members.open(config)
    return closed


def test_links_that_stay_are_the_same_and_have_the_numbers_of_the_configuration(members: Membership) -> None:
    change(members, Config(links=(ONE,), outs=(OUT,)))
    one, out = members.endpoints
    assert change(members, Config(links=(TWO, ONE), outs=(OUT,))) == []
    assert members.endpoints[1:] == [one, out]
    assert [endpoint.number for endpoint in members.endpoints] == [0, 1, 2]


def test_a_link_that_the_configuration_lacks_is_closed(members: Membership) -> None:
    change(members, Config(links=(ONE, TWO)))
    one, two = members.endpoints
    assert change(members, Config(links=(TWO,))) == [one]
    assert members.endpoints == [two]
    assert one.link.fileno() == -1


def test_a_link_that_becomes_an_out_is_opened_anew(members: Membership) -> None:
    change(members, Config(links=(ONE,)))
    (one,) = members.endpoints
    assert change(members, Config(outs=(ONE,))) == [one]
    assert members.endpoints[0].is_out


def test_the_outs_are_open_if_a_link_to_a_vehicle_cannot_be(members: Membership) -> None:
    with pytest.raises(LinkError):
        change(members, Config(links=(LinkConfig("udpin:no-such-host.invalid:14550"),), outs=(OUT,)))
    assert [endpoint.is_out for endpoint in members.endpoints] == [True]


def test_the_peers_are_the_same_tuple_until_they_change(members: Membership) -> None:
    change(members, Config(links=(ONE,), outs=(OUT,)))
    peers = members.peers()
    assert members.peers() is peers
    change(members, Config(links=(ONE,)))
    assert [channel.endpoint for channel in members.peers()] == members.endpoints
