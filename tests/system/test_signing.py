"""MAVLink 2 signing on the installed command, with pymavlink at the other end."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.pymavlink_dialect import MAVLink, MAVLink_command_long_message, MAVLink_heartbeat_message

from .gateway_process import Gateway, run
from .wire import Wire

KEY = bytes(range(1, 33))
OTHER_KEY = hashlib.sha256(b"another").digest()
EPOCH_2015 = 1_420_070_400
REQUEST_MESSAGE, ROBOT_STATUS = 512, 59900

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    return path


def signing(mav: Any, key: bytes = KEY, stamp: float | None = None) -> None:
    """Let pymavlink sign what it packs."""
    mav.signing.secret_key = key
    mav.signing.sign_outgoing = True
    mav.signing.link_id = 3
    mav.signing.timestamp = int(((time.time() if stamp is None else stamp) - EPOCH_2015) * 1e5)


def heartbeat(armed: bool) -> Any:
    return MAVLink_heartbeat_message(10, 3, 65 | 128 * armed, 0, 4, 3)


def test_a_signed_link_works_in_both_directions(gateway: StartGateway, wire: OpenWire, key_file: Path) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav)
    rover.beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    heard = rover.wait_for("ROBOT_STATUS")
    checking = MAVLink(None)
    signing(checking)
    checking.signing.sign_outgoing = False
    messages = checking.parse_buffer(heard.data) or []
    assert [m.get_type() for m in messages] == ["ROBOT_STATUS"]
    assert messages[0].get_signed()
    strict = MAVLink(None)
    signing(strict, OTHER_KEY)
    strict.robust_parsing = True
    assert [m.get_type() for m in strict.parse_buffer(heard.data) or []] == ["BAD_DATA"]
    assert gate.stop() == 0
    assert any("signing:" in line and "verified" in line for line in gate.log)


@pytest.mark.parametrize(
    ("what", "counted"),
    [("unsigned", "refused unsigned"), ("another key", "forged"), ("replayed", "replayed"), ("far future", "forged")],
)
def test_badly_signed_frames_are_refused_and_counted(
    gateway: StartGateway, wire: OpenWire, key_file: Path, what: str, counted: str
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav)
    first = heartbeat(armed=False).pack(rover.mav)
    rover.send(first)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    hostile = MAVLink(None, srcSystem=1, srcComponent=1)
    if what == "another key":
        signing(hostile, OTHER_KEY)
    bad = heartbeat(armed=True).pack(hostile)
    if what == "replayed":
        bad = first
    elif what == "far future":  # its time stamp would lock the real vehicle out if it were believed
        whole = bytearray(heartbeat(armed=True).pack(rover.mav))
        whole[-12:-6] = b"\xff" * 6
        bad = bytes(whole)
    for _ in range(5):
        rover.send(bad)
    rover.beat(armed=False)
    gate.wait_for_lines(5, after=rover.beat(armed=False))
    assert not any(line.status["drives_powered"] for line in gate.lines)
    sent = rover.beat(armed=True)  # the real one is still heard
    gate.wait_for(lambda s: s["drives_powered"] is True, after=sent)
    assert gate.stop() == 0
    assert any("signing:" in line and counted in line for line in gate.log), gate.log[-3:]


def test_an_autopilot_without_the_time_learns_it_from_us(gateway: StartGateway, wire: OpenWire, key_file: Path) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav, stamp=time.time() - 86_400)
    rover.beat()
    ours = rover.wait_for("HEARTBEAT")
    assert gate.lines == []
    rover.mav.signing.timestamp = int.from_bytes(ours.data[-12:-6], "little")
    rover.beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    assert gate.stop() == 0


def test_what_was_recorded_before_a_restart_does_not_speak_for_a_silent_vehicle(
    gateway: StartGateway, wire: OpenWire, key_file: Path
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav)
    recorded = []
    for _ in range(5):
        recorded.append(heartbeat(armed=False).pack(rover.mav))
        rover.send(recorded[-1])
    gate.wait_for(lambda s: s["drives_powered"] is False)
    assert gate.stop() == 0
    again = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    elsewhere = wire(again.address)
    for data in recorded:
        elsewhere.send(data)
    healing = elsewhere.wait_for("HEARTBEAT")  # the answer to a vehicle that is behind
    assert again.lines == []
    rover = wire(again.address)  # armed meanwhile
    signing(rover.mav)
    rover.mav.signing.timestamp = int.from_bytes(healing.data[-12:-6], "little")
    rover.beat(armed=True)
    again.wait_for(lambda s: s["drives_powered"] is True)
    assert not any(line.status["drives_powered"] is False for line in again.lines)
    assert again.stop() == 0
    assert any("signing:" in line and "behind our time or what was heard before" in line for line in again.log)


def test_an_unsigned_link_may_not_command_us(gateway: StartGateway, wire: OpenWire, key_file: Path) -> None:
    config = key_file.with_name("config.yaml")
    config.write_text(f"signing: {{key_file: {key_file}, accept_unsigned: all}}\n")
    gate = gateway("udpin:127.0.0.1:0", "--config", str(config), "--json", "none")
    rover = wire(gate.address).beating()
    rover.wait_for("ROBOT_STATUS")
    ask = MAVLink_command_long_message(1, 192, REQUEST_MESSAGE, 0, ROBOT_STATUS, 0, 0, 0, 0, 0, 0)
    rover.send(ask)
    rover.wait_for("HEARTBEAT", after=rover.beat(), count=2)
    assert not rover.heard("COMMAND_ACK")
    signing(rover.mav)
    rover.send(ask)
    assert rover.wait_for("COMMAND_ACK").message.result == 0
    assert gate.stop() == 0


def test_a_key_file_that_others_can_read_is_rejected(key_file: Path) -> None:
    key_file.chmod(0o644)
    result = run("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    assert result.returncode == 2
    assert f"chmod 600 {key_file}" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert KEY.hex() not in result.stderr


def test_a_passphrase_is_a_key(gateway: StartGateway, wire: OpenWire, key_file: Path) -> None:
    key_file.write_text("passphrase: correct horse\n")
    gate = gateway("udpin:127.0.0.1:0", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav, hashlib.sha256(b"correct horse").digest())
    rover.beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    assert gate.stop() == 0
