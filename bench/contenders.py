"""The measured programs: how each starts, and why one is missing."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from .process import ROOT, Child
from .results import OURS, PYMAVLINK, Skip

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PEERS: Final = ROOT / "bench" / "peers"
MAVPROXY, MAVSDK, ROUTER = "MAVProxy", "MAVSDK", "mavlink-routerd"
COALESCING: Final = "ours, coalesce: 10 ms"
LOOP: Final = "Python loop"
"""A loop over `recv` with our parser."""
ANY: Final = "pymavlink, any type"
"""The loop over `recv_match`, without `type=`."""
PROGRAMS: Final = {MAVPROXY: "mavproxy.py", ROUTER: "mavlink-routerd"}


class Missing(Exception):  # noqa: N818  # a fact, not an error
    """A program is missing; the text says why."""


class Contenders:
    """The programs on this machine. `paths`: the paths of programs that are not on the PATH."""

    def __init__(self, place: Path, paths: dict[str, str]) -> None:
        self._place = place
        self._void = socket.socket(
            socket.AF_INET, socket.SOCK_DGRAM
        )  # a target for programs that must forward; nothing reads it
        self._void.bind(("127.0.0.1", 0))
        self._paths = paths
        self._has_mavsdk = False
        self._options = subprocess.run(
            [*self.ours(), "run", "--help"], capture_output=True, text=True, check=True, cwd=ROOT
        ).stdout

    def close(self) -> None:
        """Close the socket."""
        self._void.close()

    @staticmethod
    def ours(*arguments: str) -> list[str]:
        """The installed command."""
        found = _which("mav-robot-status")
        return [*([found] if found else [sys.executable, "-m", "mav_robot_status.cli"]), *arguments]

    def has_option(self, option: str) -> bool:
        """Whether our command has this option."""
        return f"{option} " in self._options or f"{option}]" in self._options

    def start_ours(self, port: int, *arguments: str, pipe: bool = False) -> Child:
        """Our command, listening."""
        return Child(self.ours(f"udpin:127.0.0.1:{port}", *arguments), pipe=pipe)

    def start_pymavlink(self, port: int, *arguments: str, pipe: bool = False) -> Child:
        """A loop over `recv_match` that prints JSON lines."""
        return _peer("pymavlink_status.py", port, *arguments, pipe=pipe)

    def start_loop(self, port: int, *, pipe: bool = False) -> Child:
        """A loop over `recv` with our parser that prints JSON lines."""
        return _peer("python_loop.py", port, pipe=pipe)

    def start(self, who: str, port: int) -> Child:
        """A program that reads UDP, with its default options. Raises Missing."""
        if who == OURS:
            return self.start_ours(port)
        if who == COALESCING:
            config = self._place / "coalesce.yaml"
            config.write_text("coalesce: 10 ms\n")
            return self.start_ours(port, "--config", str(config))
        if who == LOOP:
            return self.start_loop(port)
        if who in (PYMAVLINK, ANY):
            return self.start_pymavlink(port, "10", *(("any",) if who == ANY else ()))
        if who == MAVSDK:
            return Child([self._mavsdk(), str(PEERS / "mavsdk_status.py"), str(port)])
        return self.start_forwarding(who, port, int(self._void.getsockname()[1]))

    def start_forwarding(self, who: str, port: int, out: int) -> Child:
        """A program that forwards from one UDP port to another. Raises Missing."""
        if who == OURS:
            if not self.has_option("--forward"):
                raise Missing("this version lacks the option --forward")
            return self.start_ours(port, "--forward", "--out", f"udpout:127.0.0.1:{out}", "--json", "none")
        if who == PYMAVLINK:
            return Child([sys.executable, str(PEERS / "pymavlink_forward.py"), str(port), str(out)])
        program = self.path(who)
        if who == ROUTER:
            return Child([program, "-t", "0", "-e", f"127.0.0.1:{out}", f"127.0.0.1:{port}"])
        state = self._place / "mavproxy"
        state.mkdir(exist_ok=True)
        return Child(
            [program, f"--master=udpin:127.0.0.1:{port}", f"--out=udpout:127.0.0.1:{out}", "--daemon",
             f"--state-basedir={state}"],
            env={**os.environ, "HOME": str(state)},
        )  # fmt: skip

    def path(self, who: str) -> str:
        """The path of a program. Raises Missing."""
        program = PROGRAMS[who]
        wanted = self._paths.get(who, program)
        found = _which(wanted)
        if not found:
            raise Missing(f"the program {wanted} is not installed")
        return found

    def _mavsdk(self) -> str:
        python = self._paths.get(MAVSDK, sys.executable)
        if not self._has_mavsdk:
            self._has_mavsdk = not _quiet([python, "-c", "import mavsdk"])
        if not self._has_mavsdk:
            raise Missing(f"the package mavsdk is not installed for {python}")
        return python

    def each(self, who: Sequence[str], skipped: list[Skip]) -> Iterator[str]:
        """The programs that are installed; the others are recorded as skipped."""
        for name in who:
            try:
                if name in PROGRAMS:
                    self.path(name)
                elif name == MAVSDK:
                    self._mavsdk()
            except Missing as missing:
                skipped.append(Skip("", name, str(missing)))
            else:
                yield name

    def versions(self) -> dict[str, str]:
        """The versions of the programs outside this Python."""
        found: dict[str, str] = {}
        for name in (MAVPROXY, ROUTER):
            try:
                found[name] = version_of([self.path(name), "--version"])
            except Missing:
                found[name] = "not installed"
        try:
            code = "from importlib.metadata import version as v; print(v('mavsdk'))"
            found[MAVSDK] = version_of([self._mavsdk(), "-c", code])
        except Missing:
            found[MAVSDK] = "not installed"
        return found


def _peer(name: str, *arguments: object, pipe: bool) -> Child:
    """A program of `bench/peers`."""
    return Child([sys.executable, str(PEERS / name), *map(str, arguments)], pipe=pipe)


def _quiet(command: list[str]) -> int:
    """The exit code of a program."""
    return subprocess.run(command, capture_output=True, check=False, cwd=ROOT).returncode


def _which(program: str) -> str | None:
    """The path of a program in the environment of this Python, or on the PATH."""
    return shutil.which(program, path=os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", ""))))


def version_of(command: list[str]) -> str:
    """The first version number in the output of a program, such as 1.8.75, or v4-8 of mavlink-routerd."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, cwd=ROOT)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"unknown ({error})"
    found = re.search(r"\bv?(\d+\.\d[\w.-]*)|\bv(\d[\w.-]*)|version (\d[\w.-]*)", done.stdout + done.stderr)
    return found[found.lastindex or 0] if found else "unknown"
