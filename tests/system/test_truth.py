"""Codes, reboots and versions, with the installed command."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.mavlink.definitions import Event
from mav_robot_status.testing import FakeAutopilot, Scenario, arducopter, ardurover, px4, step
from mav_robot_status.testing.scenario import RC_RECEIVER
from mav_robot_status.testing.vehicle_model import Outgoing, VehicleModel

from .conftest import record
from .gateway_process import Gateway, run

BATTERY = 1 << 25
BOOT = 10.0
"""Seconds after the boot in which sensors raise no error: events of these tests are later."""


def replayed(path: Path, log: bytes) -> list[dict[str, Any]]:
    """The lines of a replay, at 10 Hz."""
    path.write_bytes(log)
    done = run(str(path))
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def played(
    path: Path, *steps: Any, scenario: Scenario = ardurover.READY, seconds: float = 40.0
) -> list[dict[str, Any]]:
    """The lines of a replay of a vehicle in MANUAL that is armed 10 s after its boot."""
    streams = {1: 4.0, 2: 1.0, 30: 4.0, 33: 4.0, 245: 2.0}
    armed = step(BOOT, "armed", armed=True)
    return replayed(path, record(scenario._replace(steps=(armed, *steps), streams=streams), seconds))


def codes(lines: list[dict[str, Any]], begin: float, end: float) -> set[int]:
    """The codes in the lines of this time, seconds since the first line."""
    return {line["error_code"] for line in lines if begin <= float(line["seconds"]) <= end}


@pytest.fixture
def play(tmp_path: Path) -> Callable[..., list[dict[str, Any]]]:
    def lines(*steps: Any, **how: Any) -> list[dict[str, Any]]:
        found = played(tmp_path / "truth.tlog", *steps, **how)
        for line in found:
            minutes, seconds = line["stamp"][14:-1].split(":")
            line["seconds"] = int(minutes) * 60 + float(seconds)
        return found

    return lines


HEALTH = ardurover.READY.start.sensors_health


@pytest.mark.parametrize("cleared", ["Radio Failsafe Cleared", "GCS Failsafe Cleared"])
def test_a_rover_that_names_its_healthy_radio_has_lost_its_ground_station(
    play: Callable[..., list[dict[str, Any]]], cleared: str
) -> None:
    lines = play(
        step(15.0, "lost", (4, "Radio Failsafe"), failsafe=True, custom_mode=4),
        step(25.5, "back", (6, cleared), failsafe=False),
    )
    assert codes(lines, 15.2, 25.3) == {2002}
    assert codes(lines, 25.7, 39.0) == {0}


def test_a_rover_that_has_lost_its_radio_says_so(play: Callable[..., list[dict[str, Any]]]) -> None:
    lines = play(
        step(13.5, "no radio", sensors_health=HEALTH & ~RC_RECEIVER),
        step(15.0, "lost", (4, "Radio Failsafe"), failsafe=True, custom_mode=4),
        step(25.5, "back", (6, "Radio Failsafe Cleared"), failsafe=False, sensors_health=HEALTH),
    )
    assert codes(lines, 15.2, 25.3) == {2001}
    assert codes(lines, 26.0, 39.0) == {0}


def test_a_rover_that_does_not_show_its_radio_has_a_failsafe_of_either_kind(
    play: Callable[..., list[dict[str, Any]]],
) -> None:
    hidden: Any = dict.fromkeys(("sensors_present", "sensors_enabled", "sensors_health"), HEALTH & ~RC_RECEIVER)
    lines = play(
        step(11.0, "a firmware that does not report its radio", **hidden),
        step(15.0, "lost", (4, "Radio Failsafe"), failsafe=True, custom_mode=4),
        step(25.5, "back", (6, "GCS Failsafe Cleared"), failsafe=False),
    )
    assert codes(lines, 15.2, 25.3) == {2000}
    assert codes(lines, 25.7, 39.0) == {0}


def test_a_text_that_ends_a_failsafe_is_believed_at_once(play: Callable[..., list[dict[str, Any]]]) -> None:
    lines = play(
        step(15.0, "lost", (4, "GCS Failsafe"), failsafe=True),
        # between two heartbeats: the state in the last one is still CRITICAL
        step(25.2, "back", (6, "GCS Failsafe Cleared"), failsafe=False),
        scenario=arducopter.READY,
    )
    assert codes(lines, 15.2, 25.1) == {2002}
    assert codes(lines, 25.4, 39.0) == {0}


@pytest.mark.parametrize(("text", "code"), [("Battery 1 is low", 2003), ("Battery 1 is critical", 2004)])
def test_a_battery_cause_stays_exact_while_the_battery_is_low(
    play: Callable[..., list[dict[str, Any]]], text: str, code: int
) -> None:
    low = step(15.0, "low", (4, f"{text} 10.50V used 1500 mAh"), sensors_health=HEALTH & ~BATTERY)
    lines = play(low, step(35.0, "charged", sensors_health=HEALTH))
    assert codes(lines, 15.2, 34.9) == {code}
    assert codes(lines, 36.5, 39.0) == {0}


def test_the_event_of_a_failsafe_ends_with_it(tmp_path: Path) -> None:
    scenario = px4.READY._replace(
        steps=(step(BOOT, "armed", armed=True), step(15.0, "", failsafe=True), step(18.0, "", failsafe=False))
    )
    start = Instant(0.0, 1_800_000_000_000_000)
    model = VehicleModel(scenario, start.mono)
    log, sequence = b"", 0
    for tick in range(30 * 50):
        now = later(start, tick / 50)
        out = model.run(now)
        if tick == 15 * 50:
            out.append(Outgoing(Event(1 << 24, 15_000, 1, 0, 0, 0x22, b""), 0))
        for outgoing in out:
            sequence = (sequence + 1) % 256
            log += now.unix_us.to_bytes(8, "big") + outgoing._replace(seq=sequence).frame()
    lines = replayed(tmp_path / "event.tlog", log)
    at = {round(float(line["stamp"][17:-1]), 1): [error["code"] for error in line["errors"]] for line in lines}
    assert at[16.5] == [2000, 7002]
    assert [found for seconds, found in at.items() if 19.2 < seconds < 24 and found] == []


@pytest.mark.slow
def test_packets_that_a_tunnel_repeats_are_not_a_reboot(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    fake = autopilot(ardurover.REPEATED_PACKETS, gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    fake.arm()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    fake.say(0, "Crash: Going to HOLD")
    crashed = gate.wait_for(lambda s: s["error_code"] == 4001)
    last = gate.wait_for(lambda s: s["seq"] > crashed.status["seq"] + 180, seconds=40)
    assert {line.status["error_code"] for line in gate.lines if crashed.at <= line.at <= last.at} == {4001}
    gate.stop()
    assert not any("rebooted" in line for line in gate.log)


def test_packets_repeated_in_a_log_are_not_a_reboot(tmp_path: Path) -> None:
    crash = step(12.0, "a crash", (0, "Crash: Going to HOLD"), custom_mode=4)
    scenario = ardurover.REPEATED_PACKETS._replace(steps=(step(3.0, "armed", armed=True), crash))
    lines = replayed(tmp_path / "repeats.tlog", record(scenario, 40.0))
    assert {line["error_code"] for line in lines if 12.2 < float(line["stamp"][17:-1]) < 39} == {4001}


@pytest.mark.slow
def test_the_version_of_the_firmware_is_asked_for_and_shown(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    fake = autopilot(ardurover.READY, gate.address)
    first = gate.wait_for(lambda s: s["drives_powered"] is False)
    assert "firmware" not in first.status["vehicle"]
    known = gate.wait_for(lambda s: s["vehicle"].get("firmware") == "4.5.6")
    validate(known.status)
    asked = [m for m in fake.heard("COMMAND_LONG") if (m.command, m.param1) == (512, 148)]
    assert len(asked) == 1
    fake.reboot()
    forgotten = gate.wait_for(lambda s: s["drives_powered"] is False and "firmware" not in s["vehicle"], after=known.at)
    gate.wait_for(lambda s: s["vehicle"].get("firmware") == "4.5.6", after=forgotten.at)
