"""`--record`: received and sent frames in a file that ground stations open."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

from pymavlink import mavutil

from mav_robot_status.testing import FakeAutopilot, ardurover

from ..deadline import wait_until
from .gateway_process import Gateway, run

StartGateway = Callable[..., Gateway]
StartAutopilot = Callable[..., FakeAutopilot]


def kinds(log: Path) -> list[tuple[str, int]]:
    """What pymavlink's log reader finds: the name of each message and the component that sent it."""
    reader = mavutil.mavlink_connection(str(log), dialect="ardupilotmega")
    found = []
    while (message := reader.recv_match()) is not None:
        found.append((message.get_type(), message.get_srcComponent()))
    reader.close()
    return found


def test_a_recording_replays_as_it_was_live(gateway: StartGateway, autopilot: StartAutopilot, tmp_path: Path) -> None:
    log = tmp_path / "flight.tlog"
    gate = gateway("udpin:127.0.0.1:0", "--record", str(log))
    rover = autopilot(ardurover.READY, gate.address)
    gate.wait_for(lambda s: s["in_error"] is False)  # SYS_STATUS comes once it was asked for
    rover.arm()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    rover.disarm()
    gate.wait_for(lambda s: s["drives_powered"] is False, after=gate.lines[-1].at)
    assert gate.stop() == 0
    found = kinds(log)
    assert ("SYS_STATUS", 1) in found  # received
    assert ("HEARTBEAT", 192) in found  # sent
    replayed = run(str(log), "--changes-only", "-q")
    assert replayed.returncode == 0
    powered = [line.split('"drives_powered": ')[1][:4] for line in replayed.stdout.splitlines()]
    different = [value for n, value in enumerate(powered) if n == 0 or value != powered[n - 1]]
    known = [value for value in different if value != "null"]  # between the accepted command and the HEARTBEAT
    assert known[-3:] == ["fals", "true", "fals"]


def test_a_recording_survives_the_kill_of_its_process(
    gateway: StartGateway, autopilot: StartAutopilot, tmp_path: Path
) -> None:
    log = tmp_path / "flight.tlog"
    gate = gateway("udpin:127.0.0.1:0", "--record", str(log))
    rover = autopilot(ardurover.READY, gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    rover.arm()
    armed = gate.wait_for(lambda s: s["drives_powered"] is True)
    wait_until(lambda: len(kinds(log)) >= 4)  # the writer flushes once a second
    gate.wait_for_lines(1, after=armed.at)
    gate.process.send_signal(signal.SIGKILL)
    gate.wait_for_end()
    before = len(kinds(log))
    assert before >= 4
    with open(log, "ab") as torn:  # as if it had been killed while a record was being written
        torn.write(log.read_bytes()[:13])
    again = gateway("udpin:127.0.0.1:0", "--record", str(log))
    autopilot(ardurover.READY, again.address)
    again.wait_for(lambda s: s["drives_powered"] is False)
    assert again.stop() == 0
    assert len(kinds(log)) > before
    replayed = run(str(log), "--changes-only")
    assert replayed.returncode == 0
    assert "torn" not in replayed.stderr
    assert "garbage" not in replayed.stderr


def test_a_file_that_is_not_a_log_is_not_overwritten(tmp_path: Path) -> None:
    letter = tmp_path / "letter.txt"
    letter.write_text("Dear robot, " * 20)
    result = run("udpin:127.0.0.1:0", "--record", str(letter))
    assert result.returncode in (1, 2)
    assert str(letter) in result.stderr
    assert letter.read_text() == "Dear robot, " * 20
