"""Recording: other programs can read the file, and a disk error affects only the recording.

The disk errors are real: a test redirects the writer's descriptor to a pipe without a reader or to /dev/full, or limits
the file size of a child process.
"""

from __future__ import annotations

import errno
import itertools
import json
import logging
import os
import queue
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.gateway.logs.recorded_log import Recording
from mav_robot_status.links import record, tlog_file
from mav_robot_status.links.record import MAX_WAITING, TlogWriter
from mav_robot_status.links.tlog_file import MAX_RECORD, TAIL
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser

from ...deadline import allow

START = 1_700_000_000_000_000
LOGS = sorted((Path(__file__).parents[2] / "recorded" / "logs").glob("*.tlog"))
TIME_OUT = 20.0
"""Seconds after which a test fails."""


def frame(number: int, version: int = 2) -> bytes:
    return encode(mav.Heartbeat(number, 10, 3, 81, 4, 3), system=1, component=1, sequence=number % 256, version=version)


def signed(number: int) -> bytes:
    """A frame with the length and the flag of a signed one. The file does not depend on the signature."""
    plain = frame(number)
    return plain[:2] + b"\1" + plain[3:] + bytes(range(13))


def stamped(number: int, data: bytes | None = None) -> bytes:
    return (START + number).to_bytes(8, "big") + (frame(number) if data is None else data)


def write(path: Path, *numbers: int) -> None:
    writer = TlogWriter(str(path))
    for number in numbers:
        writer.write(START + number, frame(number))
    writer.close()
    assert writer.dropped == 0


def numbers(path: Path) -> list[int]:
    return [Frame(*frame).message.custom_mode for _, frame, _ in Recording(str(path)) if frame is not None]


def frames_of(path: Path) -> list[Frame]:
    return Parser(None, stamped=True).feed(path.read_bytes())


@pytest.fixture(name="flight")
def fixture_flight(tmp_path: Path) -> Path:
    return tmp_path / "flight.tlog"


@pytest.fixture(name="lines")
def fixture_lines() -> Iterator[queue.Queue[str]]:
    """The lines of the log. A test can wait for one."""
    lines: queue.Queue[str] = queue.Queue()

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.put(record.getMessage())

    handler = Handler()
    record.log.addHandler(handler)
    yield lines
    record.log.removeHandler(handler)


class Redirected:
    """Redirects the descriptor with which this process writes a file."""

    def __init__(self, path: Path, elsewhere: int) -> None:
        links = Path("/proc/self/fd")
        [self._descriptor] = [int(n) for n in os.listdir(links) if os.path.realpath(links / n) == str(path.resolve())]
        self._file = os.dup(self._descriptor)
        os.dup2(elsewhere, self._descriptor)
        os.close(elsewhere)

    def back(self) -> None:
        os.dup2(self._file, self._descriptor)
        self.forget()

    def forget(self) -> None:
        """Close the file and release its lock."""
        os.close(self._file)


def in_time(act: Callable[[], None]) -> None:
    """Call it in a thread. Fails if it blocks."""
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    thread.join(TIME_OUT)
    assert not thread.is_alive()


def test_a_record_is_eight_bytes_of_time_and_the_frame(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    writer.write(0x0102030405060708, b"\xfe\0\0\1\1\0\xaa\xbb")
    writer.close()
    assert flight.read_bytes() == bytes.fromhex("0102030405060708 fe00000101 00 aabb")


def test_our_reader_reads_the_file(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    for number in range(300):
        writer.write(START + number, frame(number, 1 + number % 2))
    writer.close()
    found = [(now, frame) for now, frame, _ in Recording(str(flight)) if frame is not None]
    assert [now.unix_us - START for now, _ in found] == list(range(300))
    assert [Frame(*frame).message.custom_mode for _, frame in found] == list(range(300))


@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_a_real_log_recorded_again_is_the_same_file(log: Path, flight: Path) -> None:
    writer = TlogWriter(str(flight))
    for it in frames_of(log):
        writer.write(it.stamp, it.raw)
    writer.close()
    assert writer.dropped == 0
    assert flight.read_bytes() == log.read_bytes()


def test_pymavlink_reads_every_frame_with_its_time(flight: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil = pytest.importorskip("pymavlink.mavutil")
    frames = [frame(number, 1 + number % 2) for number in range(300)]
    writer = TlogWriter(str(flight))
    for number, data in enumerate(frames):
        writer.write(START + number, data)
    writer.close()
    log = mavutil.mavlink_connection(str(flight))
    found = list(iter(log.recv_msg, None))
    log.close()
    assert [bytes(message.get_msgbuf()) for message in found] == frames
    assert [round(message._timestamp * 1e6) - START for message in found] == list(range(300))


FRAMES = st.one_of(
    st.builds(lambda body: b"\xfe" + bytes([len(body) - 6]) + body, st.binary(min_size=6, max_size=261)),
    st.builds(
        lambda flags, body: b"\xfd" + bytes([len(body) - (22 if flags & 1 else 9), flags]) + body,
        st.integers(0, 255),
        st.binary(min_size=22, max_size=264),
    ),
)


@settings(max_examples=50, deadline=None)  # it waits for a disk and a thread
@given(st.lists(st.tuples(st.integers(0, (1 << 52) - 1), FRAMES), min_size=1, max_size=20), st.data())
def test_any_frames_are_in_the_file_unchanged_and_appended_to_after_a_crash(
    pieces: list[tuple[int, bytes]], data: st.DataObject
) -> None:
    records = [stamp.to_bytes(8, "big") + raw for stamp, raw in pieces]
    cut = data.draw(st.integers(1, len(records[-1]) - 1))
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "flight.tlog")
        for _ in range(2):
            writer = TlogWriter(path)
            for stamp, raw in pieces:
                writer.write(stamp, raw)
            writer.close()
            os.truncate(path, os.path.getsize(path) - cut)  # a crash
        assert Path(path).read_bytes() == b"".join(records[:-1]) + b"".join(records)[:-cut]


@pytest.mark.parametrize("last", [frame(9, 1), frame(9, 2), signed(9)], ids=["v1", "v2", "signed"])
@pytest.mark.parametrize("before", [0, 3, 3000], ids=lambda count: f"after {count} records")
def test_a_partial_record_of_every_length_is_removed(flight: Path, before: int, last: bytes) -> None:
    whole = b"".join(stamped(number) for number in range(before))
    assert before < 3000 or len(whole) > TAIL
    torn = stamped(9, last)
    for length in range(len(torn)):
        flight.write_bytes(whole + torn[:length])
        TlogWriter(str(flight)).close()
        assert flight.read_bytes() == whole, length
    flight.write_bytes(whole + torn)
    TlogWriter(str(flight)).close()
    assert flight.read_bytes() == whole + torn


def test_a_partial_frame_that_contains_records_is_removed(flight: Path) -> None:
    carrier = b"\xfd\xff\0\0\0\1\1\x81\1\0" + stamped(1) * 9
    flight.write_bytes(stamped(0) + stamped(1, carrier[:200]))
    TlogWriter(str(flight)).close()
    assert flight.read_bytes() == stamped(0)


@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_a_real_log_truncated_anywhere_keeps_its_whole_records(log: Path, flight: Path) -> None:
    content = log.read_bytes()
    ends = list(itertools.accumulate(8 + len(it.raw) for it in frames_of(log)))
    assert ends[-1] == len(content)
    middle = len(content) // 2
    for cut in range(middle, middle + 100, 3):
        flight.write_bytes(content[:cut])
        TlogWriter(str(flight)).close()
        assert flight.stat().st_size == max(end for end in ends if end <= cut)


def test_a_partial_record_is_logged(flight: Path, caplog: pytest.LogCaptureFixture) -> None:
    flight.write_bytes(stamped(0) + stamped(1)[:10])
    with caplog.at_level(logging.INFO):
        write(flight, 1)
    assert caplog.messages == [f"{flight} ended with a partial record: 10 bytes were removed"]
    assert numbers(flight) == [0, 1]


@pytest.mark.parametrize("zeros", [1, 500, 3 * TAIL])
@pytest.mark.parametrize("kept", [0, 5, 8])
def test_zeros_after_a_power_cut_are_removed(flight: Path, zeros: int, kept: int) -> None:
    flight.write_bytes(stamped(0) + stamped(1)[:kept] + bytes(zeros))
    write(flight, 2)
    assert flight.read_bytes() == stamped(0) + stamped(2)


@pytest.mark.parametrize("zeros", [1, 9, 2 * TAIL])
def test_a_file_of_only_zeros_starts_again_empty(flight: Path, zeros: int) -> None:
    flight.write_bytes(bytes(zeros))
    write(flight, 0)
    assert flight.read_bytes() == stamped(0)


def test_foreign_data_after_the_records_stays(flight: Path) -> None:
    foreign = stamped(0) + b"x" * MAX_RECORD
    flight.write_bytes(foreign)
    write(flight, 1)
    assert flight.read_bytes() == foreign + stamped(1)
    assert numbers(flight) == [0, 1]


def test_garbage_among_the_records_does_not_hide_the_last_one(flight: Path) -> None:
    content = stamped(0) + (START + 1).to_bytes(8, "big") + b"garbage\xfe\xfd\xfd" + stamped(2)
    flight.write_bytes(content + stamped(3)[:12])
    TlogWriter(str(flight)).close()
    assert flight.read_bytes() == content


@pytest.mark.parametrize(
    "content",
    [b"a", b"flight report\n", b"\x7fELF" + bytes(4096), bytes(100) + b"x", frame(0) * 3, b"x" * 2 * TAIL],
    ids=["one byte", "text", "program", "zeros and more", "frames without time", "long"],
)  # fmt: skip
def test_a_file_that_is_not_a_recorded_log_is_not_changed(flight: Path, content: bytes) -> None:
    flight.write_bytes(content)
    with pytest.raises(UsageError) as raised:
        TlogWriter(str(flight))
    assert str(raised.value) == f"{str(flight)!r} does not begin as a recorded log does; record to another file"
    assert flight.read_bytes() == content


@pytest.mark.parametrize(
    ("name", "kind", "line"),
    [
        ("flight.bin", UsageError, "the name must end in .tlog; write for example flight.tlog"),
        ("udp:127.0.0.1:14550", UsageError, "the name must end in .tlog; write for example flight.tlog"),
        ("a\0b.tlog", UsageError, "not a file name; write for example flight.tlog"),
        ("none/flight.tlog", LinkError, "no such folder '{folder}/none'; make it or record elsewhere"),
        ("folder.tlog", UsageError, "it is not a file; write for example flight.tlog"),
        ("full.tlog", UsageError, "it is not a file; write for example flight.tlog"),
        ("file/flight.tlog", LinkError, "Not a directory; record elsewhere"),
    ],
)
def test_an_unusable_path_is_a_one_line_error(tmp_path: Path, name: str, kind: type[Exception], line: str) -> None:
    (tmp_path / "folder.tlog").mkdir()
    (tmp_path / "full.tlog").symlink_to("/dev/full")
    (tmp_path / "file").touch()
    path = f"{tmp_path}/{name}"
    with pytest.raises(kind) as raised:
        TlogWriter(path)
    assert str(raised.value) == f"cannot record to {path!r}: {line.format(folder=tmp_path)}"


@pytest.mark.parametrize(("code", "reason"), [(errno.EACCES, "no permission"), (errno.EROFS, "Read-only file system")])
def test_a_folder_without_permission_is_a_one_line_error(
    flight: Path, code: int, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replaces the system call, because root may write everywhere."""

    def refuse(*_: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(tlog_file, "TlogFile", refuse)
    with pytest.raises(LinkError, match=f"{flight}': {reason}; record "):
        TlogWriter(str(flight))


def test_two_programs_cannot_record_to_one_file(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    with pytest.raises(LinkError, match="another program is recording to it; record to another file"):
        TlogWriter(str(flight))
    writer.close()
    TlogWriter(str(flight)).close()


def test_frames_reach_the_system_within_a_second(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    read, pipe = os.pipe()
    led = Redirected(flight, pipe)
    received: queue.Queue[bytes] = queue.Queue()
    reader = threading.Thread(target=lambda: received.put(os.read(read, 4096)), daemon=True)
    reader.start()
    writer.write(START, frame(0))
    assert received.get(timeout=allow(2.0)) == stamped(0)
    led.back()
    writer.close()
    os.close(read)


def test_a_full_file_is_rotated_and_no_frame_is_lost(flight: Path) -> None:
    size = len(stamped(0))
    most = 100 * size + 5
    writer = TlogWriter(str(flight), max_bytes=most, keep=9)
    for number in range(950):
        writer.write(START + number, frame(number))
    writer.close()
    files = [flight, *(flight.with_suffix(f".{n}.tlog") for n in range(1, 10))]
    assert sorted(flight.parent.iterdir()) == sorted(files)
    assert [file.stat().st_size for file in files] == [50 * size] + [100 * size] * 9
    assert [number for file in reversed(files) for number in numbers(file)] == list(range(950))


@pytest.mark.parametrize("keep", [1, 3])
def test_the_disk_never_holds_more_than_the_configured_files(flight: Path, keep: int) -> None:
    most = 4096
    writer = TlogWriter(str(flight), max_bytes=most, keep=keep)
    for number in range(2000):
        writer.write(START + number, frame(number))
    writer.close()
    files = sorted(flight.parent.iterdir())
    assert len(files) == keep + 1
    assert all(file.stat().st_size <= most for file in files)
    last = [number for n in range(keep, 0, -1) for number in numbers(flight.with_suffix(f".{n}.tlog"))]
    last += numbers(flight)
    assert last == list(range(2000 - len(last), 2000))


def test_a_rotation_stops_at_the_first_free_number(flight: Path) -> None:
    write(flight, 0)
    for n in (1, 3):
        flight.with_suffix(f".{n}.tlog").write_bytes(stamped(n))
    writer = TlogWriter(str(flight), max_bytes=len(stamped(0)))
    writer.write(START + 9, frame(9))
    writer.close()
    found = {file.name: numbers(file) for file in flight.parent.iterdir()}
    assert found == {"flight.tlog": [9], "flight.1.tlog": [0], "flight.2.tlog": [1], "flight.3.tlog": [3]}


def test_the_target_of_a_symbolic_link_is_rotated_in_its_own_folder(tmp_path: Path, flight: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    flight.symlink_to(disk / "real.tlog")
    writer = TlogWriter(str(flight), max_bytes=len(stamped(0)))
    for number in range(2):
        writer.write(START + number, frame(number))
    writer.close()
    assert sorted(file.name for file in disk.iterdir()) == ["real.1.tlog", "real.tlog"]
    assert numbers(flight) == [1]


def test_a_frame_larger_than_the_file_limit_is_written(flight: Path) -> None:
    writer = TlogWriter(str(flight), max_bytes=10, keep=3)
    for number in range(3):
        writer.write(START + number, frame(number))
    writer.close()
    assert numbers(flight) == [2]
    assert len(list(flight.parent.iterdir())) == 3


def test_a_slow_disk_does_not_block_the_caller_and_lost_frames_are_counted(
    flight: Path, lines: queue.Queue[str]
) -> None:
    writer = TlogWriter(str(flight))
    read, pipe = os.pipe()
    led = Redirected(flight, pipe)
    sent = itertools.count()

    def send_too_much() -> None:
        for number in itertools.islice(sent, 3 * MAX_WAITING // len(stamped(0))):
            writer.write(START + number, frame(number))

    in_time(send_too_much)
    assert lines.get(timeout=TIME_OUT) == f"cannot write {flight}: the disk does not keep up; the status continues"
    total, dropped, size = next(sent), writer.dropped, len(stamped(0))
    assert 0 < dropped < total
    with open(read, "rb") as stalled:
        content = stalled.read(1)
        assert writer._waiting_bytes + sum(map(len, writer._batch)) <= 2 * MAX_WAITING
        # the stalled batch is written and the next one stalls: the trouble continues
        content += stalled.read((total - dropped) * size - writer._waiting_bytes)
        assert lines.empty()
        led.back()
        content += stalled.read()
    assert lines.get(timeout=TIME_OUT) == f"writing {flight} again; {dropped} frames are not in it"
    writer.write(START + total, frame(total))
    writer.close()
    assert lines.get_nowait() == f"{flight}: {dropped} frames are not in it"
    assert lines.empty()
    content += flight.read_bytes()
    found = [it.message.custom_mode for it in Parser(None, stamped=True).feed(content)]
    assert len(found) * size == len(content)
    assert len(found) == total + 1 - dropped
    assert found == sorted(set(found))
    assert found[-1] == total


def test_closing_waits_only_for_a_limited_time(
    flight: Path, monkeypatch: pytest.MonkeyPatch, lines: queue.Queue[str]
) -> None:
    monkeypatch.setattr(record, "CLOSE_WAIT", 0.05)
    writer = TlogWriter(str(flight))
    read, pipe = os.pipe()
    led = Redirected(flight, pipe)
    for number in range(4000):
        writer.write(START + number, frame(number))
    in_time(writer.close)
    assert 0 < writer.dropped <= 4000
    told = f"{flight}: {writer.dropped} frames are not in it"
    in_time(writer.close)
    assert lines.get_nowait() == told == f"{flight}: {writer.dropped} frames are not in it"
    assert lines.empty()
    led.back()
    with open(read, "rb") as stalled:
        stalled.read()
    writer._thread.join(TIME_OUT)
    assert not writer._thread.is_alive()


def test_a_failed_write_is_retried_and_the_frames_that_waited_are_written(
    flight: Path, monkeypatch: pytest.MonkeyPatch, lines: queue.Queue[str]
) -> None:
    monkeypatch.setattr(record, "RETRY_EVERY", 0.01)
    writer = TlogWriter(str(flight))
    Redirected(flight, os.open("/dev/full", os.O_RDWR)).forget()
    writer.write(START, frame(0))
    assert lines.get(timeout=TIME_OUT) == f"cannot write {flight}: No space left on device; the status continues"
    # the descriptor is closed: the next attempt opens the file again
    assert lines.get(timeout=TIME_OUT) == f"writing {flight} again; 0 frames are not in it"
    writer.close()
    assert lines.empty()
    assert numbers(flight) == [0]


def test_closing_retries_a_failed_write_once(flight: Path, lines: queue.Queue[str]) -> None:
    writer = TlogWriter(str(flight))
    Redirected(flight, os.open("/dev/full", os.O_RDWR)).forget()
    writer.write(START, frame(0))
    assert "No space left" in lines.get(timeout=TIME_OUT)
    writer.write(START + 1, frame(1))
    writer.close()
    assert writer.dropped == 0
    assert numbers(flight) == [0, 1]


def child(script: str, path: Path) -> subprocess.Popen[str]:
    code = textwrap.dedent(CHILD) + textwrap.dedent(script)
    return subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True)


CHILD = """
    import itertools, json, logging, os, queue, resource, sys, threading
    from mav_robot_status.links import record, tlog_file
    from mav_robot_status.mavlink import definitions as mav
    from mav_robot_status.mavlink.encode import encode

    START = 1_700_000_000_000_000
    path = sys.argv[1]

    def write(number):
        frame = encode(mav.Heartbeat(number, 10, 3, 81, 4, 3), system=1, component=1, sequence=number % 256)
        writer.write(START + number, frame)
"""


def test_a_full_disk_loses_only_whole_records_and_writing_resumes(flight: Path) -> None:
    """A file size limit acts like a full disk: one write is partial, and the next one fails."""
    limit = 10_000
    process = child(
        f"""
        lines = queue.Queue()
        class Handler(logging.Handler):
            def emit(self, record):
                lines.put(record.getMessage())
        record.log.addHandler(Handler())
        record.RETRY_EVERY = 0.05
        resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
        writer = record.TlogWriter(path)
        written = 50_000
        for number in range(written):
            write(number)
        said = [lines.get(timeout={TIME_OUT})]
        while said[-1].endswith("keep up; the status continues"):
            said.append(lines.get(timeout={TIME_OUT}))
        looks = []  # during a retry the file has a partial record for a moment
        while len(looks) < 20:
            threading.Event().wait(0.007)
            looks.append(os.path.getsize(path))
        full = min(looks)
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        said.append(lines.get(timeout={TIME_OUT}))
        write(written)
        writer.close()
        print(json.dumps([said, full, writer.dropped]))
        """,
        flight,
    )
    out, _ = process.communicate(timeout=2 * TIME_OUT)
    said, full, dropped = json.loads(out)
    size = len(stamped(0))
    assert full == limit // size * size  # no byte of a partial record
    assert said[-2:] == [
        f"cannot write {flight}: File too large; the status continues",
        f"writing {flight} again; {dropped} frames are not in it",
    ]
    assert dropped > 0
    found = numbers(flight)
    assert len(found) == 50_001 - dropped
    assert found[-1] == 50_000
    assert found == sorted(set(found))
    assert flight.stat().st_size == len(found) * size


def test_a_killed_process_loses_at_most_a_second_and_one_record(flight: Path) -> None:
    process = child(
        """
        writer = record.TlogWriter(path)
        for number in range(1000):
            write(number)
        threading.Event().wait(1.0)
        print("a second later", flush=True)
        for number in itertools.count(1000):
            write(number)
            if number % 10_000 == 0:
                print(number, flush=True)
        """,
        flight,
    )
    assert process.stdout
    with process.stdout:
        for _ in range(4):
            assert process.stdout.readline()
        process.send_signal(signal.SIGKILL)
        process.wait(TIME_OUT)
    before = flight.read_bytes()
    recording = Recording(str(flight))
    found = [Frame(*frame).message.custom_mode for _, frame, _ in recording if frame is not None]
    assert found[:1000] == list(range(1000))
    assert found == sorted(set(found))
    torn = len(before) % len(stamped(0))
    assert "garbage" not in recording.summary()
    write(flight, 7)
    assert flight.read_bytes() == before[: len(before) - torn] + stamped(7)


def test_a_second_close_does_nothing_and_later_frames_are_counted(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    writer.write(START, frame(0))
    writer.close()
    writer.write(START, frame(1))
    writer.close()
    assert writer.dropped == 1
    assert numbers(flight) == [0]


@pytest.mark.parametrize(("stamp", "found"), [(-1, 0), (0, 0), (1 << 64, (1 << 64) - 1)])
def test_an_absurd_clock_does_not_raise(flight: Path, stamp: int, found: int) -> None:
    writer = TlogWriter(str(flight))
    writer.write(stamp, frame(0))
    writer.close()
    assert flight.read_bytes() == found.to_bytes(8, "big") + frame(0)


def test_the_text_names_the_file(flight: Path) -> None:
    writer = TlogWriter(str(flight))
    assert writer.text == f"recording to {flight}"
    writer.close()
