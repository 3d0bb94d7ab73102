"""A vehicle behind a satellite, with the installed command: a live link, its recording, `doctor` and `explain`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, Scenario, ardurover, px4
from mav_robot_status.testing.scenario import by_satellite

from ..deadline import wait_until
from .conftest import record
from .gateway_process import Gateway, run

StartGateway = Callable[..., Gateway]
StartAutopilot = Callable[..., FakeAutopilot]

ROVER, QUAD = by_satellite(ardurover.READY, hz=4.0), by_satellite(px4.READY, hz=4.0)
HERE = "udpin:127.0.0.1:0"
NOT_TOLD = ("e_stopped", "in_motion", "in_error")


def lines(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


@pytest.mark.parametrize("scenario", [ROVER, QUAD], ids=["ardupilot", "px4"])
def test_it_has_a_status_and_its_recording_replays_to_the_same_with_its_age(
    gateway: StartGateway,
    autopilot: StartAutopilot,
    tmp_path: Path,
    validate: Callable[[Any], None],
    scenario: Scenario,
) -> None:
    log = tmp_path / "flight.tlog"
    gate = gateway(HERE, "--record", str(log))
    vehicle = autopilot(scenario, gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is (False if scenario is ROVER else None) and s["mode"] == "MANUAL")
    vehicle.arm()
    if scenario is ROVER:
        gate.wait_for(lambda s: s["drives_powered"] is True)
    gate.wait_for_lines(20, after=gate.lines[-1].at)
    vehicle.silence()
    gate.wait_for(lambda s: (s["link"]["heartbeat_age"] or 0) > 2)
    assert gate.stop() == 0
    assert vehicle.heard() == []  # a satellite link charges for every byte
    done = run(str(log))
    assert done.returncode == 0, done.stderr
    replayed = [s for s in lines(done.stdout) if s["link"]["state"] == "CONNECTED"]
    assert {s["drives_powered"] for s in replayed} == ({False, True} if scenario is ROVER else {None})
    for status in replayed:
        validate(status)
        assert [status[name] for name in NOT_TOLD] == [None, None, None]
        assert status["vehicle"]["state"] is None
        assert 0 <= status["link"]["heartbeat_age"] < 60
        assert status["motion_possible"] is (False if status["drives_powered"] is False else None)


def satellite_log(scenario: Scenario, seconds: float, tmp_path: Path) -> str:
    path = tmp_path / "satellite.tlog"
    path.write_bytes(record(scenario, seconds))
    return str(path)


@pytest.mark.parametrize(
    ("scenario", "ages", "modes"),
    [(ardurover.SATELLITE, 5.0, {"MANUAL", "AUTO"}), (px4.SATELLITE, 67.0, {"MANUAL", "AUTO"})],
    ids=["ardupilot", "px4"],
)
def test_at_the_real_rates_the_age_grows_to_the_next_message_and_the_link_lasts(
    tmp_path: Path, scenario: Scenario, ages: float, modes: set[str]
) -> None:
    done = run(satellite_log(scenario, 3 * ages + 2, tmp_path), "--rate", "1")
    statuses = lines(done.stdout)
    assert {s["link"]["state"] for s in statuses if s["link"]["heartbeat_age"] is not None} == {"CONNECTED"}
    assert max(s["link"]["heartbeat_age"] or 0.0 for s in statuses) == pytest.approx(ages, abs=1.1)
    assert {s["mode"] for s in statuses} - {"UNKNOWN"} <= modes
    assert not any(s["in_motion"] is False for s in statuses)


def test_doctor_says_what_it_means(tmp_path: Path) -> None:
    done = run("doctor", satellite_log(ardurover.SATELLITE, 30, tmp_path))
    assert done.returncode == 0
    assert "1.1 is heard only through HIGH_LATENCY2" in done.stdout
    assert "[high-latency]" in done.stdout
    assert "rates: HIGH_LATENCY2 0.2 Hz" in done.stdout
    assert "missing:" not in done.stdout


def test_explain_names_the_message(tmp_path: Path) -> None:
    done = run("explain", satellite_log(ardurover.SATELLITE, 30, tmp_path))
    assert "HIGH_LATENCY2 does not show an emergency stop" in done.stdout
    assert "HIGH_LATENCY2: custom_mode" in done.stdout


def test_a_link_has_its_own_time_out(gateway: StartGateway, autopilot: StartAutopilot, tmp_path: Path) -> None:
    config = tmp_path / "satellite.yaml"
    config.write_text('links:\n  - {url: "udpin:127.0.0.1:0", heartbeat_timeout: 2 s}\n')
    gate = gateway("--config", str(config))
    vehicle = autopilot(QUAD, gate.address)
    gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    vehicle.silence()
    lost = gate.wait_for(lambda s: s["link"]["state"] == "LOST")
    assert lost.status["link"]["heartbeat_age"] == pytest.approx(2.0, abs=0.5)
    assert lost.status["mode"] == "UNKNOWN"


def test_heartbeats_that_come_count_at_once_and_are_asked_about(
    gateway: StartGateway, autopilot: StartAutopilot
) -> None:
    gate = gateway(HERE)
    satellite = autopilot(ROVER, gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False and s["vehicle"]["state"] is None)
    radio = autopilot(ardurover.READY, gate.address)
    gate.wait_for(lambda s: s["vehicle"]["state"] == "ACTIVE")
    wait_until(lambda: len(radio.heard("COMMAND_LONG")) > 0)
    assert satellite.heard() == []


def test_a_forged_message_does_not_make_a_live_rover_look_safe(
    gateway: StartGateway, autopilot: StartAutopilot
) -> None:
    gate = gateway(HERE)
    rover = autopilot(ardurover.READY, gate.address)
    rover.arm()
    live = gate.wait_for(lambda s: s["drives_powered"] is True)
    forger = autopilot(ROVER, gate.address)  # disarmed
    gate.wait_for_lines(40, after=live.at)
    said = [line.status for line in gate.lines if line.at > live.at]
    assert forger.heard() == []
    assert not [s for s in said if s["drives_powered"] is False or s["motion_possible"] is False]


def test_on_a_link_that_sends_first_it_is_silent_once_it_hears_one(
    gateway: StartGateway, autopilot: StartAutopilot
) -> None:
    vehicle = FakeAutopilot(QUAD)
    with vehicle:
        gate = gateway(f"udpout:127.0.0.1:{vehicle.address[1]}")
        gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
        time.sleep(1.5)  # a heartbeat may be on its way
        before = len(vehicle.heard())
        gate.wait_for_lines(30, after=gate.lines[-1].at)
        assert len(vehicle.heard()) == before >= 1
