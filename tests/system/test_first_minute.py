"""The first minute at the command line: forms, hints and order, with the installed command."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from mav_robot_status.version import __version__

from .gateway_process import Gateway, run
from .wire import Wire


def taken(kind: socket.SocketKind, ended: contextlib.ExitStack) -> int:
    """A port of this computer that this process has."""
    other = ended.enter_context(socket.socket(socket.AF_INET, kind))
    other.bind(("127.0.0.1", 0))
    if kind is socket.SOCK_STREAM:
        other.listen()
    return int(other.getsockname()[1])


@pytest.mark.parametrize("connection", [":0", "udpserver://127.0.0.1:0"])
def test_a_port_alone_and_the_forms_of_blueos_listen(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], connection: str
) -> None:
    gate = gateway(connection)
    wire(gate.address).beat()
    gate.wait_for(lambda s: s["system"] == 1)


def test_udpclient_speaks_first(gateway: Callable[..., Gateway], ended: contextlib.ExitStack) -> None:
    there = ended.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    there.bind(("127.0.0.1", 0))
    there.settimeout(20)
    gateway(f"udpclient:127.0.0.1:{there.getsockname()[1]}")
    assert there.recv(300)[0] in (0xFD, 0xFE)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["mqtt://broker"], "'mqtt://broker' is an MQTT broker, which is an output; write --mqtt mqtt://broker"),
        (
            ["upd:14550"],
            "'upd:14550': unknown connection type upd:; did you mean udp: ? For a host write udpout:upd:14550",
        ),
        (
            ["/dev/ttyUSB0:115200:7E1"],
            "'/dev/ttyUSB0:115200:7E1': the frame format is 8N1, as MAVLink has it, not 7E1; write /dev/ttyUSB0:115200",
        ),
        (
            ["udp:14550", "--out", "udpin:127.0.0.1:14550"],
            "udp port 14550 is given twice, as udp:14550 and as udpin:127.0.0.1:14550; leave one out, or write another",
        ),
        (["udp:14550", "--name", "1=a", "--name", "1=b"], "--name 1= is given twice: one vehicle has one name"),
    ],
)
def test_a_wrong_argument_is_one_line_that_says_what_to_write(arguments: list[str], line: str) -> None:
    done = run(*arguments)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"mav-robot-status: {line}\n")


@pytest.mark.parametrize("output", ["http", "simple_message", "json", "record", "out"])
def test_an_output_that_fails_does_so_before_the_vehicle_link_is_touched(
    output: str, tmp_path: Path, ended: contextlib.ExitStack
) -> None:
    vehicle = ended.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    vehicle.bind(("127.0.0.1", 0))
    tcp, udp = taken(socket.SOCK_STREAM, ended), taken(socket.SOCK_DGRAM, ended)
    option = {
        "http": ("--http", f"127.0.0.1:{tcp}"),
        "simple_message": ("--simple-message", f"127.0.0.1:{tcp}"),
        "json": ("--json", str(tmp_path / "no" / "lines")),
        "record": ("--record", str(tmp_path / "no" / "flight.tlog")),
        "out": ("--out", f"udpin:127.0.0.1:{udp}"),
    }[output]
    done = run(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}", *option)
    assert done.returncode in (1, 2)
    assert len(done.stderr.splitlines()) == 1
    assert "sending to" not in done.stderr
    vehicle.setblocking(False)
    with pytest.raises(BlockingIOError):
        vehicle.recv(300)


def test_silence_and_the_help_name_the_doctor(gateway: Callable[..., Gateway]) -> None:
    gate = gateway("udp:127.0.0.1:0")
    gate.wait_for_log(r"no autopilot heard yet, .*: mav-robot-status doctor udp:127\.0\.0\.1:0$")
    assert "doctor CONNECTION" in run("--help").stdout


def test_a_mode_is_overridden_by_its_name(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], tmp_path: Path
) -> None:
    config = tmp_path / "modes.yaml"
    config.write_text("hardware: {mode_overrides: {rover: {GUIDED: MANUAL}}}")
    gate = gateway("udp:127.0.0.1:0", "--config", str(config))
    wire(gate.address).beat(custom_mode=15)
    line = gate.wait_for(lambda s: s["system"] == 1)
    assert (line.status["mode"], line.status["vehicle"]["flight_mode"]) == ("MANUAL", "GUIDED")


def test_the_short_option_for_the_version() -> None:
    assert run("-V").stdout == run("--version").stdout == f"mav-robot-status {__version__}\n"
