"""Runs everything that the documents show: programs, configurations, commands, JSON, links.

- A Python block runs as a program.
- A command that ends runs to its end, in a folder with a recorded log and the example configurations.
- A command that runs until it is stopped gets free ports and a vehicle. A signal stops it after its first line.
- A command that installs is compared with `.ci/run`, which runs it.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import pathlib
import re
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime, timedelta, timezone
from typing import Any

import pytest

from mav_robot_status import config, testing
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    NotReady,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers import json_lines

from ..deadline import allow
from ..ports import free_port
from ..recorded.replays import NO_LARGE_SET, SHARED
from ..system.bridges import PtyBridge
from ..system.screen import Screen
from .documents import DOCUMENTS, ROOT, Block, blocks, links, name_of, prose

SCHEMA = ROOT / "mav_robot_status" / "data" / "robot_status.schema.json"
SETUP = "python3 -m venv .venv && .venv/bin/pip install -q "
TESTS = SETUP + "-e '.[dev]' && .venv/bin/python -m pytest"
DEMO = SETUP + "'.[watch,web]' && .venv/bin/mav-robot-status demo"
FAKES = "python -m mav_robot_status.testing.mobile_manipulator"
GENERATORS = {
    ".venv/bin/python dialects/generate.py": ".",
    ".venv/bin/python docs/make_reference.py": "autopilots.md",
    ".venv/bin/python docs/make_man.py": "page.1",
}
"""What they write to, in the folder of the test."""
SCOREBOARD = ".venv/bin/python docs/make_scoreboard.py"
MEASUREMENTS = (".venv/bin/python -m bench", SCOREBOARD)
KEY = bytes(range(32))
PATIENCE = 30.0  # s on an idle machine until a command counts as hanging

COMMANDS = [(block, line) for block in blocks("bash") for line in block.code.splitlines() if line.strip()]


def of(*languages: str) -> pytest.MarkDecorator:
    found = blocks(*languages)
    assert found
    return pytest.mark.parametrize("block", found, ids=[block.name for block in found])


def test_every_block_is_in_a_language_that_is_checked_here() -> None:
    assert {block.language for block in blocks()} == {"bash", "json", "python", "text", "toml", "yaml"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_every_fence_belongs_to_a_block(document: pathlib.Path) -> None:
    assert "```" not in prose(document)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_every_link_leads_to_something(document: pathlib.Path) -> None:
    for link in links(document):
        assert (document.parent / link.partition("#")[0]).exists(), link


@pytest.mark.usefixtures("place")
@of("python")
def test_a_program_runs(block: Block) -> None:
    done = subprocess.run([sys.executable, "-c", block.code], capture_output=True, text=True, timeout=allow(PATIENCE))
    assert (done.returncode, done.stderr) == (0, "")


@of("yaml")
def test_a_configuration_loads(block: Block, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "example.yaml"
    path.write_text(block.code)
    assert config.load(path).controllers


# -- JSON ------------------------------------------------------------------------------------------------------------


@of("json")
def test_a_line_is_what_the_publisher_writes(block: Block) -> None:
    shown = json.loads(block.code)
    if "stamp" in shown:
        assert json.loads(_native(shown)) == shown
        importlib.import_module("jsonschema").validate(shown, json.loads(SCHEMA.read_text()))
    else:
        assert json.loads(_ros(shown)) == shown


def _native(shown: dict[str, Any]) -> str:
    """The line that the publisher writes for the values in a document."""
    causes = tuple(
        ErrorCause(e["code"], e["name"], e["text"], _us(e["since"]), e.get("handle")) for e in shown["errors"]
    )
    inhibits = tuple(Inhibit(i["name"], i["text"], _us(i["since"]), i.get("handle")) for i in shown["inhibits"])
    values = {name: TriState(-1 if shown[name] is None else shown[name]) for name in RobotStatus._fields[1:-1]}
    status = RobotStatus(mode=RobotMode[shown["mode"]], **values, error_code=shown["error_code"])
    vehicle, members = Vehicle(**shown["vehicle"]), tuple(shown.get("members", ()))
    not_ready = tuple(NotReady(**one) for one in shown.get("not_ready", ()))
    detail = Detail(
        shown["system"], shown["component"], causes, inhibits, vehicle, members=members, not_ready=not_ready
    )
    msg = RobotStatusMsg(shown["handle"], _us(shown["stamp"]), status, detail, shown["link"]["heartbeat_age"])
    return json_lines.native(msg, shown["seq"], json_lines.native_body(msg.handle, status, detail))


def _ros(shown: dict[str, Any]) -> str:
    header = shown["header"]
    seconds, ns = header["stamp"].values()
    code = shown["error_code"] if "error_code" in shown else shown["error_codes"][0]
    values = {name: TriState(shown[name]["val"]) for name in RobotStatus._fields[1:-1]}
    status = RobotStatus(mode=RobotMode(shown["mode"]["val"]), **values, error_code=code)
    detail = Detail(errors=(ErrorCause(code, "", None, 0),))
    msg = RobotStatusMsg(header["frame_id"], seconds * 1_000_000 + ns // 1000, status, detail, None)
    return json_lines.ros1(msg, header["seq"]) if "seq" in header else json_lines.ros2(msg, 0)


def _us(stamp: str) -> int:
    read = datetime.strptime(stamp, "%Y-%m-%dT%H:%M:%S.%fZ").replace(tzinfo=timezone.utc)
    return (read - datetime(1970, 1, 1, tzinfo=timezone.utc)) // timedelta(microseconds=1)


# -- commands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("block", "command"), COMMANDS, ids=[f"{b.name}: {c}" for b, c in COMMANDS])
def test_a_command_does_what_it_says(block: Block, command: str, place: pathlib.Path) -> None:
    if command == TESTS:
        assert command == " && ".join(_ci()[:3])
    elif command == DEMO:
        _runs_until_stopped(place, ["mav-robot-status", "demo"], signal.SIGINT)
    elif command.startswith("mav-robot-status demo "):
        _runs_until_stopped(place, _with_free_ports(place, command).split(), signal.SIGINT)
    elif command == FAKES:
        _plays_until_stopped([sys.executable, *command.split()[1:], "--arm", "0", "--dashboard", "0"])
    elif (target := GENERATORS.get(command)) is not None:
        subprocess.run([sys.executable, ROOT / command.split()[1], place / target], check=True, timeout=allow(PATIENCE))
    elif command == SCOREBOARD and not SHARED.is_dir():
        pytest.skip(NO_LARGE_SET)
    elif command.startswith(MEASUREMENTS):  # they take minutes: here they only list their cases
        measurement = [sys.executable, *command.split()[1:], "--list"]
        assert subprocess.run(measurement, cwd=ROOT, capture_output=True, check=True, timeout=allow(PATIENCE)).stdout
    elif command.startswith(".venv/bin/"):
        assert command in _ci()
    elif command.startswith("mav-robot-status px4-events fetch "):
        _fetches(place, _with_free_ports(place, command))
    elif "dds://" in command and importlib.util.find_spec("cyclonedds") is None:
        pytest.skip("cyclonedds is not installed: it has no wheel for this Python or processor")
    elif command.startswith("mav-robot-status ") and re.search(r" udp:| /dev/tty| --config ", command):
        _runs_until_stopped(place, _with_free_ports(place, command).split(), signal.SIGTERM)
    elif command.startswith("mav-robot-status "):
        before = {path.name for path in place.iterdir()}
        done = _bash(_beside_pymavlink(place, command))
        assert done.stdout or {path.name for path in place.iterdir()} - before
    else:
        pytest.fail(f"{block.name}: nothing here checks this command: {command}")


def test_the_readme_starts_with_the_demo_the_command_and_the_tests() -> None:
    commands = [command for block, command in COMMANDS if block.document.name == "README.md"]
    assert commands[:3] == [DEMO, "mav-robot-status udp:127.0.0.1:14550", TESTS]


def test_the_readme_shows_what_the_demo_shows() -> None:
    """But for the words of the remedies, which are those of their own table."""
    block = next(b for b in blocks("text") if b.document.name == "README.md")
    wanted = [re.match(r"1\.1 .* 0s|Cannot move: |Next: |.*", line) for line in block.code.splitlines() if line]
    assert len(wanted) >= 8
    screen = Screen("demo")
    try:
        screen.wait_for(
            lambda lines: all(any(line.startswith(one[0]) for line in lines) for one in wanted if one),
            "screen as in the README",
        )
    finally:
        screen.close()


def test_the_readme_has_no_picture_that_an_index_of_packages_cannot_show() -> None:
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text())
    assert all(picture.startswith("https://") for picture in pictures)


def test_the_line_in_the_readme_is_from_a_rover_that_was_just_switched_on(place: pathlib.Path) -> None:
    shown = json.loads(next(b.code for b in blocks("json") if b.document.name == "README.md"))
    command = _with_free_ports(place, "mav-robot-status udp:127.0.0.1:14550 --changes-only").split()
    with _running(command) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stderr.readline()  # it listens: the vehicle starts now, however slow this machine is
        with _vehicle(command, testing.DEMO):
            line = _line_with(process.stdout, shown["inhibits"])
        process.terminate()
    for name in ("stamp", "seq", "link"):
        assert _shape(line.pop(name)) == _shape(shown.pop(name))
    for inhibit in (*line["inhibits"], *shown["inhibits"]):
        del inhibit["since"]
    assert line == shown


def _line_with(lines: Iterable[str], inhibits: list[dict[str, Any]]) -> dict[str, Any]:
    """The first line whose inhibits have the same texts."""
    texts = [inhibit["text"] for inhibit in inhibits]
    return next(line for line in map(json.loads, lines) if [i["text"] for i in line["inhibits"]] == texts)


def _ci() -> list[str]:
    """The lines of .ci/run from the set-up on, without indentation."""
    lines = [line.strip().split(" || ")[0] for line in (ROOT / ".ci" / "run").read_text().splitlines()]
    return lines[lines.index("python3 -m venv .venv") :]


def _bash(command: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=allow(PATIENCE))
    assert done.returncode == 0, done.stderr
    return done


def _beside_pymavlink(place: pathlib.Path, command: str) -> str:
    """For a command that writes among pymavlink's files: check the folder, then replace it by one of the test."""
    folder = re.search(r'"\$\((.*)\)"', command)
    if folder is None:
        return command
    assert (pathlib.Path(_bash(folder[1]).stdout.strip()) / "common.xml").exists()
    return command.replace(folder[0], str(place / "dialects"))


def _with_free_ports(place: pathlib.Path, command: str) -> str:
    """The command with free ports, also in the configurations in the folder."""
    configurations = {path: path.read_text() for path in (place / "config").glob("*.yaml")}
    for port in sorted(set(re.findall(r":(145\d\d|8765|11002)\b", command + "".join(configurations.values())))):
        free = str(free_port())
        command = command.replace(port, free)
        configurations = {path: text.replace(port, free) for path, text in configurations.items()}
    for path, text in configurations.items():
        path.write_text(text)
    return command


@contextmanager
def _running(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process. It is killed if it hangs, and must end with exit code 0."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        watchdog = threading.Timer(allow(PATIENCE), process.kill)
        watchdog.start()
        try:
            yield process
            _, log = process.communicate()
        finally:
            watchdog.cancel()
            process.kill()
        assert process.returncode == 0, log
        assert "Traceback" not in log
        assert "listening on" in log or "serial" in log


def _runs_until_stopped(place: pathlib.Path, command: list[str], stop: signal.Signals) -> None:
    command = _with_our_key(place, _with_our_devices(place, command))
    with _vehicle(command, testing.ardurover.READY), _running(command) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["seq"] == 0
        process.send_signal(stop)


def _fetches(place: pathlib.Path, command: str) -> None:
    """A PX4 that has the file is on the port of the command."""
    *_, output = command.split()
    with _vehicle(command.split(), testing.px4.READY, testing.event_files()):
        _bash(command)
    assert (place / output).stat().st_size > 100


def _plays_until_stopped(command: list[str]) -> None:
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        watchdog = threading.Timer(allow(PATIENCE), process.kill)
        watchdog.start()
        try:
            assert process.stdout is not None
            assert any(line.startswith("  0.0 s  ") for line in process.stdout)
            process.send_signal(signal.SIGINT)
            assert process.wait() == 0
        finally:
            watchdog.cancel()
            process.kill()


def _with_our_devices(place: pathlib.Path, command: list[str]) -> list[str]:
    return [part.replace("/dev/", f"{place}/") if part.startswith("/dev/tty") else part for part in command]


def _with_our_key(place: pathlib.Path, command: list[str]) -> list[str]:
    """The command with a key file or token file that exists."""
    if "--http-token-file" in command:
        (place / "token").write_text("correct-horse-battery")
        (place / "token").chmod(0o600)
    if "--signing-key" not in command:
        return command
    (place / "key").write_text(KEY.hex())
    (place / "key").chmod(0o600)
    at = command.index("--signing-key") + 1
    return [*command[:at], str(place / "key"), *command[at + 1 :]]


@contextmanager
def _vehicle(
    command: list[str], scenario: testing.Scenario, files: testing.VehicleFiles | None = None
) -> Iterator[None]:
    """A vehicle on each UDP port or serial device of the command."""
    key = KEY if "--signing-key" in command else None
    with ExitStack() as ended:
        for part in command:
            if part.startswith("udp:"):
                to = "127.0.0.1", int(part.rpartition(":")[2])
            elif "/tty" in part:
                cable = PtyBridge(pathlib.Path(part.partition(",")[0]))
                cable.start()
                ended.callback(cable.close)
                to = cable.address
            else:
                continue
            ended.enter_context(testing.FakeAutopilot(scenario, to=to, signing_key=key, files=files))
        yield


def _shape(value: object) -> object:
    """The keys and types of a value."""
    return {key: _shape(item) for key, item in value.items()} if isinstance(value, dict) else type(value)


# -- ROS -------------------------------------------------------------------------------------------------------------

NOT_RUN = {
    "rosparam ": "no ROS 1",
    "rosrun ": "no ROS 1",
    "rostopic ": "no ROS 1",
    "roslaunch ": "no ROS 1",
    "ros2 ": "no ros2 command: the tests use rclpy",
    "export RMW_IMPLEMENTATION": "for ros2",
    "git clone ": "no network in tests",
    "colcon ": "no colcon",
    "source install/": "what colcon builds",
}
"""The beginnings of commands in the documents about ROS that nothing here can run, and why."""


def test_every_command_about_ros_is_run_or_has_a_reason() -> None:
    """The blocks in bash are run above; a prompt shows an output, which tests of the command compare."""
    pages = [block for block in blocks("text") if block.document.name in ("ros.md", "ros2.md")]
    lines = [line for block in pages if not block.code.startswith("$ ") for line in block.code.splitlines() if line]
    assert lines
    assert not [line for line in lines if not line.startswith(tuple(NOT_RUN))]


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_no_document_has_a_ros_command_that_does_not_work(document: pathlib.Path) -> None:
    text = document.read_text()
    assert "_robot_ip_address" not in text
    assert not re.search(r"branch `?ros2`?\b(?!_)", text)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("robot_state.launch", {"arg", "param", "rosparam", "node"}),
        ("mav_robot_status.launch.xml", {"arg", "executable"}),
    ],
)
def test_a_launch_file_parses_and_starts_what_the_documents_name(name: str, parts: set[str]) -> None:
    launch = ET.parse(ROOT / "contrib" / "ros" / name).getroot()
    assert (launch.tag, {part.tag for part in launch}) == ("launch", parts)
    arguments = {one.get("name") for one in launch.iter("arg")}
    text = ET.tostring(launch, encoding="unicode")
    assert set(re.findall(r"\$\((?:var|arg) (\w+)\)", text)) == arguments
    for executable in launch.iter("executable"):
        command = str(executable.get("cmd"))
        for one in launch.iter("arg"):
            command = command.replace(f"$(var {one.get('name')})", str(one.get("default")))
        assert command == "mav-robot-status udp:0.0.0.0:14550 --json none --ros2 dds://"
    for node in launch.iter("node"):
        assert (node.get("pkg"), node.get("type")) == ("industrial_robot_client", "robot_state")
