"""The file server of the fake PX4, with pymavlink's client."""

from __future__ import annotations

import logging
import random
from collections import deque
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavftp
from pymavlink.dialects.v20 import common

from mav_robot_status.mavlink.ftp.payload import (
    NAK,
    NO_SESSIONS,
    OPEN_FILE_RO,
    READ_FILE,
    TERMINATE_SESSION,
    UNKNOWN_COMMAND,
    Payload,
    unpack,
)
from mav_robot_status.testing.file_server import FileServer

NAME = "etc/extras/all_events.json.xz"
DATA = random.Random(3).randbytes(17_344)


class Link:
    """What pymavlink's client calls a connection: the server is at its other end."""

    source_system, source_component = 255, 190

    def __init__(self, server: FileServer) -> None:
        self.mav = self
        self._server = server
        self._arriving: deque[Any] = deque()
        self._seconds = 0.0

    def file_transfer_protocol_send(self, _: int, system: int, component: int, payload: bytes) -> None:
        assert (system, component) == (1, 1)
        for field in self._server.answer(bytes(payload), self._seconds):
            message = common.MAVLink_file_transfer_protocol_message(0, 255, 190, list(field))
            message.pack(common.MAVLink(None, srcSystem=1, srcComponent=1))
            self._arriving.append(message)

    def recv_match(self, **_: Any) -> Any:
        self._seconds += 0.01
        return self._arriving.popleft() if self._arriving else None


@pytest.mark.parametrize("size", [1, 239, 240, 17_344])
def test_pymavlink_reads_a_file_from_it(size: int, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    client = mavftp.MAVFTP(Link(FileServer({NAME: DATA[:size]})), 1, 1)
    client.ftp_settings.burst_read_size = 239
    client.cmd_get([NAME, str(tmp_path / "file")])
    done = client.process_ftp_reply("OpenFileRO", timeout=30)
    assert done.return_code == 0
    assert (tmp_path / "file").read_bytes() == DATA[:size]


def answers(server: FileServer, request: Payload, now: float = 0.0) -> list[Payload]:
    found = [unpack(field) for field in server.answer(request.pack(), now)]
    assert None not in found
    return [one for one in found if one is not None]


def opening(sequence: int = 1, name: str = NAME) -> Payload:
    return Payload(sequence, 0, OPEN_FILE_RO, name.encode(), 0, len(name))


def test_a_repeated_request_gets_the_same_answer() -> None:
    server = FileServer({NAME: DATA})
    assert answers(server, opening()) == answers(server, opening())
    assert answers(server, opening(2))[0].code == NO_SESSIONS


def test_a_session_ends_when_it_is_closed_or_not_used() -> None:
    server = FileServer({NAME: DATA})
    answers(server, opening())
    assert answers(server, opening(5), 9.0)[0].code == NO_SESSIONS
    assert answers(server, opening(9), 19.5)[0].size == 4
    answers(server, Payload(12, 0, TERMINATE_SESSION), 20.0)
    assert answers(server, opening(15), 20.0)[0].size == 4


def test_what_it_does_not_know_is_refused() -> None:
    server = FileServer({NAME: DATA}, bursts=False)
    for number, opcode in enumerate((0, 2, 3, 6, 15, 255)):
        (answer,) = answers(server, Payload(10 * number, 0, opcode))
        assert answer.opcode == NAK or opcode == 2
        assert answer.code in (UNKNOWN_COMMAND, 0)
    (answer,) = answers(server, Payload(100, 0, READ_FILE))
    assert answer.opcode == NAK
