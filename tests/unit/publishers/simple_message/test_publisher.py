from __future__ import annotations

import logging
import re
import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import closing

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import LinkError
from mav_robot_status.interface import PublisherContext, RobotMode, RobotStatus, RobotStatusMsg, TriState
from mav_robot_status.publishers.simple_message.publisher import LOOK, SimpleMessagePublisher

from ....deadline import SOON, allow
from ..port import Port, msg

AUTO = RobotStatus(mode=RobotMode.AUTO)


def made(**options: object) -> SimpleMessagePublisher:
    return SimpleMessagePublisher(PublisherContext({"port": 0, **options}, Port(), sys.stdout))


@pytest.fixture
def publisher() -> Iterator[SimpleMessagePublisher]:
    with closing(made()) as publisher:
        yield publisher


def connected(publisher: SimpleMessagePublisher) -> socket.socket:
    host, _, port = publisher._server.where.rpartition(":")
    return socket.create_connection((host, int(port)), timeout=allow(SOON))


def modes(client: socket.socket, count: int, order: str = "<") -> list[int]:
    """The modes of the next frames."""
    data = b""
    while len(data) < 44 * count:
        more = client.recv(44 * count - len(data))
        assert more
        data += more
    return [struct.unpack_from(f"{order}11i", data, 44 * number)[9] for number in range(count)]


def test_every_message_is_a_frame_and_a_new_client_gets_the_latest_at_once(publisher: SimpleMessagePublisher) -> None:
    publisher.publish(msg(AUTO))
    with connected(publisher) as client:
        publisher.service(Instant(1.0, 0))
        publisher.publish(msg())
        publisher.publish(msg(AUTO))
        assert modes(client, 3) == [2, -1, 2]


def test_a_client_does_not_get_the_status_of_a_handle_that_is_gone(publisher: SimpleMessagePublisher) -> None:
    publisher.publish(msg(AUTO))
    publisher.forget("robot")
    with connected(publisher) as client:
        publisher.service(Instant(1.0, 0))
        publisher.publish(msg())
        assert modes(client, 1) == [-1]


@pytest.mark.parametrize("pings", [b"", struct.pack("<4i", 12, 1, 2, 0) * 3])
def test_the_last_frame_says_that_nothing_is_known(pings: bytes) -> None:
    with closing(made()) as publisher, connected(publisher) as client:
        publisher.publish(msg(AUTO._replace(drives_powered=TriState.FALSE, in_error=TriState.TRUE, error_code=7)))
        publisher.service(Instant(1.0, 0))
        client.sendall(pings)
        publisher.close()
        data = b""
        while more := client.recv(1000):
            data += more
        assert struct.unpack("<11i", data[-44:])[4:] == (-1, -1, 0, -1, -1, -1, -1)


def test_it_looks_at_its_clients_ten_times_a_second(publisher: SimpleMessagePublisher) -> None:
    assert publisher.service(Instant(5.0, 0)) == 5.0 + LOOK
    with connected(publisher) as client:
        publisher.publish(msg())
        assert publisher.service(Instant(5.0 + LOOK / 2, 0)) == 5.0 + LOOK
        client.setblocking(False)
        with pytest.raises(BlockingIOError):
            client.recv(1)
        publisher.service(Instant(5.0 + LOOK, 0))
        client.settimeout(allow(SOON))
        assert modes(client, 1) == [-1]


def test_the_other_byte_order() -> None:
    with closing(made(byte_order="big")) as publisher:
        publisher.publish(msg(AUTO))
        with connected(publisher) as client:
            publisher.service(Instant(1.0, 0))
            assert modes(client, 1, ">") == [2]


def test_the_log_says_where_it_listens_and_a_port_in_use_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO), closing(made()):
        found = re.fullmatch(r"simple_message: listening on 127\.0\.0\.1:(\d+)/tcp", caplog.messages[0])
        assert found
        with pytest.raises(LinkError, match=f"simple_message: cannot listen on 127.0.0.1:{found[1]}/tcp: Address alr"):
            made(port=int(found[1]))


def test_a_client_that_does_not_read_is_a_dropped_message(publisher: SimpleMessagePublisher) -> None:
    with connected(publisher) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
        publisher.service(Instant(1.0, 0))
        assert not publisher.busy()
        assert publisher.dropped == 0
        message: RobotStatusMsg = msg()
        for _ in range(200_000):
            publisher.publish(message)
            if publisher.dropped:
                break
        assert publisher.dropped == 1
