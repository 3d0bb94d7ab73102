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
    from collections.abc import Iterator

PEERS: Final = ROOT / "bench" / "peers"
MAVPROXY, MAVSDK, ROUTER = "MAVProxy", "MAVSDK", "mavlink-routerd"
COALESCING: Final = "ours, coalesce: 10 ms"
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
        return Child([sys.executable, str(PEERS / "pymavlink_status.py"), str(port), *arguments], pipe=pipe)

    def start(self, who: str, port: int) -> Child:
        """A program that reads UDP, with its default options. Raises Missing."""
        if who == OURS:
            return self.start_ours(port)
        if who == COALESCING:
            config = self._place / "coalesce.yaml"
            config.write_text("coalesce: 10 ms\n")
            return self.start_ours(port, "--config", str(config))
        if who == PYMAVLINK:
            return self.start_pymavlink(port)
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
        if subprocess.run([python, "-c", "import mavsdk"], capture_output=True, check=False).returncode:
            raise Missing(f"the package mavsdk is not installed for {python}")
        return python

    def each(self, who: tuple[str, ...], skipped: list[Skip]) -> Iterator[str]:
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
                found[name] = _version([self.path(name), "--version"])
            except Missing:
                found[name] = "not installed"
        try:
            code = "from importlib.metadata import version as v; print(v('mavsdk'))"
            found[MAVSDK] = _version([self._mavsdk(), "-c", code])
        except Missing:
            found[MAVSDK] = "not installed"
        return found


def _which(program: str) -> str | None:
    """The path of a program in the environment of this Python, or on the PATH."""
    return shutil.which(program, path=os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", ""))))


def _version(command: list[str]) -> str:
    """The first version number in the output of a program."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, cwd=ROOT)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"unknown ({error})"
    found = re.search(r"\bv?(\d+\.\d[\w.-]*)", done.stdout + done.stderr)
    return found[1] if found else "unknown"
