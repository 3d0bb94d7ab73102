from __future__ import annotations

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.publishers.simple_message.options import read


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, ("127.0.0.1", 11002)),
        ({"host": "192.168.1.5:11003"}, ("192.168.1.5", 11003)),
        ({"host": "robot"}, ("robot", 11002)),
        ({"host": "robot", "port": 11003}, ("robot", 11003)),
        ({"port": "11003"}, ("127.0.0.1", 11003)),
        ({"host": ":11003"}, ("0.0.0.0", 11003)),
        ({"host": ":"}, ("0.0.0.0", 11002)),
        ({"host": "11003"}, ("0.0.0.0", 11003)),
        ({"host": "[::1]:11003"}, ("::1", 11003)),
        ({"host": "[::1]", "port": 0}, ("::1", 0)),
        ({"host": "[fe80::1%eth0]"}, ("fe80::1%eth0", 11002)),
    ],
)
def test_where_it_listens(given: dict[str, object], found: tuple[str, int]) -> None:
    assert read(given)[:2] == found


@pytest.mark.parametrize(
    "text", ["", "::1", "::1:11002", "a:b", "1.2.3.4:99999", "[::1", "a b:1", "1.2.3.4:-1", "a:1:2"]
)
def test_an_invalid_address_is_an_error_with_an_example(text: str) -> None:
    with pytest.raises(UsageError, match=r"is not an address to listen on; write HOST:PORT, for example 0.0.0.0:11002"):
        read({"host": text})


def test_a_port_is_given_once() -> None:
    with pytest.raises(UsageError, match="simple_message: 'robot:11003' has a port already: leave out 'port'"):
        read({"host": "robot:11003", "port": 11003})


@pytest.mark.parametrize(("port", "told"), [(1.5, "a whole number, not 1.5"), (65536, "from 0 to 65535"), ("x", "'x'")])
def test_a_port_is_a_number_from_0_to_65535(port: object, told: str) -> None:
    with pytest.raises(UsageError, match=f"simple_message: port: must be .*{told}"):
        read({"port": port})


def test_the_byte_order() -> None:
    assert read({})[2] == "little"
    assert read({"byte_order": "big"})[2] == "big"
    with pytest.raises(UsageError, match="simple_message: byte_order: must be one of little, big, not 'swapped'"):
        read({"byte_order": "swapped"})


def test_an_unknown_option_has_a_suggestion() -> None:
    with pytest.raises(UsageError, match="simple_message: unknown option 'byteorder'; did you mean 'byte_order'"):
        read({"byteorder": "big"})
