"""The service: its unit, its messages to systemd, and how it reloads its configuration."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
import time
import urllib.request
from collections.abc import Callable, Iterator

import pytest

from tests.pymavlink_dialect import MAVLink_statustext_message

from ..deadline import SOON, allow, wait_until
from ..ports import free_port
from .gateway_process import Gateway, run
from .wire import Wire

ROOT = pathlib.Path(__file__).parents[2]
SYSTEMD = ROOT / "contrib" / "systemd"
UNIT = SYSTEMD / "mav-robot-status.service"
MOST_EXPOSED = 17
"""The exposure that systemd-analyze reports, times 10. Most services of a distribution have 90 of 100."""
INSTALLERS = f"{ROOT / 'build' / 'installers' / 'bin'}:{os.environ['PATH']}"
needs_systemd = pytest.mark.skipif(
    not shutil.which("systemd-analyze"), reason="systemd-analyze is not installed: apt-get install systemd"
)

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


# -- the unit --------------------------------------------------------------------------------------------------------


@pytest.fixture
def unit(tmp_path: pathlib.Path) -> pathlib.Path:
    """The unit, with a command that exists here."""
    command = pathlib.Path(sys.executable).with_name("mav-robot-status")
    path = tmp_path / UNIT.name
    path.write_text(UNIT.read_text().replace("/usr/local/bin/mav-robot-status", str(command)))
    return path


@needs_systemd
def test_systemd_accepts_every_line_of_the_unit(unit: pathlib.Path) -> None:
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, timeout=allow(30))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@needs_systemd
def test_the_service_is_well_confined(unit: pathlib.Path) -> None:
    command = ["systemd-analyze", "security", "--no-pager", "--offline=true", f"--threshold={MOST_EXPOSED}", str(unit)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=allow(30))
    assert done.returncode == 0, done.stdout[-200:]


def settings() -> list[tuple[str, str]]:
    lines = [line.split("=", 1) for line in UNIT.read_text().splitlines() if "=" in line and line[0] not in "#["]
    return [(name, value) for name, value in lines]


def test_the_unit_matches_the_program() -> None:
    found = dict(settings())
    assert found["Type"] == "notify"
    assert found["ExecStart"].endswith(" run --config /etc/mav-robot-status/config.yaml --json none")
    assert found["ExecReload"] == "/bin/kill -HUP $MAINPID"
    assert found["RestartPreventExitStatus"] == "2"
    assert (found["DynamicUser"], found["SupplementaryGroups"]) == ("yes", "dialout")
    assert (found["StateDirectory"], found["CacheDirectory"]) == ("mav-robot-status", "mav-robot-status")
    assert int(found["WatchdogSec"]) > 0


def test_the_configuration_of_the_service_is_valid() -> None:
    done = run("check-config", str(SYSTEMD / "config.yaml"))
    assert done.returncode == 0, done.stderr
    assert "14550" in done.stdout


# -- messages to systemd ---------------------------------------------------------------------------------------------


class Manager:
    """systemd's end of NOTIFY_SOCKET."""

    def __init__(self, path: pathlib.Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))

    def next(self, seconds: float | None = None) -> str | None:
        """The next message; None if there is none within `seconds`, or soon."""
        self.socket.settimeout(allow(SOON) if seconds is None else seconds)
        try:
            return self.socket.recv(4096).decode().splitlines()[0]
        except (TimeoutError, BlockingIOError):
            return None

    def wait_for(self, message: str) -> list[str | None]:
        """The messages up to this one, which is the last of them."""
        heard = [self.next()]
        while heard[-1] not in (message, None):
            heard.append(self.next())
        assert heard[-1] == message, heard
        return heard


@pytest.fixture
def manager(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Manager]:
    made = Manager(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    yield made
    made.socket.close()


def test_systemd_is_notified_of_the_start_a_reload_and_the_end(
    gateway: StartGateway, manager: Manager, tmp_path: pathlib.Path
) -> None:
    config = tmp_path / "config.yaml"
    config.write_text("links: ['udpin:127.0.0.1:0']\n")
    gate = gateway("--config", str(config), "--json", "none")
    assert manager.next() == "READY=1"
    assert gate.port, "ready means that the links are open"
    gate.process.send_signal(signal.SIGHUP)
    assert [manager.next(), manager.next()] == ["RELOADING=1", "READY=1"]
    assert gate.stop() == 0
    assert manager.next() == "STOPPING=1"


def test_with_an_invalid_configuration_the_service_never_becomes_ready(
    manager: Manager, tmp_path: pathlib.Path
) -> None:
    config = tmp_path / "config.yaml"
    config.write_text("link: []\n")
    assert run("--config", str(config)).returncode == 2
    assert manager.next(0.1) is None


def test_the_watchdog_is_fed_only_while_the_event_loop_runs(
    gateway: StartGateway, manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "400000")
    began = time.monotonic()
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    manager.wait_for("READY=1")
    for _ in range(10):
        assert manager.next() == "WATCHDOG=1"
    assert time.monotonic() - began > 1.0, "fed far too often"  # once in 0.2 s
    gate.process.send_signal(signal.SIGSTOP)
    wait_until(lambda: gate.state() == "T")
    while manager.next(0):
        pass  # sent before the stop
    assert manager.next(0.8) is None
    gate.process.send_signal(signal.SIGCONT)
    assert manager.next() == "WATCHDOG=1"


# -- SIGHUP ----------------------------------------------------------------------------------------------------------


class Service:
    """A gateway by a configuration that changes."""

    def __init__(self, start: StartGateway, path: pathlib.Path, text: str, *arguments: str) -> None:
        self.path = path
        self.write(text)
        self.gate = start("--config", str(path), *arguments)

    def write(self, text: str) -> None:
        self.path.write_text(textwrap.dedent(text))

    def reload(self, text: str, log: str = "the configuration was read again") -> float:
        """The instant of the signal. Its effect is in the log when this returns."""
        self.write(text)
        before = len(self.gate.log)
        sent = time.monotonic()
        self.gate.process.send_signal(signal.SIGHUP)
        wait_until(lambda: any(log in line for line in self.gate.log[before:]), what=str(self.gate.log))
        return sent


@pytest.fixture
def service(gateway: StartGateway, tmp_path: pathlib.Path) -> Callable[..., Service]:
    return lambda text, *arguments: Service(gateway, tmp_path / "config.yaml", text, *arguments)


@contextlib.contextmanager
def taken_port() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        yield taken


def any_port() -> int:
    return free_port()


def is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried, contextlib.suppress(OSError):
        tried.bind(("127.0.0.1", port))
        return True
    return False


def seen(gate: Gateway, after: float) -> set[tuple[str, object]]:
    """Every link state and error code of the lines after an instant."""
    return {(line.status["link"]["state"], line.status["error_code"]) for line in gate.lines if line.at > after}


def test_unchanged_links_keep_their_vehicles_and_their_state(service: Callable[..., Service], wire: OpenWire) -> None:
    """The latched cause was announced once, long before: only what was kept can know of it."""
    kept, gone, new = any_port(), any_port(), any_port()
    it = service(f"links: ['udpin:127.0.0.1:{kept}', 'udpin:127.0.0.1:{gone}']\n")
    gate = it.gate
    rover = wire(("127.0.0.1", kept)).beating()
    rover.beat(armed=True, custom_mode=10)
    gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED" and s["mode"] == "AUTO")
    rover.send(MAVLink_statustext_message(2, b"Crash: Disarming", 0, 0))
    gate.wait_for(lambda s: s["error_code"] == 4001)

    sent = it.reload(f"links: ['udpin:127.0.0.1:{new}', 'udpin:127.0.0.1:{kept}']\n")
    gate.wait_for_lines(15, after=sent)
    assert seen(gate, sent) == {("CONNECTED", 4001)}
    assert is_free(gone)
    assert not is_free(new)
    assert not is_free(kept)
    assert rover.wait_for("ROBOT_STATUS", after=sent), "the link kept its peer"


def test_a_vehicle_of_a_removed_link_ends_with_never_seen(service: Callable[..., Service], wire: OpenWire) -> None:
    kept, gone = any_port(), any_port()
    it = service(f"links: ['udpin:127.0.0.1:{kept}', 'udpin:127.0.0.1:{gone}']\n")
    wire(("127.0.0.1", gone), system=1).beating()
    it.gate.wait_for(lambda s: s["system"] == 1)
    wire(("127.0.0.1", kept), system=2).beating()
    name = it.gate.wait_for(lambda s: s["system"] == 2).status["handle"]

    sent = it.reload(f"links: ['udpin:127.0.0.1:{kept}']\n")
    last = it.gate.wait_for(lambda s: s["system"] == 1 and s["link"]["state"] == "NEVER_SEEN", after=sent)
    assert it.gate.wait_for_lines(10, after=last.at).status["handle"] == name
    assert not [line for line in it.gate.lines if line.status["system"] == 1 and line.at > last.at]


def test_a_handle_that_a_reload_renames_ends_on_the_outputs_that_stay(
    service: Callable[..., Service], wire: OpenWire
) -> None:
    port, http = any_port(), free_port()
    text = f"links: ['udpin:127.0.0.1:{port}']\nvehicles: [{{system: 1, handle: %s}}]\n"
    it = service(text % "rover", "--http", f"127.0.0.1:{http}")
    rover = wire(("127.0.0.1", port)).beating()
    it.gate.wait_for(lambda s: s["handle"] == "rover" and s["drives_powered"] is False)

    sent = it.reload(text % "boat")
    rover.beat(armed=True)
    it.gate.wait_for(lambda s: s["handle"] == "boat" and s["drives_powered"] is True, after=sent)
    last = [line.status for line in it.gate.lines if line.status["handle"] == "rover"][-1]
    assert (last["link"]["state"], last["drives_powered"]) == ("NEVER_SEEN", None)

    def served() -> list[str]:
        with urllib.request.urlopen(f"http://127.0.0.1:{http}/api/v1/vehicles", timeout=10) as answer:
            return [line["handle"] for line in json.load(answer)]

    wait_until(lambda: served() == ["boat"])


def test_a_vehicle_gets_the_handle_of_the_new_configuration(service: Callable[..., Service], wire: OpenWire) -> None:
    port = any_port()
    it = service(f"links: ['udpin:127.0.0.1:{port}']\n")
    wire(("127.0.0.1", port)).beating()
    it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    sent = it.reload(f"links: ['udpin:127.0.0.1:{port}']\nvehicles: [{{system: 1, handle: rover}}]\n")
    first = it.gate.wait_for(lambda s: s["handle"] == "rover", after=sent)
    assert first.status["link"]["state"] == "CONNECTED"


def test_outputs_and_rates_change_and_options_of_the_command_line_stay(
    service: Callable[..., Service], wire: OpenWire, tmp_path: pathlib.Path
) -> None:
    port = any_port()
    controller = "robot: {{type: mav_robot_status/IndustrialRobotStatusController, publish_rate: {}, publishers: [{}]}}"
    lines = f"{{type: json, path: {tmp_path / 'lines.jsonl'}}}"
    text = f"links: ['udpin:127.0.0.1:{port}']\n" + controller
    it = service(text.format(1, "json"), "--system", "1")
    wire(("127.0.0.1", port), system=1).beating()
    wire(("127.0.0.1", port), system=2).beating()
    it.gate.wait_for(lambda s: s["system"] == 1)
    it.reload(text.format(50, lines))
    written = tmp_path / "lines.jsonl"
    wait_until(lambda: written.exists() and written.read_text().count("\n") > 20)
    assert '"system": 2' not in written.read_text()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("links: ['udpin:127.0.0.1:{port}']\nlinsk: []\n", r"config\.yaml:2:1"),
        ("links: [", r"config\.yaml:\d+:\d+"),
        ("links: []\n", "no connection given"),
        ("links: ['flight.tlog']\n", "a recorded log is replayed alone"),
        ("links: ['udpin:127.0.0.1:{port}']\nrobot: {{type: pigeon/Post}}\n", "pigeon/Post"),
        ("links: ['udpin:127.0.0.1:{other}', 'udpin:127.0.0.1:{taken}']\n", "{taken}"),
        ("links: ['udpin:127.0.0.1:{port}', 'udpin:127.0.0.1:{other}']\nrecord: /nowhere/a.tlog\n", "/nowhere"),
        (
            "links: ['udpin:127.0.0.1:{other}']\n"
            "robot: {{type: mav_robot_status/IndustrialRobotStatusController,"
            " publishers: [{{type: json, path: /nowhere/a}}]}}\n",
            "/nowhere/a",
        ),
    ],
    ids=["unknown key", "no YAML", "no link", "a log", "no such controller", "port taken", "no recording", "no output"],
)
def test_an_invalid_file_changes_nothing_and_is_one_line_in_the_log(
    service: Callable[..., Service], wire: OpenWire, text: str, says: str
) -> None:
    port, other = any_port(), any_port()
    it = service(f"links: ['udpin:127.0.0.1:{port}']\n")
    wire(("127.0.0.1", port)).beating()
    it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    with taken_port() as taken:
        names = {"port": port, "other": other, "taken": taken.getsockname()[1]}
        sent = it.reload(text.format(**names), "the configuration stays as it was")
        it.gate.wait_for_log("stays as it was: .*" + says.format(**names))
    it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED", after=sent)
    it.gate.wait_for_lines(3, after=time.monotonic())
    assert sum("stays as it was" in line for line in it.gate.log) == 1
    assert is_free(other)
    assert not is_free(port)
    assert it.gate.stop() == 0


def test_a_new_connection_can_take_the_port_of_an_old_one(service: Callable[..., Service], wire: OpenWire) -> None:
    port = any_port()
    it = service(f"links: ['udpin:127.0.0.1:{port}']\n")
    wire(("127.0.0.1", port)).beating()
    it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    sent = it.reload(f"links: ['udpin:0.0.0.0:{port}']\n")
    it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED", after=sent)


def test_an_open_link_becomes_passive(service: Callable[..., Service], wire: OpenWire) -> None:
    port = any_port()
    it = service(f"links: ['udpin:127.0.0.1:{port}']\n")
    rover = wire(("127.0.0.1", port)).beating()
    rover.wait_for("ROBOT_STATUS")
    it.reload(f"links: [{{url: 'udpin:127.0.0.1:{port}', passive: true}}]\n")
    rover.settle()
    quiet = time.monotonic()
    assert it.gate.wait_for_lines(15, after=quiet).status["link"]["state"] == "CONNECTED"  # 1.5 s
    rover.settle()
    assert not [heard for heard in rover.heard() if heard.at > quiet]


def test_ten_reloads_lose_no_status(service: Callable[..., Service], wire: OpenWire) -> None:
    port = any_port()
    one, two = (f"links: ['udpin:127.0.0.1:{port}']\n{more}" for more in ("", "hardware: {heartbeat_timeout: 4 s}\n"))
    it = service(one)
    wire(("127.0.0.1", port)).beating()
    began = it.gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED").at
    for text in (two, one) * 5:
        it.reload(text)
    assert {state for state, _ in seen(it.gate, began)} == {"CONNECTED"}
    assert it.gate.stop() == 0


@pytest.mark.skipif(
    signal.getsignal(signal.SIGHUP) is signal.SIG_IGN, reason="SIGHUP is ignored here: run pytest without nohup"
)
def test_without_a_configuration_sighup_terminates(gateway: StartGateway) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    assert gate.port
    assert gate.stop(signal.SIGHUP) == -signal.SIGHUP


# -- the wheel -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True, timeout=allow(120))
    return next(folder.glob("*.whl"))


def documented(wheel: pathlib.Path, folder: pathlib.Path) -> str:
    """The commands of docs/how-to/service.md that install, done within a folder."""
    text = (ROOT / "docs" / "how-to" / "service.md").read_text()
    commands = text[text.index("sudo PIPX_HOME") : text.index("sudo systemctl")]
    commands = re.sub(r"(?<![.\w])/(opt|usr|etc)/", rf"{folder}/\1/", commands.replace("sudo ", ""))
    return re.sub(r"\./mav_robot_status-\S+\.whl", str(wheel), commands)


@pytest.mark.slow
def test_the_commands_of_the_document_install_the_service(wheel: pathlib.Path, tmp_path: pathlib.Path) -> None:
    if not shutil.which("pipx", path=INSTALLERS):
        pytest.skip("pipx is not installed: .ci/run installs it in build/installers")
    path = f"{INSTALLERS}:/usr/sbin"
    done = subprocess.run(
        ["bash", "-ec", documented(wheel, tmp_path)], env={**os.environ, "PATH": path}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    unit = (tmp_path / "etc" / "systemd" / "system" / UNIT.name).read_text()
    start = re.search(r"^ExecStart=(\S+) (run --config) (\S+)", unit, re.MULTILINE)
    assert start
    config = str(tmp_path) + start[3]
    done = subprocess.run([str(tmp_path) + start[1], "check-config", config], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("tool", "install"), [("uv", ("tool", "install")), ("pipx", ("install",))])
def test_the_wheel_installs_the_command_and_the_files_of_the_service(
    tool: str, install: tuple[str, ...], wheel: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = shutil.which(tool, path=INSTALLERS)
    if command is None:
        pytest.skip(f"{tool} is not installed: .ci/run installs it in build/installers")
    for name in ("UV_TOOL_DIR", "PIPX_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "tools"))
    for name in ("UV_TOOL_BIN_DIR", "PIPX_BIN_DIR"):
        monkeypatch.setenv(name, str(tmp_path / "bin"))
    what = f"mav-robot-status[web] @ file://{wheel}"
    subprocess.run([command, *install, "--python", sys.executable, what], check=True, timeout=allow(300))
    shown = subprocess.run([tmp_path / "bin" / "mav-robot-status", "--version"], capture_output=True, text=True)
    assert shown.stdout.startswith("mav-robot-status ")
    applet = subprocess.run([tmp_path / "bin" / "mav-robot-status", "applet"], capture_output=True, check=True)
    assert applet.stdout == (ROOT / "contrib" / "ardupilot" / "robot_status.lua").read_bytes()
    files = {path.name for path in (tmp_path / "tools").rglob("share/mav-robot-status/**/*") if path.is_file()}
    there_are = {path.name for path in (ROOT / "contrib").rglob("*") if path.is_file()}
    assert files == there_are
    assert len(list((tmp_path / "tools").rglob("share/man/man1/mav-robot-status.1"))) == 1
