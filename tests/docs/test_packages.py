"""The examples that are packages of their own: installed as their page says, the gateway finds them by entry point."""

from __future__ import annotations

import configparser
import json
import pathlib
import socket
import subprocess
import sys

import pytest

from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

from .documents import Block, blocks

PATIENCE = 60.0  # s after which a command counts as hanging
HEARTBEAT = Heartbeat(custom_mode=10, type=10, autopilot=3, base_mode=137, system_status=4, mavlink_version=3)


def page(name: str) -> list[Block]:
    """The blocks of a how-to guide."""
    return [block for block in blocks() if block.document.name == name]


def installed(place: pathlib.Path, own: list[Block], monkeypatch: pytest.MonkeyPatch) -> Block:
    """Install the module before the page's pyproject.toml, with its entry points. Returns the block after it."""
    at = next(i for i, block in enumerate(own) if block.language == "toml")
    toml = configparser.ConfigParser()
    toml.optionxform = str  # type: ignore[assignment,method-assign]
    toml.read_string(own[at].code)
    (section,) = (name for name in toml.sections() if name.startswith("project.entry-points."))
    points = {name: target.strip('"') for name, target in toml[section].items()}
    module = next(iter(points.values())).partition(":")[0]
    (place / f"{module}.py").write_text(own[at - 1].code)
    info = place / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {toml['project']['name']}\nVersion: 1.0\n")
    group = section.partition('"')[2].rstrip('"')
    lines = [f"[{group}]", *(f"{name} = {target}" for name, target in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.setenv("PYTHONPATH", str(place))
    return own[at + 1]


def test_a_publisher_is_found_by_its_entry_point(place: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    configuration = installed(place, page("publisher.md"), monkeypatch)
    (place / "lamp.yaml").write_text(configuration.code)
    command = ["mav-robot-status", "flight.tlog", "--config", "lamp.yaml"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert done.stdout
    assert (place / "lamp.txt").read_text() == "off\n"


def test_an_arm_is_found_by_its_entry_point_and_is_a_member_of_the_group(
    place: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    configuration = installed(place, page("arm.md"), monkeypatch)
    command = [sys.executable, "-m", "mav_robot_status.cli", "--config", "arm.yaml", "--changes-only"]
    with socket.create_server(("127.0.0.1", 0)) as arm:
        (place / "arm.yaml").write_text(configuration.code.replace("7000", str(arm.getsockname()[1])))
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as gateway:
            assert gateway.stdout is not None
            arm.settimeout(PATIENCE)
            client, _ = arm.accept()
            with client:
                client.sendall(b"auto=1 stopped=1 powered=1 moving=0\n")
                lines = map(json.loads, gateway.stdout)
                line = next(line for line in lines if line["handle"] == "robot" and line["e_stopped"])
            gateway.terminate()
            _, log = gateway.communicate(timeout=PATIENCE)
    assert (line["mode"], line["motion_possible"], line["inhibits"][0]["handle"]) == ("AUTO", False, "arm")
    assert gateway.returncode == 0, log


def test_a_link_is_found_by_its_entry_point(place: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = installed(place, page("link.md"), monkeypatch)
    assert shown.code.startswith("mav-robot-status unixgram:")
    command = [sys.executable, "-m", "mav_robot_status.cli", "unixgram:here.socket", "--changes-only"]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as gateway,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as vehicle,
    ):
        assert gateway.stdout is not None
        assert gateway.stderr is not None
        assert "unix datagrams at here.socket" in gateway.stderr.readline()
        vehicle.bind("vehicle.socket")
        vehicle.sendto(encode(HEARTBEAT, system=7, component=1, sequence=0), "here.socket")
        assert json.loads(gateway.stdout.readline())["system"] == 7
        gateway.terminate()
        _, log = gateway.communicate(timeout=PATIENCE)
    assert gateway.returncode == 0, log
