"""Why a rover cannot be armed, and its faulty parts, through the installed command on a UDP socket."""

from __future__ import annotations

from collections.abc import Callable
from struct import pack
from typing import Any

import pytest

from mav_robot_status.mavlink.definitions import BatteryStatus, EscInfo, OpenDroneIdArmStatus, SysStatus
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import FakeAutopilot, ardurover

from .gateway_process import Gateway
from .wire import Wire

RUN_PREARM_CHECKS = 401
ALL = ["PreArm: 3D Accel calibration needed", "PreArm: GPS 1: Bad fix", "PreArm: Compass not calibrated"]
HEALTHY = SysStatus(0x1000000F, 0x1000000F, 0x1000000F, 0, 0, 0, 0, 0)


def reasons(status: dict[str, Any]) -> list[str | None]:
    return [inhibit["text"] for inhibit in status["inhibits"] if inhibit["name"] == "PREARM_FAILING"]


def say(wire: Wire, *messages: Any) -> None:
    for message in messages:
        sender = {"system": wire.mav.srcSystem, "component": wire.mav.srcComponent}
        wire.send(encode(message, **sender, sequence=wire.mav.seq))


@pytest.mark.slow
def test_a_rover_is_asked_once_and_every_reason_is_listed_until_it_ends(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = autopilot(ardurover.REASONS, gate.address)
    known = gate.wait_for(lambda s: reasons(s) == ALL, what="every reason", seconds=11)
    validate(known.status)
    left = gate.wait_for(lambda s: reasons(s) == ["Arm: Compass not calibrated"], known.at, "the last one", seconds=25)
    since = {i["text"]: i["since"] for i in known.status["inhibits"]}
    assert left.status["inhibits"][-1]["since"] == since["PreArm: Compass not calibrated"]
    gate.wait_for(lambda s: reasons(s) == [], after=left.at, what="a rover that can be armed", seconds=15)
    assert [m.command for m in rover.heard("COMMAND_LONG")].count(RUN_PREARM_CHECKS) == 1
    assert gate.stop() == 0


def test_a_passive_gateway_does_not_ask(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("--passive", "udpin:127.0.0.1:0")
    scenario = ardurover.REASONS._replace(streams={1: 2.0})
    rover = autopilot(scenario, gate.address)
    first = gate.wait_for(lambda s: reasons(s) == [None], what="failing checks").at
    gate.wait_for(lambda s: True, after=first + 5, what="five seconds", seconds=15)
    assert rover.heard() == []
    assert gate.stop() == 0


def test_faulty_parts_are_errors_until_they_report_no_fault(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], validate: Callable[[Any], None]
) -> None:
    gate = gateway("--passive", "udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    transmitter = wire(gate.address, component=236)

    started = gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED", what="the rover").at
    gate.wait_for(lambda s: True, after=started + 10.5, what="the end of the boot", seconds=20)
    for _ in range(2):
        say(rover, BatteryStatus(1, 1, 16), EscInfo(pack("<4H", 0, 32, 0, 0), 0, 4, 15))
    wrong = gate.wait_for(lambda s: s["error_code"] == 4007, what="the errors")
    validate(wrong.status)
    assert [(e["code"], e["text"]) for e in wrong.status["errors"]] == [
        (4007, "ESC 2: motor stuck"),
        (2014, "battery 2: over-temperature"),
    ]
    say(transmitter, OpenDroneIdArmStatus(1, b"no operator location"))
    refused = gate.wait_for(lambda s: reasons(s) == ["remote ID: no operator location"], what="the transmitter")
    validate(refused.status)
    say(rover, BatteryStatus(1, 1, 0), EscInfo(pack("<4H", 0, 0, 0, 0), 0, 4, 15), HEALTHY)
    gate.wait_for(lambda s: s["errors"] == [] and reasons(s) == [], after=refused.at, what="the end of the errors")
    assert gate.stop() == 0
