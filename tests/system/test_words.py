"""Words of others: no text of a vehicle, a file or an argument reaches a terminal raw, and no name is a program."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message, MAVLink_statustext_message

from ..deadline import allow
from .gateway_process import COMMAND, Gateway, run
from .wire import Wire

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]

CLIPBOARD = "\x1b]52;c;aGk=\x07"
HOSTILE = f"{CLIPBOARD}\x9b2J\u202eab\x7f"
"""A sequence that writes the clipboard, one that clears the screen, and a sign that reverses what follows."""
FOLDED = "a\nb"


def is_visible(text: str) -> bool:
    """Whether a terminal prints every character of it."""
    return all(line.isprintable() for line in text.split("\n"))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A recording with a hostile name and a hostile text that is an error."""
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    data = b""
    for second in range(6):
        stamp = (1_800_000_000_000_000 + second * 1_000_000).to_bytes(8, "big")
        text = f"Yaw Imbalance {HOSTILE}".encode()[:50]
        for message in (MAVLink_heartbeat_message(10, 3, 65, 0, 4, 3), MAVLink_statustext_message(2, text)):
            data += stamp + message.pack(mav)
            mav.seq += 1
    path = tmp_path / f"f{CLIPBOARD}{FOLDED}\u202e.tlog"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ("explain", "LOG"),
        ("explain", "LOG", "--as-json"),
        ("explain", "LOG", "--at", HOSTILE),
        ("report", "LOG", "-v"),
        ("report", "LOG", "--as-json"),
        ("report", "LOG", "-o", f"/nowhere/{HOSTILE}.html"),
        ("LOG",),
        ("run", "LOG", "-v"),
        ("run", f"{HOSTILE}.tlog"),
        ("run", f"udp:{HOSTILE}"),
        ("run", "udp:127.0.0.1:0", "--json", f"/nowhere/{HOSTILE}"),
        ("run", "udp:127.0.0.1:0", "--record", f"{HOSTILE}"),
        ("run", "udp:127.0.0.1:0", "--signing-key", HOSTILE),
        ("run", "udp:127.0.0.1:0", f"--{HOSTILE}"),
        ("run", "udp:127.0.0.1:0", "--mqtt", f"mqtt://{HOSTILE}"),
        ("run", "--config", HOSTILE),
        ("check-config", HOSTILE),
        ("check-config", "CONFIG"),
        ("check-config", "FAULT"),
        ("doctor", f"udp:{HOSTILE}"),
        ("watch", f"{HOSTILE}.tlog"),
        ("board", HOSTILE),
        ("demo", "--http", HOSTILE),
        ("dialect", "-o", "FOLDER"),
        ("applet", "-o", "SCRIPT"),
        (HOSTILE,),
    ],
    ids=lambda arguments: " ".join(arguments).encode("unicode_escape").decode()[:40],
)
def test_no_command_passes_a_hostile_text_to_the_terminal(
    arguments: tuple[str, ...], log: Path, tmp_path: Path
) -> None:
    config, fault, folder = tmp_path / f"c{HOSTILE}.yaml", tmp_path / f"f{HOSTILE}.yaml", tmp_path / f"d{HOSTILE}"
    folder.mkdir()
    config.write_text(
        f"links: ['/dev/tty{json.dumps(HOSTILE)[1:-1]}']\n".replace("'", '"') + "record: flight.tlog\n", "utf-8"
    )
    fault.write_text(f'"{json.dumps(HOSTILE)[1:-1]}": 1\n', "utf-8")
    places = {"LOG": log, "CONFIG": config, "FAULT": fault, "FOLDER": folder, "SCRIPT": folder / f"{HOSTILE}.lua"}
    done = run(*(str(places.get(a, a)) for a in arguments), cwd=tmp_path)
    assert is_visible(done.stdout)
    assert is_visible(done.stderr)
    assert "Traceback" not in done.stderr


def test_a_vehicles_text_is_shown_by_its_codes(log: Path) -> None:
    done = run("explain", str(log))
    assert done.returncode == 0
    assert r"\u001b]52;c;aGk=\u0007" in done.stdout
    assert "\x1b" not in done.stdout


def test_a_live_gateway_writes_no_control_character(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "-v")
    rover = wire(gate.address).beating()
    rover.beat(armed=True)
    rover.send(MAVLink_statustext_message(2, f"Crash: Disarming {HOSTILE}".encode()[:50]))
    gate.wait_for(lambda s: any("52;c" in (i["text"] or "") for i in [*s["errors"], *s["inhibits"]]))
    assert gate.stop() == 0
    assert is_visible("\n".join(gate.log))


def test_explain_on_a_full_disk_is_one_line(log: Path) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [*COMMAND, "explain", str(log)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=allow(30),
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr.endswith("mav-robot-status: cannot write to standard output: No space left on device\n")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "fault",
    [
        "publishers: [{type: mqtt, url: 'mqtt://b/r', robot: '{handle:>2000000000}'}]",
        "publishers: [{type: mqtt, url: 'mqtt://b/r', robot: '{handle.__class__}'}]",
        "publishers: [{type: mqtt, url: 'mqtt://b/r', robot: '{0}'}]",
        "publishers: [{type: mqtt, url: 'mqtt://b/r', robot: '{colour}'}]",
        "publish_rate: .nan",
        "publish_rate: 1e308",
    ],
)
def test_check_config_refuses_in_one_line_what_would_end_or_hang_the_gateway(fault: str, tmp_path: Path) -> None:
    config = tmp_path / "c.yaml"
    config.write_text(f"c:\n  type: mav_robot_status/IndustrialRobotStatusController\n  {fault}\n")
    done = run("check-config", str(config))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"mav-robot-status: {config}:3:")
    assert done.stderr.count("\n") == 1
