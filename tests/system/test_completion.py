"""The completion of the command line, in the shells themselves."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from mav_robot_status.commands import COMMANDS

from ..deadline import allow
from .gateway_process import run

ASK = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
"$(complete -p mav-robot-status | sed 's/.*-F \\([^ ]*\\).*/\\1/')"
printf '%s\\n' "${COMPREPLY[@]}"
"""
"""What readline does: it finds the function of the command, and calls it with the words of the line."""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The script for bash."""
    path = tmp_path_factory.mktemp("completion") / "mav-robot-status"
    done = run("completion", "bash")
    assert (done.returncode, done.stderr) == (0, "")
    path.write_text(done.stdout)
    return path


@pytest.mark.parametrize(
    ("line", "answers"),
    [
        ("do", ["doctor"]),
        ("", [*COMMANDS, "--help", "--version"]),
        ("fli", ["flight one.tlog"]),
        ("explain fli", ["flight one.tlog"]),
        ("udp:14550 --forw", ["--forward"]),
        ("udp:14550 --format ", ["native", "ros1", "ros2"]),
        ("udp:14550 --config fli", ["flight one.tlog"]),
        ("udp:14550 --name ", [""]),
        ("doctor --seco", ["--seconds"]),
        ("completion z", ["zsh"]),
        ("px4-events ", ["fetch"]),
        ("px4-events fetch --outp", ["--output"]),
    ],
)
def test_bash_completes_commands_options_values_and_files(
    script: Path, tmp_path: Path, line: str, answers: list[str]
) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("needs bash: apt-get install bash")
    (tmp_path / "flight one.tlog").touch()
    command = [bash, "--norc", "-c", ASK, "bash", str(script), "mav-robot-status", *line.split(" ")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=allow(30), check=False, cwd=tmp_path)
    assert (done.stdout.split("\n")[:-1], done.stderr) == (answers, "")


@pytest.mark.parametrize(("shell", "check"), [("zsh", "-n"), ("fish", "--no-execute")])
def test_the_script_for_another_shell_is_valid(shell: str, check: str, tmp_path: Path) -> None:
    done = run("completion", shell)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(name in done.stdout for name in COMMANDS)
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}: apt-get install {shell}")
    path = tmp_path / "script"
    path.write_text(done.stdout)
    subprocess.run([shell, check, str(path)], timeout=allow(30), check=True)


def test_an_unknown_shell_is_one_line() -> None:
    done = run("completion", "tcsh")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
