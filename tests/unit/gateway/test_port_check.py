from __future__ import annotations

from dataclasses import replace

import pytest

from mav_robot_status.config import Config, LinkConfig, PublisherConfig
from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER, check


def config(*links: str, outs: tuple[str, ...] = (), publishers: tuple[PublisherConfig, ...] = ()) -> Config:
    return Config(
        links=tuple(LinkConfig(link) for link in links),
        outs=tuple(LinkConfig(out) for out in outs),
        controllers=(replace(DEFAULT_CONTROLLER, publishers=publishers),),
    )


HTTP = PublisherConfig("http", {"listen": "127.0.0.1:8765"})
SIMPLE = PublisherConfig("simple_message", {"host": "0.0.0.0", "port": 8765})


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            config(":14550", "udp:127.0.0.1:14550"),
            "udp port 14550 is given twice, as :14550 and as udp:127.0.0.1:14550",
        ),
        (config("udp:14550", outs=("udpin:[::]:1", "udp:14550")), "udp port 14550 is given twice, as udp:14550;"),
        (config("tcpin:5760", outs=("tcpin:127.0.0.1:5760",)), "tcp port 5760 is given twice"),
        (config("/dev/ttyX", "serial:/dev/ttyX:9600"), "/dev/ttyX is given twice, as /dev/ttyX and as serial:/dev"),
        (
            config(publishers=(HTTP, SIMPLE)),
            "tcp port 8765 is given twice, as http 127.0.0.1:8765 and as simple_message",
        ),
        (config("tcpin:8765", publishers=(HTTP,)), "tcp port 8765 is given twice, as tcpin:8765 and as http 127.0.0.1"),
    ],
)
def test_a_port_or_a_device_that_is_given_twice_is_one_line(given: Config, text: str) -> None:
    with pytest.raises(UsageError) as raised:
        check(given)
    assert str(raised.value).startswith(text)


@pytest.mark.parametrize(
    "given",
    [
        config("udp:127.0.0.1:0", "udp:127.0.0.1:0"),
        config("udp:127.0.0.1:14550", "udp:127.0.0.2:14550"),
        config("udp:14550", "udp:[::1]:14550"),
        config("udp:5760", "tcpin:5760"),
        config("udpout:127.0.0.1:14550", "udp:127.0.0.1:14550", outs=("udpout:127.0.0.1:14550",)),
        config("tcp:127.0.0.1:5760", "tcp:127.0.0.1:5760"),
        config(publishers=(HTTP, PublisherConfig("http", {"listen": "127.0.0.1:8766"}), HTTP)),
    ],
)
def test_other_ports_are_nobodys_business(given: Config) -> None:
    check(given)
