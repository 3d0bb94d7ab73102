from __future__ import annotations

import pytest

from mav_robot_status.demo import FEW, FLEET, fleet, receiver
from mav_robot_status.errors import LinkError, UsageError


def test_a_fleet_begins_with_several_types_and_repeats() -> None:
    assert len({one.firmware.autopilot for one in fleet(16)}) >= 3
    assert [one.title for one in fleet(17)][16] == FLEET[0].title
    assert len(fleet(254)) == 254


def test_a_large_fleet_sends_slowly() -> None:
    assert all(hz <= 1.0 for one in fleet(FEW + 1) for hz in (one.streams or {}).values())
    assert fleet(1)[0].streams != fleet(FEW + 1)[0].streams


@pytest.mark.parametrize("url", ["udp:127.0.0.1:14550", "udpin:127.0.0.1:14550", "udpout:127.0.0.1:14550"])
def test_out_names_the_address_on_which_others_listen(url: str) -> None:
    assert receiver(url) == ("127.0.0.1", 14550)


@pytest.mark.parametrize("url", ["tcp:127.0.0.1:5760", "/dev/ttyACM0", "flight.tlog"])
def test_out_is_udp(url: str) -> None:
    with pytest.raises(UsageError, match=r"write --out udp:127\.0\.0\.1:14550"):
        receiver(url)


def test_out_has_no_ipv6() -> None:
    with pytest.raises(LinkError, match="write an IPv4 address"):
        receiver("udp:[::1]:14550")
