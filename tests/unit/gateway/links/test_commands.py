from __future__ import annotations

import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from mav_robot_status.config import Config, IdentityConfig, LinkConfig
from mav_robot_status.gateway.links.link_hub import LinkHub
from mav_robot_status.mavlink.commands import ROBOT_STATUS
from mav_robot_status.mavlink.definitions import CommandLong
from mav_robot_status.mavlink.framing import Frame
from mav_robot_status.testing import ManualClock

REQUEST_MESSAGE = 512  # MAV_CMD_REQUEST_MESSAGE
US = IdentityConfig().component
ASK = Frame(76, (255, 190), 0, CommandLong(ROBOT_STATUS, 0, 0, 0, 0, 0, 0, REQUEST_MESSAGE, 1, US, 0), b"")


class Site:
    """A hub with one vehicle, 1.1, and an out."""

    def __init__(self, out: str) -> None:
        self.config = Config(links=(LinkConfig("udpin:127.0.0.1:0"),), outs=(LinkConfig(out),))
        self.hub = LinkHub(self.config, ManualClock())
        self.commands = self.hub.receiver.commands
        self.commands.offered = frozenset({ROBOT_STATUS})
        belief: Any = SimpleNamespace(channel=next(self.out.channels()), copied=0, keep=lambda still_there: None)
        self.hub.members.beliefs[1, 1] = belief
        self.hub.sender.send_heartbeat(next(self.out.channels()), 1)  # so it speaks for system 1

    @property
    def out(self) -> Any:
        return self.hub.endpoints[1]


@pytest.fixture
def site() -> Iterator[Site]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground:
        ground.bind(("127.0.0.1", 0))
        made = Site(f"udpout:127.0.0.1:{ground.getsockname()[1]}")
        yield made
        made.hub.close()


def test_a_request_for_a_status_is_kept_until_it_is_asked_for(site: Site) -> None:
    channel = next(site.out.channels())
    assert site.commands.handle(ASK, channel)
    assert site.hub.requests() == {(channel, 1)}
    assert site.hub.requests() == set()


def test_a_request_on_a_link_that_was_closed_since_is_forgotten(site: Site) -> None:
    assert site.commands.handle(ASK, next(site.out.channels()))
    site.hub.change(Config(links=site.config.links))
    assert site.hub.requests() == set()


def test_a_command_to_somebody_else_is_left_alone(site: Site) -> None:
    other = ASK._replace(message=ASK.message._replace(target_system=7, target_component=1))
    assert not site.commands.handle(other, next(site.out.channels()))
    assert site.hub.requests() == set()


def test_a_passive_link_gives_no_status(site: Site) -> None:
    site.out.passive = True
    assert not site.commands.handle(ASK, next(site.out.channels()))
