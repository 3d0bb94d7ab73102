"""MAVProxy and Wireshark's tshark see ROBOT_STATUS as docs/how-to/ground-stations.md shows.

The tests type what that page shows and expect the output that it shows. Without a tool its tests are skipped; .ci/run
installs both.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shlex
import shutil
import socket
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, ardurover
from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from ..deadline import allow
from ..docs.documents import ROOT, blocks
from ..ports import free_port
from .gateway_process import Gateway, run
from .terminal import Terminal
from .wire import Wire

MAVPROXY = Path(os.environ.get("MAVPROXY_VENV", ROOT / "build" / "mavproxy"))
"""A separate environment, because the tests add dialects to its pymavlink."""

TELLING = ardurover.READY._replace(streams={1: 4.0, 245: 4.0, 33: 10.0, 30: 10.0, 2: 2.0, 36: 10.0, 74: 10.0})
"""A rover that sends everything unasked, so that its status is complete at once."""

LINKTYPE_RAW = 101


def shown(first: str) -> str:
    """The block of the page that starts like this."""
    (code,) = (b.code for b in blocks("text") if b.document.name == "ground-stations.md" and b.code.startswith(first))
    return code


# -- MAVProxy --------------------------------------------------------------------------------------------------------


DIALECTS = "mav_robot_status", "everything"
GENERATE = "import sys; from pymavlink.mavutil import set_dialect; [set_dialect(name) for name in sys.argv[1:]]"


@pytest.fixture(scope="module")
def dialects(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Our dialects are in MAVProxy's pymavlink. They are generated once, while the other test processes wait."""
    folder = next(MAVPROXY.glob("lib/python*/site-packages/pymavlink/dialects/v20"), None)
    if folder is None or not (MAVPROXY / "bin" / "mavproxy.py").exists():
        pytest.skip(f"MAVProxy is not installed in {MAVPROXY}: .ci/run installs it from the network")
    wanted = tmp_path_factory.mktemp("dialects")
    assert run("dialect", "-o", str(wanted)).returncode == 0
    (wanted / "everything.xml").write_text(shown("<mavlink>"))
    definitions = "".join((wanted / f"{name}.xml").read_text() for name in DIALECTS)
    with open(folder / "generated.txt", "a+") as generated:
        fcntl.flock(generated, fcntl.LOCK_EX)
        generated.seek(0)
        if generated.read() != definitions:
            _generate(wanted, folder)
            generated.truncate(0)
            generated.write(definitions)


def _generate(wanted: Path, folder: Path) -> None:
    for name in DIALECTS:
        shutil.copy(wanted / f"{name}.xml", folder)
        (folder / f"{name}.py").unlink(missing_ok=True)
    command = [str(MAVPROXY / "bin" / "python"), "-c", GENERATE, *DIALECTS]
    environment = {**os.environ, "MAVLINK20": "1"}
    subprocess.run(command, check=True, capture_output=True, timeout=allow(60), env=environment)


@pytest.fixture
def mavproxy(ended: contextlib.ExitStack, dialects: None, tmp_path: Path) -> Callable[[str, int], Terminal]:
    """Start MAVProxy with a dialect, its master listening on a port."""
    command = MAVPROXY / "bin" / "python", "-u", MAVPROXY / "bin" / "mavproxy.py", "--no-state"
    environment = {**os.environ, "HOME": str(tmp_path)}

    def start(dialect: str, port: int) -> Terminal:
        arguments = f"--dialect={dialect}", f"--master=udp:127.0.0.1:{port}"
        terminal = Terminal(*map(str, command), *arguments, env=environment, cwd=tmp_path)
        ended.callback(terminal.close)
        terminal.wait_for(lambda text: "Waiting for heartbeat" in text, "MAVProxy's start")
        return terminal

    return start


def timeless(text: str) -> str:
    return re.sub(r"(time_\w+) : \d+", r"\1 : 0", text)


def test_mavproxy_with_the_vehicle_shows_the_status_that_the_gateway_sends_back(
    gateway: Callable[..., Gateway],
    autopilot: Callable[..., FakeAutopilot],
    mavproxy: Callable[[str, int], Terminal],
) -> None:
    gate, port = gateway("udpin:127.0.0.1:0"), free_port()
    terminal = mavproxy("everything", port)
    rover = autopilot(TELLING, ("127.0.0.1", port))
    output, watch, disarmed, driving = timeless(shown("MAV> output add")).splitlines()
    terminal.wait_for(lambda text: "online system 1" in text, "vehicle")
    terminal.type(output.removeprefix("MAV> ").replace("14550", str(gate.port)))
    terminal.type(watch.removeprefix("MAV> "))
    terminal.wait_for(lambda text: disarmed in timeless(text), disarmed)
    rover.arm()
    rover.set_mode(10)
    terminal.wait_for(lambda text: driving in timeless(text), driving)


@pytest.mark.parametrize(
    ("dialect", "watched"),
    [("mav_robot_status", "ROBOT_STATUS"), ("all", "NAMED_VALUE_INT")],
    ids=["with our dialect", "with its own"],
)
def test_mavproxy_on_an_out_shows_the_messages_of_its_dialect(
    dialect: str,
    watched: str,
    gateway: Callable[..., Gateway],
    autopilot: Callable[..., FakeAutopilot],
    mavproxy: Callable[[str, int], Terminal],
) -> None:
    port = free_port()
    terminal = mavproxy(dialect, port)
    watch, *printed = timeless(shown(f"MAV> watch {watched}\n")).splitlines()
    terminal.type(watch.removeprefix("MAV> "))
    terminal.wait_for(lambda text: "Watching" in text, "watch")
    gate = gateway("udpin:127.0.0.1:0", "--out", f"udpout:127.0.0.1:{port}")
    autopilot(TELLING, gate.address)
    terminal.wait_for(lambda text: all(line in timeless(text) for line in printed), f"lines {printed}")


# -- Wireshark -------------------------------------------------------------------------------------------------------


@pytest.fixture
def wireshark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with our dissector in `dialect`; Wireshark has no other plugins and settings."""
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed: apt-get install tshark")
    monkeypatch.setenv("WIRESHARK_CONFIG_DIR", str(tmp_path / "settings"))
    assert run("dialect", "-o", str(tmp_path / "dialect")).returncode == 0
    return tmp_path


# A port may by chance be one that Wireshark has a use for.
FRAMES_FIRST = ("-o", "udp.try_heuristic_first:TRUE")


def test_tshark_shows_a_captured_status(
    gateway: Callable[..., Gateway],
    autopilot: Callable[..., FakeAutopilot],
    wire: Callable[..., Wire],
    ended: contextlib.ExitStack,
    wireshark: Path,
) -> None:
    command, *printed = shown("$ tshark").splitlines()
    port = str(wire().address[1])
    tshark = Terminal(*shlex.split(command[2:].replace("14551", port)), "-l", *FRAMES_FIRST, cwd=wireshark)
    ended.callback(tshark.close)
    tshark.wait_for(lambda text: "Capturing on" in text or tshark.process.poll() is not None, "start")
    if tshark.process.poll() is not None:
        pytest.skip(f"tshark may not capture here: {tshark.text.splitlines()[-1:]}")
    gate = gateway("udpin:127.0.0.1:0", "--out", f"udpout:127.0.0.1:{port}")
    autopilot(TELLING, gate.address)
    pieces = [re.escape(piece.strip("\n")) for piece in "\n".join(printed).split("...\n") if piece]
    status = re.compile(r"(?:(?!^Frame )[\s\S])*?".join(pieces), re.MULTILINE)
    tshark.wait_for(status.search, "status as the page shows it")


def test_tshark_dissects_every_field_on_any_port_and_ignores_other_data(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], wireshark: Path
) -> None:
    out = wire()
    gate = gateway("udpin:127.0.0.1:0", "--out", f"udpout:127.0.0.1:{out.address[1]}")
    rover = wire(gate.address, system=42).beating()
    out.wait_for("ROBOT_STATUS")
    rover.beat(armed=True, custom_mode=10)
    out.wait_for("ROBOT_STATUS", lambda m: m.drives_powered == 1)
    statuses = out.heard("ROBOT_STATUS")
    older = MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3).pack(MAVLink(None), force_mavlink1=True)
    datagrams = [heard.data for heard in statuses]
    datagrams += [older + statuses[0].data + older, statuses[0].data + b"more", statuses[0].data[:-1], b"\xfd\x01", b""]
    (wireshark / "traffic.pcap").write_bytes(pcap(datagrams))

    names = [name for name in statuses[0].message.to_dict() if name != "mavpackettype"]
    columns = [part for name in names for part in ("-e", f"mavlink_proto.ROBOT_STATUS_{name}")]
    command = "tshark -r traffic.pcap -X lua_script:dialect/mav_robot_status.lua -Y mavlink_proto -T fields".split()
    rows = subprocess.run(
        [*command, *FRAMES_FIRST, "-e", "_ws.col.Info", *columns],
        cwd=wireshark, capture_output=True, text=True, timeout=allow(30), check=True,
    ).stdout.splitlines()  # fmt: skip

    def row(info: str, message: Any) -> list[str | int]:
        return [info, *(getattr(message, name) for name in names)]

    read = [[info, *(int(value, 0) for value in values)] for info, *values in (line.split("\t") for line in rows)]
    assert read == [
        *(row("ROBOT_STATUS", heard.message) for heard in statuses),
        row("HEARTBEAT   ROBOT_STATUS   HEARTBEAT", statuses[0].message),
    ]


def pcap(datagrams: list[bytes]) -> bytes:
    """A capture file of UDP datagrams, a second apart, between ports that no one has registered."""
    host = socket.inet_aton("127.0.0.1")
    file = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, LINKTYPE_RAW)
    for second, datagram in enumerate(datagrams):
        udp = struct.pack(">HHHH", 20000, 20001, 8 + len(datagram), 0) + datagram
        ip = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, host, host) + udp
        file += struct.pack("<IIII", second, 0, len(ip), len(ip)) + ip
    return file
