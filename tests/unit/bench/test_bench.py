"""Short real runs of the command, its sender and its process statistics."""

from __future__ import annotations

import json
import pathlib
import socket
import sys
from collections.abc import Iterator
from contextlib import closing

import pytest

from bench import workload
from bench.__main__ import CASES, main
from bench.case import Bench, Case
from bench.contenders import ROUTER, Contenders, version_of
from bench.feed import Feed
from bench.process import BenchError, Child, drained, free_port, queue
from bench.report import BEGIN, END, into, summary
from bench.results import FIRST_MACHINE, OURS, Sample, Skip, Target
from bench.sender import Sender

from ...deadline import SOON, wait_until


@pytest.fixture
def receiver() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(5.0)
    return made


def test_the_list_has_every_case_or_the_selected_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(CASES)
    assert main(["--list", "--only", "parse"]) == 0
    assert capsys.readouterr().out.split()[0] == "parse"


def test_a_run_writes_the_same_results_as_a_table_and_as_json(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    only_tiny(monkeypatch)
    assert main(["--rounds", "2", "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert shown == (tmp_path / "results.md").read_text()
    (case,) = json.loads((tmp_path / "results.json").read_text())["cases"]
    assert case["rows"] == [{"setup": "a setup", "metric": "time, us", "values": {"ours": [100, 100]}}]
    assert case["notes"] == ["ours: no such program"]
    assert "| at most 0.1 ms | 100 us (limit here 1,000) | yes |" in shown


def test_a_run_writes_the_tables_into_a_page(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_tiny(monkeypatch)
    monkeypatch.setattr("bench.__main__.RESULTS", tmp_path)
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}{END}after\n")
    assert main(["--rounds", "1", "--write", str(page), "--busy", "tests"]) == 0
    text = page.read_text()
    assert text.startswith("before\n")
    assert "The machine is busy: tests." in text
    assert text == into(text, summary(json.loads((tmp_path / "results.json").read_text())))


@pytest.mark.parametrize(
    ("text", "arguments", "said"),
    [
        ("no marks\n", (), "the page lacks the lines <!-- results --> and <!-- end of results -->"),
        (f"{BEGIN}{END}", ("--only", "parse"), "--write needs a whole run: leave out --only"),
    ],
)
def test_a_page_that_cannot_take_the_tables_is_an_error_before_the_run(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], text: str, arguments: tuple[str, ...], said: str
) -> None:
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(SystemExit):
        main(["--write", str(page), *arguments])
    assert said in capsys.readouterr().err


def only_tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bench with one case, which takes no time, on a machine ten times slower than that of its target."""

    def measure(_: Bench) -> Iterator[Sample | Skip]:
        yield Sample("a setup", "time, us", OURS, 100)
        raise BenchError("no such program")

    target = Target("a setup", "time, us", "at most 0.1 ms", 100.0, machine=FIRST_MACHINE)
    monkeypatch.setattr("bench.__main__.CASES", {"tiny": Case("tiny", "", measure, (target,))})
    monkeypatch.setattr("bench.cases.parse.speed", lambda _: 10 * FIRST_MACHINE)


def test_a_program_that_is_not_installed_is_skipped_by_name(tmp_path: pathlib.Path) -> None:
    with closing(Contenders(tmp_path, {ROUTER: "no-such-program"})) as contenders:
        skipped: list[Skip] = []
        assert list(contenders.each([OURS, ROUTER], skipped)) == [OURS]
    assert skipped == [Skip("", ROUTER, "the program no-such-program is not installed")]


@pytest.mark.parametrize(
    ("text", "version"),
    [
        ("mavlink-router version v4-8-g12ab", "4-8-g12ab"),
        ("mavlink-router version 4", "4"),
        ("MAVProxy is a modular ground station\nMAVProxy Version: 1.8.75", "1.8.75"),
        ("no such option", "unknown"),
    ],
)
def test_the_version_of_a_program_is_read_from_its_output(text: str, version: str) -> None:
    assert version_of(["echo", text]) == version


@pytest.mark.parametrize("rate", [4000, 40_000])  # one frame a system call, and several frames a call
def test_frames_are_sent_in_order_in_a_loop(receiver: socket.socket, rate: int) -> None:
    with receiver:
        frames = workload.frames(16)
        sender = Sender(frames, receiver.getsockname()[1])
        sent, _ = sender.run(rate, 40 / rate)
        sender.close()
        assert [receiver.recv(300) for _ in range(sent)] == (frames * 3)[:40]


def test_a_burst_is_sent_at_once_and_the_bursts_are_evenly_spaced(receiver: socket.socket) -> None:
    with receiver:
        sender = Sender(workload.frames(16), receiver.getsockname()[1])
        sent, took = sender.run(100, 0.16, 8)
        sender.close()
        assert sent == 16
        assert took >= 0.16  # the pause after the last burst too
        receiver.setblocking(False)
        assert len([receiver.recv(300) for _ in range(16)]) == 16


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


def test_wake_ups_and_peak_memory_are_read_from_the_kernel() -> None:
    code = "import time\nfor _ in range(5): time.sleep(0.001)\nx = b'x' * 60_000_000\ndel x\ntime.sleep(0.2)"
    with Child([sys.executable, "-c", code]) as child:
        assert 60 < child.peak_memory(20.0) < 120
    with Child([sys.executable, "-c", "input()"]) as child, pytest.raises(BenchError, match="EOF"):
        child.peak_memory(20.0)
    with Child([sys.executable, "-c", "import time\nwhile True: time.sleep(0.001)"]) as child:
        before = child.wake_ups()
        wait_until(lambda: child.wake_ups() > before + 20, SOON, "wake-ups")


def test_a_process_that_ends_at_once_is_an_error_with_its_output() -> None:
    with (
        Child([sys.executable, "-c", "raise SystemExit('no such thing')"]) as child,
        pytest.raises(BenchError) as raised,
    ):
        child.listens(free_port())
    assert "no such thing" in str(raised.value)
