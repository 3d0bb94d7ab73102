"""Pass-through: nobody is cut off, and nothing that is not believed and no key goes further."""

from __future__ import annotations

import hashlib
import stat
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.testing import decode
from tests.pymavlink_dialect import MAVLink, MAVLink_command_long_message, MAVLink_heartbeat_message

from ..deadline import wait_until
from .gateway_process import Gateway
from .wire import Wire

KEY = bytes(range(1, 33))
EPOCH_2015 = 1_420_070_400
GCS, INVALID = 6, 8
SETUP_SIGNING = 256
SECRET = bytes(range(100, 132))

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


def beat(number: int) -> MAVLink_heartbeat_message:
    """A heartbeat of a ground station."""
    return MAVLink_heartbeat_message(GCS, INVALID, 0, number, 4, 3)


@pytest.fixture
def key_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    return path


def signing(mav: MAVLink, key: bytes = KEY) -> MAVLink:
    """Let pymavlink sign what it packs."""
    mav.signing.secret_key = key
    mav.signing.sign_outgoing = True
    mav.signing.link_id = 3
    mav.signing.timestamp = int((time.time() - EPOCH_2015) * 1e5)
    return mav


def test_a_ground_station_that_comes_by_another_way_still_reaches_its_autopilot(
    gateway: StartGateway, wire: OpenWire
) -> None:
    """The autopilot passes the heartbeats of the ground station on to us. Then that way is silent."""
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward")
    rover = wire(gate.address).beating()
    rover.wait_for("ROBOT_STATUS")
    passed_on = MAVLink(None, srcSystem=255, srcComponent=190)
    for number in range(3):
        rover.send(beat(number).pack(passed_on))
    ground = wire(("127.0.0.1", gate.ports(2)[1]), system=255, component=190)
    number = 100

    def through() -> bool:
        nonlocal number
        number += 1
        ground.send(beat(number))
        time.sleep(0.2)
        return any(h.message.custom_mode == number for h in rover.heard("HEARTBEAT"))

    wait_until(through, what="no heartbeat of the ground station at the autopilot")
    number += 1
    ground.send(MAVLink_command_long_message(1, 1, 400, 0, number, 0, 0, 0, 0, 0, 0))
    rover.wait_for("COMMAND_LONG", lambda m: m.param1 == number)
    assert gate.stop() == 0


def until_through(sender: Wire, receiver: Wire, number: int) -> None:
    """Send heartbeats until one is forwarded. A listening link knows its peer only after the first one."""

    def through() -> bool:
        sender.send(beat(number))
        time.sleep(0.1)
        return any(h.message.custom_mode == number for h in receiver.heard("HEARTBEAT"))

    wait_until(through, what=f"heartbeat {number} is not forwarded")


@pytest.mark.parametrize("kind", ["udpin", "udpout"])
def test_what_is_not_believed_is_not_forwarded(
    gateway: StartGateway, wire: OpenWire, key_file: Path, kind: str
) -> None:
    ground = wire(None, system=255, component=190)
    out = "udpin:127.0.0.1:0" if kind == "udpin" else f"udpout:127.0.0.1:{ground.address[1]}"
    gate = gateway("udpin:127.0.0.1:0", "--out", out, "--forward", "--signing-key", str(key_file))
    rover = wire(gate.address)
    signing(rover.mav)
    signing(ground.mav)
    rover.beating()
    rover.wait_for("ROBOT_STATUS")
    if kind == "udpin":
        ground.to = "127.0.0.1", gate.ports(2)[1]
    else:
        ground.wait_for("HEARTBEAT")
    until_through(ground, rover, 1)
    strangers = [MAVLink(None, srcSystem=66), signing(MAVLink(None, srcSystem=67), hashlib.sha256(b"other").digest())]
    for sender, receiver in ((ground, rover), (rover, ground)):
        for stranger in strangers:
            sender.send(beat(66).pack(stranger))
        until_through(sender, receiver, 77)
        assert not [h for h in receiver.heard("HEARTBEAT") if h.message.custom_mode == 66]
    assert gate.stop() == 0


def test_a_signing_key_is_neither_recorded_nor_forwarded_and_only_the_group_reads_a_recording(
    gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    path = tmp_path / "flight.tlog"
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward", "--record", str(path))
    rover = wire(gate.address).beating()
    ground = wire(("127.0.0.1", gate.ports(2)[1]), system=255, component=190)
    until_through(ground, rover, 1)
    for system in (1, 0):
        payload = bytes(8) + bytes((system, system)) + SECRET
        ground.send(enclose(SETUP_SIGNING, payload, system=255, component=190, sequence=system))
    until_through(ground, rover, 7)
    assert not any(SECRET in h.data for h in rover.heard())
    assert gate.stop() == 0
    recorded = path.read_bytes()
    assert SECRET not in recorded
    assert any(m.get_type() == "HEARTBEAT" and m.custom_mode == 7 for m in decode(recorded))
    assert stat.S_IMODE(path.stat().st_mode) & 0o007 == 0
