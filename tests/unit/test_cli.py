from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from mav_robot_status import __version__
from mav_robot_status.cli import main
from mav_robot_status.commands import COMMANDS

LATER = {"yaml", "tornado", "paho", "textual", "serial", "pymavlink"}
"""Modules that a run imports only for an option that needs them."""
RARE = {
    "asyncio",
    "bz2",
    "difflib",
    "encodings.idna",
    "hashlib",
    "hmac",
    "importlib.metadata",
    "lzma",
    "pathlib",
    "ssl",
}
"""Modules of the standard library that are slow or large, and that a live gateway on UDP does not need."""


@pytest.fixture(autouse=True)
def sigterm() -> Iterator[None]:
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


def test_an_invalid_number_has_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["udp:127.0.0.1:0", "--rate", "x"]) == 2
    assert "'x' is not a rate" in capsys.readouterr().err


def test_a_misspelt_command_is_not_a_connection(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["docter", "udp:127.0.0.1:0"]) == 2
    assert capsys.readouterr().err == "mav-robot-status: there is no command 'docter'; did you mean 'doctor'?\n"


def test_a_missing_connection_is_one_line_and_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    err = capsys.readouterr().err
    assert err.startswith("mav-robot-status: no connection given")
    assert err.count("\n") == 1


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert (ended.value.code, capsys.readouterr().out) == (0, f"mav-robot-status {__version__}\n")


def test_the_help_has_a_line_for_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    assert [name for name in COMMANDS if any(line.split()[:1] == [name] for line in lines)] == list(COMMANDS)


def test_a_live_gateway_imports_nothing_that_few_need() -> None:
    script = (
        "import sys; from mav_robot_status.cli import main; from mav_robot_status.gateway.event_loop import EventLoop\n"
        "EventLoop.run = lambda self: None\n"
        "assert main(['udpin:127.0.0.1:0', '-q']) == 0; print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=True)
    modules = set(done.stdout.split())
    assert "mav_robot_status.links.udp" in modules
    assert not modules & (LATER | RARE)


def test_a_run_imports_no_other_command() -> None:
    script = (
        "import sys; from mav_robot_status.cli import main; "
        "assert main(['missing.tlog', '-q']) == 2; print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=True)
    modules = set(done.stdout.split())
    assert "mav_robot_status.gateway.replay" in modules
    assert not modules & LATER
    assert not any(name.startswith("mav_robot_status.views") for name in modules)
    assert {name for name in modules if name.startswith("mav_robot_status.publishers.web.")} == {
        "mav_robot_status.publishers.web.settings"
    }
    commands = {name.rpartition(".")[2] for name in modules if name.startswith("mav_robot_status.commands.")}
    assert commands == {"run", "arms", "options", "overrides"}
