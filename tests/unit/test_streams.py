from __future__ import annotations

import fcntl
import io
import logging
import os
import sys
from collections.abc import Iterator
from typing import TextIO

import pytest

from mav_robot_status.streams import StderrHandler, complain, detach, open_missing

RECORD = logging.LogRecord("x", logging.INFO, "x.py", 1, "hello", None, None)


@pytest.fixture
def pipe() -> Iterator[tuple[int, TextIO]]:
    read, write = os.pipe()
    with os.fdopen(write, "w", encoding="utf-8") as stream:
        yield read, stream
    os.close(read)


def test_a_log_line_is_written_to_the_stream(pipe: tuple[int, TextIO]) -> None:
    StderrHandler(pipe[1]).emit(RECORD)
    assert os.read(pipe[0], 100) == b"hello\n"


def test_a_full_pipe_loses_log_lines_and_does_not_block(pipe: tuple[int, TextIO]) -> None:
    size = fcntl.fcntl(pipe[1].fileno(), fcntl.F_GETPIPE_SZ)
    os.write(pipe[1].fileno(), bytes(size))
    StderrHandler(pipe[1]).emit(RECORD)
    assert b"hello" not in os.read(pipe[0], 1 << 20)


def test_a_stream_without_a_descriptor_is_written_to_directly() -> None:
    stream = io.StringIO()
    StderrHandler(stream).emit(RECORD)
    assert stream.getvalue() == "hello\n"


def test_an_error_message_without_a_stream_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    read, write = os.pipe()
    os.close(read)
    with open(write, "w", encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        complain("lost")
        assert os.readlink(f"/proc/self/fd/{write}") == os.devnull


def test_a_detached_stream_leads_to_dev_null(pipe: tuple[int, TextIO]) -> None:
    detach(pipe[1])
    pipe[1].write("lost")
    pipe[1].flush()
    os.set_blocking(pipe[0], False)
    assert os.read(pipe[0], 100) == b""


def test_missing_streams_are_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    before = sys.stderr
    open_missing()
    with sys.stdout as opened:
        opened.write("nowhere")
    assert sys.stderr is before
