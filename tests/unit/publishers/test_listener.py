from __future__ import annotations

import socket

import pytest

from mav_robot_status.errors import LinkError
from mav_robot_status.publishers.listener import host_port, listen

NODELAY = (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_a_port_in_use_is_an_error_that_names_output_and_port(host: str) -> None:
    with listen("lamp", host, 0, (), 1) as first:
        port = first.getsockname()[1]
        with pytest.raises(LinkError) as error:
            listen("lamp", host, port, (), 1)
        assert str(error.value) == f"lamp: cannot listen on {host_port(host, port)}/tcp: Address already in use"


def test_accepted_connections_inherit_the_options() -> None:
    with listen("lamp", "127.0.0.1", 0, (NODELAY,), 1) as listener:
        with socket.create_connection(listener.getsockname()):
            accepted, _ = listener.accept()
        with accepted:
            assert accepted.getsockopt(*NODELAY[:2]) == 1


def test_a_port_of_connections_that_just_ended_can_be_opened_again() -> None:
    with listen("lamp", "127.0.0.1", 0, (), 1) as listener:
        host, port = listener.getsockname()
        with socket.create_connection((host, port)) as client:
            listener.accept()[0].close()
            assert client.recv(1) == b""
    listen("lamp", host, port, (), 1).close()
