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
WITHOUT_TEXTUAL = (
    sys.executable,
    "-c",
    "import sys; sys.modules['textual'] = None; from mav_robot_status.cli import main; sys.exit(main())",
)
HINT = "pip install 'mav-robot-status[watch]'"


@pytest.fixture
def watch(ended: contextlib.ExitStack) -> Callable[..., Screen]:
    """Start `watch` on a terminal."""
    return lambda *arguments, **options: ended.enter_context(
        contextlib.closing(Screen("watch", *(arguments or (ANYWHERE,)), **options))
    )


def address(screen: Screen) -> tuple[str, int]:
    """Where it listens; the screen is there."""
    screen.wait_for_text("No heartbeat of an autopilot yet")
    found = wait_until(lambda: re.search(rb"on 127\.0\.0\.1:(\d+)/udp", screen.raw), what="it listens nowhere")
    return "127.0.0.1", int(found[1])


def row(screen: Screen, name: str = "1.1") -> str:
    return next((line for line in screen.text if f" {name} " in line[16:24]), "")


# -- what is seen ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [COMMAND, WITHOUT_TEXTUAL], ids=["Textual", "plain"])
def test_a_terminal_that_does_not_know_its_size_is_used_as_one_of_80_by_24(
    watch: Callable[..., Screen], wire: Callable[..., Wire], command: tuple[str, ...]
) -> None:
    """Serial consoles, `docker exec -t` and some build machines report 0 x 0."""
    screen = watch(command=command, told=False)
    wire(to=address(screen)).beating()
    screen.wait_for(lambda lines: "▪ PARKED         1.1   Parked: it is disarmed." in row(screen), "a disarmed rover")
    screen.wait_for(lambda lines: lines[-1] != "", "the last line")
    screen.process.send_signal(signal.SIGINT)
    assert screen.process.wait(allow(SOON)) == 0


def test_arming_is_shown_within_a_second(watch: Callable[..., Screen], wire: Callable[..., Wire]) -> None:
    screen = watch()
    rover = wire(to=address(screen)).beating()
    screen.wait_for(lambda lines: "▪ PARKED         1.1   Parked: it is disarmed." in row(screen), "a disarmed rover")
    armed = rover.beat(armed=True)
    seen = screen.wait_for(lambda lines: "↯ ARMED          1.1 " in row(screen), "an armed rover")
    assert in_time(seen - armed, 1.0)
    # told by colour besides: a live robot does not look as calm as a parked one
    at = screen.text.index(row(screen))
    assert screen.cell(at, row(screen).index("ARMED")).fg != screen.cell(at, row(screen).index("MANUAL")).fg


def test_a_lost_robot_may_be_moving_and_nothing_of_it_is_known(
    watch: Callable[..., Screen], wire: Callable[..., Wire]
) -> None:
    screen = watch(columns=100)
    rover = wire(to=address(screen)).beating()
    screen.wait_for_text("1 robot ")
    rover.beating(on=False)
    screen.wait_for_text("lost vehicle 1.1: nothing for 3.5 s")
    screen.wait_for(lambda lines: "✗ LOST" in row(screen) and "Last heard " in row(screen), "a lost link")
    screen.wait_for_text("It may be moving.")
    screen.wait_for_text(": disarmed, MANUAL.")
    screen.wait_for_text("1 not heard")
    screen.wait_for_text("Why this is unknown:")
    assert not any("Why it cannot move" in line for line in screen.text)


def test_the_message_rates_of_a_live_robot_are_seen(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(columns=160, lines=40)
    autopilot(ardurover.READY, address(screen))
    screen.wait_for(lambda lines: re.search(r" [1-9]\d*/s", row(screen)), "a rate in the table")
    screen.wait_for(lambda lines: re.search(r"[1-9]\d*/s: .*HEARTBEAT [12]\.\d/s", " ".join(lines)), "each rate")


def test_keys_explain_and_show_the_changes(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(columns=100)
    rover = autopilot(ardurover.READY, address(screen))
    screen.wait_for_text("▪ PARKED  1.1  GROUND_ROVER")
    screen.type("e")
    screen.wait_for_text("disarmed [HEARTBEAT.base_mode")
    screen.type("t")
    screen.wait_for_text("-- changes --")
    rover.arm()
    screen.wait_for_text("drives_powered  ↯ POWERED")
    screen.type("?")
    screen.wait_for_text("select a robot")
    screen.type("\x1b")
    screen.wait_for_text("↯ ARMED  1.1  GROUND_ROVER")


def test_a_resized_terminal_is_redrawn(watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]) -> None:
    screen = watch()
    autopilot(arducopter.READY, address(screen))
    screen.wait_for_text("heard mode")
    for columns, lines, sign in ((150, 40, "flight mode"), (40, 10, "1 robot  ◆0 ■0 ✗0"), (80, 24, "heard mode")):
        screen.resize(columns, lines)
        screen.wait_for_text(sign)
        screen.wait_for(lambda text: "details" in text[-1], "the keys in the last line")


def codes(screen: Screen) -> set[int]:
    """The codes of looks that were written to the terminal."""
    return {int(code) for found in re.findall(rb"\x1b\[([\d;]+)m", screen.raw) for code in found.split(b";")}


@pytest.mark.parametrize("command", [COMMAND, WITHOUT_TEXTUAL], ids=["Textual", "plain"])
def test_without_colours_nothing_is_coloured(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot], command: tuple[str, ...]
) -> None:
    screen = watch(NO_COLOR="1", command=command)
    autopilot(arducopter.RC_ESTOP, address(screen), speed=2.0)
    screen.wait_for_text("↯ ARMED")
    assert codes(screen) <= {0, 1, 2, 3, 4, 7, 39, 49}


def test_without_the_extra_a_plain_table_says_how_to_install_it(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(command=WITHOUT_TEXTUAL)
    autopilot(arducopter.RC_ESTOP, address(screen), speed=2.0)
    screen.wait_for_text("■ EMERGENCY STOP")
    screen.wait_for(lambda lines: re.search(r"messages +[1-9]\d*/s: ", " ".join(lines)), "rates")
    assert screen.text[-1].endswith(HINT)
    assert screen.text[-1].startswith(sys.executable[:20])  # it can be copied as it is
    assert all(len(line) <= 80 for line in screen.text)
    assert {31, 41} & codes(screen)
    screen.type("\x03")
    assert screen.wait_for_end() == 0
    assert screen.attributes() == screen.before
    assert b"\x1b[?" not in screen.raw  # nothing to restore


def test_without_utf8_the_plain_table_is_ascii(
    watch: Callable[..., Screen], autopilot: Callable[..., FakeAutopilot]
) -> None:
    screen = watch(LC_ALL="C")
    autopilot(arducopter.READY, address(screen))
    screen.wait_for_text("P PARKED         1.1 ")
    assert screen.raw.isascii()
    screen.process.terminate()
    assert screen.wait_for_end() == 0


# -- the terminal after the end ----------------------------------------------------------------------------------------


def ends(screen: Screen) -> bytes:
    """Check the exit code 0 and the restored terminal; return the last output."""
    assert screen.wait_for_end() == 0
    assert screen.attributes() == screen.before
    assert b"\x1b[?25h" in screen.raw
    assert screen.raw.count(b"\x1b[?1049l") == 1
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


@pytest.mark.parametrize("command", [COMMAND, WITHOUT_TEXTUAL], ids=["Textual", "plain"])
def test_a_signal_ends_it_on_a_terminal_that_takes_no_output(
    watch: Callable[..., Screen], wire: Callable[..., Wire], command: tuple[str, ...]
) -> None:
    screen = watch(command=command)
    rover = wire(to=address(screen)).beating()
    screen.wait_for_text("1.1 ")
    screen.stop_reading()
    for armed in [True, False] * 10:  # each change is drawn, until the terminal is full
        rover.beat(armed=armed)
        screen.type("??")
        time.sleep(0.3)  # a few drawings
    screen.process.terminate()
    assert screen.process.wait(allow(SOON)) == 0
    assert screen.attributes() == screen.before


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
        lines = [process.stdout.readline() for _ in range(2)]
        assert re.match(r"time +state +robot +heard +mode +power +e-stop", lines[0])
        start = r"20\d\d-\d\d-\d\dT[\d:.]{10}Z ▪ PARKED +1\.1 +0s +☺ MANUAL ○ off  \? unk"
        assert re.match(start, lines[1])
        rover.arm()
        assert any("↯ ARMED" in line for line in process.stdout)
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
    screen.wait_for_text("▪ PARKED         1.1")
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


@pytest.mark.slow
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
    tmux.wait_for(r"^\S PARKED +1\.1 ")
    rover.arm()
    tmux.wait_for(r"^\S ARMED +1\.1 ")
    tmux.resize(150, 30)
    tmux.wait_for("flight mode")
    tmux.type("C-z")
    tmux.wait_for(r"Stopped .* watch ")
    assert "flight mode" not in tmux.text()
    tmux.type("fg", "Enter")
    tmux.wait_for("flight mode")
    tmux.type("q")
    tmux.wait_for(r"^ready\$ *$")
    assert "flight mode" not in tmux.text()
    tmux.type(f"stty -g > {tmp_path}/after; echo left with $?", "Enter")
    tmux.wait_for("^left with 0")
    assert (tmp_path / "after").read_text() == (tmp_path / "before").read_text()
