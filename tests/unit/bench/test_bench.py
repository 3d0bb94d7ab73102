"""Short real runs of the command, its sender and its process statistics."""

from __future__ import annotations

import json
import pathlib
import socket
import subprocess
import sys

import pytest

from bench import workload
from bench.__main__ import CASES
from bench.feed import Feed
from bench.process import BenchError, Child, drained, free_port, queue
from bench.sender import Sender

from ...docs.documents import ROOT


@pytest.fixture
def receiver() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(5.0)
    return made


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "bench", *arguments], cwd=ROOT, capture_output=True, text=True, timeout=120, check=True
    )


def test_the_list_has_every_case_or_the_selected_ones() -> None:
    assert [line.split()[0] for line in bench("--list").stdout.splitlines()] == list(CASES)
    assert bench("--list", "--only", "parse").stdout.split()[0] == "parse"


def test_a_run_writes_the_same_results_as_a_table_and_as_json(tmp_path: pathlib.Path) -> None:
    done = bench("--quick", "--rounds", "2", "--only", "parse", "--out", str(tmp_path))
    assert done.stdout == (tmp_path / "results.md").read_text()
    (case,) = json.loads((tmp_path / "results.json").read_text())["cases"]
    assert [row["setup"] for row in case["rows"]] == ["chunks of 1400 bytes", "frame by frame"]
    assert all(len(row["values"]["ours"]) == len(row["values"]["pymavlink"]) == 2 for row in case["rows"])


@pytest.mark.parametrize("rate", [4000, 40_000])  # one frame a system call, and several frames a call
def test_frames_are_sent_in_order_in_a_loop(receiver: socket.socket, rate: int) -> None:
    with receiver:
        frames = workload.frames(16)
        sender = Sender(frames, receiver.getsockname()[1])
        sent, _ = sender.run(rate, 40 / rate)
        sender.close()
        assert [receiver.recv(300) for _ in range(sent)] == (frames * 3)[:40]


def test_dropped_and_waiting_datagrams_are_read_from_the_kernels_table(receiver: socket.socket) -> None:
    with receiver:
        port = receiver.getsockname()[1]
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        sender = Sender(workload.frames(16), port)
        sender.run(10_000, 0.01)
        sender.close()
        found = queue(port)
        assert found is not None
        assert found.waiting > 0
        assert 0 < found.dropped < 100
        assert not drained(port, 0.01)
    assert queue(port) is None


def test_a_process_that_listens_is_fed_and_measured(tmp_path: pathlib.Path) -> None:
    frames = tmp_path / "frames"
    workload.save(frames, workload.frames(256))
    port = free_port()
    code = f"import socket\ns = socket.socket(2, 2)\ns.bind(('127.0.0.1', {port}))\nwhile True: s.recv(300)"
    with Child([sys.executable, "-c", code]) as child, Feed(frames, port) as feed:
        child.listens(port)
        fed = feed.measure(child, 1000, 0.2)
        assert (fed.sent, fed.lost) == (200, 0)
        assert 0 < fed.cpu < 5
        assert child.memory() > 1


def test_a_process_that_ends_at_once_is_an_error_with_its_output() -> None:
    with (
        Child([sys.executable, "-c", "raise SystemExit('no such thing')"]) as child,
        pytest.raises(BenchError) as raised,
    ):
        child.listens(free_port())
    assert "no such thing" in str(raised.value)
