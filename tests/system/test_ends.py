"""How the installed command ends: exit codes, signals, readers that go away or do not read."""

from __future__ import annotations

import array
import fcntl
import os
import signal
import socket
import subprocess
import termios
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import mav_robot_status

from ..deadline import SOON, allow, in_time, wait_until
from ..ports import free_port
from .gateway_process import COMMAND, Gateway, run
from .wire import Wire


def test_sigterm_and_sigint_exit_with_0(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    for number in (signal.SIGTERM, signal.SIGINT):
        gate = gateway("udpin:127.0.0.1:0")
        wire(gate.address).beat()
        gate.wait_for(lambda s: True)
        assert gate.stop(number) == 0
        assert not any("Traceback" in line for line in gate.log)


def test_a_closed_reader_exits_with_0(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    gate = gateway("udpin:127.0.0.1:0", reads=False)
    wire(gate.address).beat()
    assert gate.process.stdout is not None
    assert gate.process.stdout.readline().startswith(b'{"stamp"')
    gate.process.stdout.close()
    assert gate.wait_for_end() == 0
    assert not any("Traceback" in line or "Exception" in line for line in gate.log)


def test_a_closed_reader_is_noticed_without_a_write(gateway: Callable[..., Gateway]) -> None:
    gate = gateway("udpin:127.0.0.1:0", reads=False)
    assert gate.port
    assert gate.process.stdout is not None
    gate.process.stdout.close()
    assert gate.wait_for_end() == 0


def waiting_in(pipe: int) -> int:
    """The bytes in a pipe."""
    count = array.array("i", [0])
    fcntl.ioctl(pipe, termios.FIONREAD, count)
    return count[0]


def is_full(pipe: int) -> bool:
    """Whether nothing more fits into a pipe of 65536 bytes, some of them lost at the ends of pages."""
    before = waiting_in(pipe)
    time.sleep(allow(0.1))  # a hundred lines
    return 50_000 < before == waiting_in(pipe)


def test_a_reader_that_never_reads_stops_neither_mavlink_nor_the_end(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--rate", "1000", reads=False)
    rover = wire(gate.address)
    rover.beat()
    rover.wait_for("ROBOT_STATUS")
    assert gate.process.stdout is not None
    pipe = gate.process.stdout.fileno()
    wait_until(lambda: is_full(pipe))
    before = gate.memory()
    sent = rover.beat(armed=True)
    assert in_time(rover.wait_for("ROBOT_STATUS", lambda m: m.drives_powered == 1).at - sent, 1.0)
    rover.wait_for("HEARTBEAT", after=sent, count=2)
    assert gate.memory() - before < 2.0
    assert gate.stop() == 0
    assert any("an output was busy" in line for line in gate.log)


@pytest.mark.parametrize("missing", [">&-", "2>&-", ">&- 2>&- <&-"])
def test_streams_that_are_closed_at_the_start_do_no_harm(wire: Callable[..., Wire], missing: str) -> None:
    port = free_port()
    process = subprocess.Popen(
        ["/bin/sh", "-c", f'exec "$@" {missing}', "sh", *COMMAND, f"udp:127.0.0.1:{port}"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    rover = wire(("127.0.0.1", port)).beating()
    rover.wait_for("ROBOT_STATUS")
    process.send_signal(signal.SIGTERM)
    _, log = process.communicate(timeout=allow(SOON))
    assert process.returncode == 0
    assert b"Traceback" not in log


def test_standard_error_without_a_reader_does_no_harm(wire: Callable[..., Wire]) -> None:
    read, write = os.pipe()
    os.close(read)
    port = free_port()
    with subprocess.Popen([*COMMAND, f"udp:127.0.0.1:{port}"], stdout=subprocess.PIPE, stderr=write) as process:
        os.close(write)
        wire(("127.0.0.1", port)).beating().wait_for("ROBOT_STATUS")
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=allow(SOON))
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "no connection given"),
        (("udp:127.0.0.1:14550", "--frobnicate"), "unrecognized arguments: --frobnicate"),
        (("udp:127.0.0.1:14550", "--rate", "nan"), "'nan' is not a rate"),
        (("udp:127.0.0.1:14550", "--rate", "quick"), "'quick' is not a rate"),
        (("udp:127.0.0.1:14550", "--system", "256"), "'256' is not a system id"),
        (("udp:127.0.0.1:14550", "--baud", "x"), "'x' is not a baud rate"),
        (("missing.tlog",), "cannot read the log 'missing.tlog'"),
        (("udpp:127.0.0.1:14550",), "did you mean udp"),
        (("udp:127.0.0.1:0", "--out", "x.tlog"), "an out needs a receiver"),
        (("--config", "missing.yaml"), "missing.yaml: cannot read the configuration"),
    ],
)
def test_a_usage_error_is_one_line_and_exit_code_2(arguments: tuple[str, ...], says: str, tmp_path: Path) -> None:
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("links:\n  - udp:127.0.0.1:0\nrequest: none\n", "3:1: "),
        ("links: [udp:127.0.0.1:0]\nx: {type: mav_robot_status/Nothing}\n", "2:1: "),
        (
            "links: [udp:127.0.0.1:0]\nc:\n  type: mav_robot_status/IndustrialRobotStatusController\n"
            "  handle_name: rover\n",
            "2:1: ",
        ),
    ],
)
def test_an_invalid_configuration_is_one_line_with_its_place_and_exit_code_2(
    text: str, place: str, tmp_path: Path
) -> None:
    config = tmp_path / "faulty.yaml"
    config.write_text(text)
    for arguments in (("--config", str(config)), ("check-config", str(config))):
        done = run(*arguments)
        assert done.returncode == 2
        assert done.stderr.splitlines()[-1].startswith(f"mav-robot-status: {config}:{place}")
        assert "Traceback" not in done.stderr


def test_a_taken_port_is_one_line_with_the_port_and_exit_code_1() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        done = run(f"udp:127.0.0.1:{port}")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert str(port) in done.stderr
    assert "taken" in done.stderr


def test_an_output_that_cannot_be_opened_is_an_error_at_the_start() -> None:
    done = run("udp:127.0.0.1:0", "--json", "/nowhere/at/all.jsonl")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "mav-robot-status: cannot write JSON lines to /nowhere/at/all.jsonl: No such file or directory"
    )


def test_version_and_help() -> None:
    assert run("--version").stdout == f"mav-robot-status {mav_robot_status.__version__}\n"
    help_text = run("--help")
    assert help_text.returncode == 0
    assert "safety function" in help_text.stdout


def test_quiet_logs_only_warnings_and_verbose_logs_no_less_than_usual(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    port = free_port()
    quiet, verbose = gateway(f"udp:127.0.0.1:{port}", "-q"), gateway("udp:127.0.0.1:0", "-v")
    wire(("127.0.0.1", port)).beating()
    wire(verbose.address).beating()
    for gate in (quiet, verbose):
        gate.wait_for(lambda s: True)
        assert gate.stop() == 0
    assert quiet.log == []
    assert any("heard vehicle 1.1" in line for line in verbose.log)
