"""`watch` on a terminal: what it shows, and the state in which it leaves the terminal."""

from __future__ import annotations

import contextlib
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from mav_robot_status.testing import FakeAutopilot, arducopter, ardurover

from ..deadline import SOON, allow, in_time, wait_until
from .gateway_process import COMMAND, run
from .screen import PLAIN_ENVIRONMENT, Screen
from .wire import Wire

ANYWHERE = "udp:127.0.0.1:0"
TABLE, DETAILS = "id  flight mode", " handle "


@pytest.fixture
def watch(ended: contextlib.ExitStack) -> Callable[..., Screen]:
    """Start `watch` on a terminal."""
    return lambda *arguments, **options: ended.enter_context(
        contextlib.closing(Screen("watch", *(arguments or (ANYWHERE,)), **options))
    )


def address(screen: Screen) -> tuple[str, int]:
    """Where it listens; the screen is there."""
    screen.wait_for_text("No heartbeat of an autopilot yet")
    found = re.search(rb"listening on 127\.0\.0\.1:(\d+)/udp", screen.raw)
    assert found is not None
    return "127.0.0.1", int(found[1])


def row(screen: Screen, name: str = "1.1") -> str:
    return next((line for line in screen.text if line[1:].startswith(f"{name} ")), "")


# -- what is seen ------------------------------------------------------------------------------------------------------


def test_arming_is_shown_within_a_second(watch: Callable[..., Screen], wire: Callable[..., Wire]) -> None:
    screen = watch()
    rover = wire(to=address(screen)).beating()
    screen.wait_for(lambda lines: "MANUAL ? unk  ○ no  ○ no" in row(screen), "a disarmed rover")
    armed = rover.beat(armed=True)
    seen = screen.wait_for(lambda lines: "MANUAL ? unk  ● YES" in row(screen), "an armed rover")
    assert in_time(seen - armed, 1.0)
    # told by colour besides: YES is not what unknown is
    at = screen.text.index(row(screen))
    assert screen.cell(at, row(screen).index("YES")).fg != screen.cell(at, row(screen).index("unk")).fg


def test_a_lost_link_is_shown_in_the_table_and_in_the_list_of_changes(
    watch: Callable[..., Screen], wire: Callable[..., Wire]
) -> None:
    screen = watch()
    rover = wire(to=address(screen)).beating()
    screen.wait_for_text("1 vehicle")
    rover.beating(on=False)
    screen.wait_for(lambda lines: "✗" in row(screen) and "LINK_STALE" in row(screen), "a lost link")
    screen.wait_for_text("lost vehicle 1.1: no heartbeat for 3.5 s")
    assert "1 lost" in screen.text[0]
    assert screen.text[-1].startswith(" e explain")


def test_the_message_rates_of_a_live_vehicle_are_seen(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(columns=160, lines=40)
    autopilot(ardurover.READY, address(screen))
    screen.wait_for(lambda lines: re.search(r" [1-9]\d*/s", row(screen)), "a rate in the table")
    screen.wait_for(lambda lines: re.search(r"[1-9]\d* a second: .*HEARTBEAT [12]\.\d", " ".join(lines)), "each rate")


def test_keys_explain_and_show_the_changes(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch()
    rover = autopilot(ardurover.READY, address(screen))
    screen.wait_for_text(DETAILS)
    screen.type("e")
    screen.wait_for_text("drives_powered  ○ no")
    screen.wait_for_text("disarmed  [HEARTBEAT.base_mode")
    screen.type("t")
    screen.wait_for_text("drives_powered  ○ no")
    rover.arm()
    screen.wait_for_text("drives_powered  ● YES")
    screen.type("?")
    screen.wait_for_text("not a safety function")
    screen.type("\x1b")
    screen.wait_for_text(DETAILS)


def test_a_fleet_of_fifty_scrolls(watch: Callable[..., Screen], ended: contextlib.ExitStack) -> None:
    screen = watch()
    to = address(screen)
    for system in range(1, 51):
        ended.enter_context(contextlib.closing(Wire(to=to, system=system))).beat()
    screen.wait_for_text("50 vehicles")
    screen.wait_for(lambda lines: row(screen), "the first vehicle")
    screen.type("\x1b[F")  # End
    screen.wait_for(lambda lines: row(screen, "50.1").startswith("▶"), "the last vehicle")
    screen.type("kk")
    screen.wait_for(lambda lines: row(screen, "48.1").startswith("▶"), "the last but two")
    assert not row(screen, "1.1")


def test_a_resized_terminal_is_redrawn(watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]) -> None:
    screen = watch()
    autopilot(arducopter.READY, address(screen))
    screen.wait_for_text(DETAILS)
    for columns, lines, sign in ((120, 40, "motion_"), (40, 12, "mode stop powr"), (80, 24, TABLE)):
        screen.resize(columns, lines)
        screen.wait_for_text(sign)
        screen.wait_for(lambda text: text[-1].startswith(" e explain"), "the keys in the last line")


def test_without_colours_nothing_is_coloured(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(NO_COLOR="1")
    autopilot(arducopter.RC_ESTOP, address(screen), speed=10.0)
    screen.wait_for_text("● YES")
    codes = {int(code) for found in re.findall(rb"\x1b\[([\d;]+)m", screen.raw) for code in found.split(b";")}
    assert codes <= {0, 1, 2, 7}


def test_without_utf8_everything_is_ascii(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(LC_ALL="C")
    autopilot(arducopter.READY, address(screen))
    screen.wait_for_text("- no   - no")
    assert screen.raw.isascii()


# -- the terminal after the end ----------------------------------------------------------------------------------------


def ends(screen: Screen) -> bytes:
    """Check the exit code 0 and the restored terminal; return the last output."""
    assert screen.wait_for_end() == 0
    assert screen.attributes() == screen.before
    assert screen.raw.count(b"\x1b[?25h") == screen.raw.count(b"\x1b[?1049l") == 1
    assert b"Traceback" not in screen.raw
    return screen.raw.partition(b"\x1b[?1049l")[2]


@pytest.mark.parametrize("key", ["q", "\x03"])
def test_a_key_ends_it_and_restores_the_terminal(watch: Callable[..., Screen], key: str) -> None:
    screen = watch()
    address(screen)
    assert screen.attributes() != screen.before
    screen.type(key)
    assert b"0 frames" in ends(screen)  # the last lines of the log are on the terminal again


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_and_restores_the_terminal(watch: Callable[..., Screen], number: signal.Signals) -> None:
    screen = watch()
    address(screen)
    screen.process.send_signal(number)
    ends(screen)


def test_a_signal_ends_it_on_a_stopped_terminal(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch()
    autopilot(ardurover.READY, address(screen))
    screen.wait_for_text(DETAILS)
    screen.type("\x13")  # Ctrl-S
    time.sleep(allow(0.5))  # the next drawing of the screen blocks
    screen.process.terminate()
    assert screen.process.wait(allow(SOON)) == 0
    assert screen.attributes() == screen.before


def test_an_exception_restores_the_terminal(ended: contextlib.ExitStack) -> None:
    program = (
        "from mav_robot_status.views.terminal.tty import Screen\n"
        "with Screen() as screen:\n"
        "    screen.show([b'here'])\n"
        "    raise RuntimeError('broken')\n"
    )
    screen = ended.enter_context(contextlib.closing(Screen(command=(sys.executable, "-c", program))))
    assert screen.wait_for_end() == 1
    assert screen.attributes() == screen.before
    assert screen.raw.index(b"here") < screen.raw.index(b"\x1b[?1049l") < screen.raw.index(b"RuntimeError")


# -- without a screen ------------------------------------------------------------------------------------------


@contextlib.contextmanager
def piped(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [*COMMAND, "watch", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**PLAIN_ENVIRONMENT, "LC_ALL": "C.UTF-8"},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_in_a_pipe_each_change_is_a_line(autopilot: Callable[..., FakeAutopilot]) -> None:
    with piped(ANYWHERE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        port = re.search(r":(\d+)/udp", process.stderr.readline())
        assert port is not None
        rover = autopilot(ardurover.READY, ("127.0.0.1", int(port[1])))
        lines = [process.stdout.readline() for _ in range(3)]
        assert lines[1].startswith("time                   vehicle flight mode  mode   e-stop")
        assert re.match(r"20\d\d-\d\d-\d\dT[\d:.]{10}Z 1\.1     MANUAL       MANUAL \? unk  ○ no  ○ no", lines[2])
        rover.arm()
        for line in process.stdout:
            if "MANUAL ? unk  ● YES ● YES" in line:
                break
        process.terminate()
        rest, log = process.communicate(timeout=allow(SOON))
        assert process.returncode == 0
        assert "\x1b" not in rest + log


def test_a_dumb_terminal_gets_lines(watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]) -> None:
    screen = watch(TERM="dumb", columns=140)
    screen.wait_for_text("listening on")
    found = re.search(rb":(\d+)/udp", screen.raw)
    assert found is not None
    autopilot(ardurover.READY, ("127.0.0.1", int(found[1])))
    screen.wait_for_text("1.1     MANUAL       MANUAL")
    assert b"\x1b" not in screen.raw
    screen.process.terminate()
    assert screen.wait_for_end() == 0


def test_a_closed_reader_ends_it() -> None:
    with piped(ANYWHERE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stderr.readline()
        process.stdout.close()
        assert process.wait(allow(SOON)) == 0


def test_a_recorded_log_cannot_be_watched(demo_log: Path) -> None:
    done = run("watch", str(demo_log))
    assert done.returncode == 2
    assert done.stderr == (
        f"mav-robot-status: {demo_log} is a recorded log; see it as a picture: mav-robot-status report {demo_log}\n"
    )


def test_a_taken_port_is_one_line(wire: Callable[..., Wire]) -> None:
    port = wire().address[1]
    done = run("watch", f"udp:127.0.0.1:{port}")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert str(port) in done.stderr


# -- tmux --------------------------------------------------------------------------------------------------------------


class Tmux:
    """A shell in a tmux of our own."""

    def __init__(self, folder: Path) -> None:
        self._tmux = ["tmux", "-f", "/dev/null", "-S", str(folder / "tmux")]
        environment = {**PLAIN_ENVIRONMENT, "LC_ALL": "C.UTF-8"}
        shell = "bash --norc --noprofile -i"
        subprocess.run([*self._tmux, "new-session", "-d", "-x", "80", "-y", "24", shell], check=True, env=environment)

    def text(self) -> str:
        return self._run("capture-pane", "-p")

    def type(self, *keys: str) -> None:
        self._run("send-keys", *keys)

    def resize(self, columns: int, lines: int) -> None:
        self._run("resize-window", "-x", str(columns), "-y", str(lines))

    def wait_for(self, pattern: str) -> re.Match[str]:
        return wait_until(lambda: re.search(pattern, self.text(), re.MULTILINE), what=f"no {pattern!r} in tmux")

    def close(self) -> None:
        self._run("kill-server")

    def _run(self, *arguments: str) -> str:
        return subprocess.run([*self._tmux, *arguments], check=True, capture_output=True, text=True).stdout


@pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed: apt-get install tmux")
def test_in_tmux_it_can_be_resized_suspended_and_ended(
    tmp_path: Path, ended: contextlib.ExitStack, autopilot: Callable[..., FakeAutopilot]
) -> None:
    tmux = ended.enter_context(contextlib.closing(Tmux(tmp_path)))
    tmux.type("PS1='ready$ '; clear", "Enter")
    tmux.wait_for(r"^ready\$ *$")
    tmux.type(f"stty -g > {tmp_path}/before; {' '.join(COMMAND)} watch {ANYWHERE} 2> {tmp_path}/log", "Enter")
    tmux.wait_for("No heartbeat of an autopilot yet")
    port = re.search(r":(\d+)/udp", (tmp_path / "log").read_text())
    assert port is not None
    rover = autopilot(ardurover.READY, ("127.0.0.1", int(port[1])))
    tmux.wait_for(r"^▶1\.1 MANUAL       MANUAL \S+ +\S+ +○ no  ○ no ")
    rover.arm()
    tmux.wait_for(r"^▶1\.1 MANUAL       MANUAL \S+ +\S+ +● YES ● YES ")
    tmux.resize(120, 30)
    tmux.wait_for("motion_  in_")
    tmux.type("C-z")
    tmux.wait_for(r"Stopped .* watch ")
    assert "motion_" not in tmux.text()
    tmux.type("fg", "Enter")
    tmux.wait_for("motion_  in_")
    tmux.type("q")
    tmux.wait_for(r"^ready\$ *$")
    assert "motion_" not in tmux.text()
    tmux.type(f"stty -g > {tmp_path}/after; echo left with $?", "Enter")
    tmux.wait_for("^left with 0")
    assert (tmp_path / "after").read_text() == (tmp_path / "before").read_text()
