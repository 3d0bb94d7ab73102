from __future__ import annotations

import fcntl
import io
import logging
import os
import sys
from collections.abc import Iterator
from typing import TextIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.errors import LinkError
from mav_robot_status.streams import StderrHandler, complain, detach, open_missing, say, visible

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


HOSTILE = "a\x1b]52;c;aGk=\x07b\r\nc\x9b2Jd\u202ee\u2066f\u200bg\x7fh\u2028i\udcffj\x00"


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("Radio Failsafe", "Radio Failsafe"),
        ("Überhöhung, 電池, סוללה", "Überhöhung, 電池, סוללה"),
        ("\x1b[2J", r"\u001b[2J"),
        ("a\r\nb\tc", r"a\u000d\u000ab\u0009c"),
        ("\x9b\x7f", r"\u009b\u007f"),
        ("\u202eevil\u2069", r"\u202eevil\u2069"),
        ("\u2028\udcff", r"\u2028\udcff"),
        ("\U000e0041", r"\U000e0041"),
        (3.5, "3.5"),
    ],
)
def test_what_does_not_print_is_shown_by_its_code(text: object, seen: str) -> None:
    assert visible(text) == seen
    assert visible(seen) == seen


@given(st.text())
def test_any_text_becomes_one_printable_line(text: str) -> None:
    assert visible(text).isprintable()


def test_lines_are_said_visibly_in_any_encoding(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding="latin-1"))
    say(HOSTILE, "ü電")
    first, second = written.getvalue().decode("latin-1").splitlines()
    assert first == visible(HOSTILE)
    assert second == r"ü\u96fb"


def test_a_full_disk_below_standard_output_is_a_link_error(monkeypatch: pytest.MonkeyPatch) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        monkeypatch.setattr(sys, "stdout", full)
        with pytest.raises(LinkError, match="cannot write to standard output: No space left on device"):
            say("x")


def test_a_log_line_is_visible_and_a_traceback_keeps_its_lines() -> None:
    stream = io.StringIO()
    logger = logging.Logger("visible")
    logger.addHandler(StderrHandler(stream, "it: %(message)s"))
    logger.warning("peer %s", HOSTILE)
    try:
        raise ValueError(HOSTILE)
    except ValueError:
        logger.exception("no")
    first, second, *rest = stream.getvalue().splitlines()
    assert first == f"it: peer {visible(HOSTILE)}"
    assert second == "it: no"
    assert len(rest) >= 3
    assert all(line.isprintable() for line in rest)


def test_a_complaint_is_one_visible_line(capsys: pytest.CaptureFixture[str]) -> None:
    complain(HOSTILE)
    assert capsys.readouterr().err == visible(HOSTILE) + "\n"
