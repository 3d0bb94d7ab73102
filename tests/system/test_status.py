"""From HEARTBEAT to JSON line, with the installed command."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, arducopter, ardurover

from ..deadline import in_time
from .gateway_process import Gateway, Line
from .wire import Wire

HANDLE = "industrial_robot_status_handle"


def says(armed: bool, mode: str, status: dict[str, Any]) -> bool:
    return status["drives_powered"] is armed and status["mode"] == mode


def test_arming_and_modes_are_in_a_line_within_50_ms_of_their_heartbeat(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address)
    rover.beat()
    first = gate.wait_for(lambda s: s["drives_powered"] is False)
    assert first.status["handle"] == HANDLE
    assert first.status["mode"] == "MANUAL"
    assert first.status["seq"] == 0
    late = []
    for armed, custom_mode, mode in (
        (False, 10, "AUTO"), (False, 0, "MANUAL"), (True, 10, "AUTO"), (True, 0, "MANUAL"), (True, 15, "AUTO"),
    ):  # fmt: skip
        sent = rover.beat(armed=armed, custom_mode=custom_mode)
        line = gate.wait_for(partial(says, armed, mode), after=sent)
        late.append(line.at - sent)
    assert in_time(min(late), 0.05)
    assert [line.status["seq"] for line in gate.lines] == list(range(len(gate.lines)))
    assert gate.stop() == 0
    assert not any("Traceback" in line for line in gate.log)


def test_a_failsafe_is_an_error_until_it_is_cleared(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    fake = autopilot(ardurover.READY, gate.address)
    gate.wait_for(lambda s: s["in_error"] is False)
    fake.arm()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    fake.set(failsafe=True)
    fake.say(4, "Radio Failsafe")
    error = gate.wait_for(lambda s: s["in_error"] is True and s["errors"][0]["text"] == "Radio Failsafe")
    assert error.status["error_code"] == error.status["errors"][0]["code"] != 0
    fake.set(failsafe=False)
    fake.say(6, "Radio Failsafe Cleared")
    cleared = gate.wait_for(lambda s: s["in_error"] is False, after=error.at)
    assert (cleared.status["error_code"], cleared.status["errors"]) == (0, [])
    for line in gate.lines:
        validate(line.status)


def test_the_safety_switch_inhibits_motion(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    fake = autopilot(arducopter.READY._replace(streams={1: 4.0, 245: 2.0}), gate.address)
    fake.set(safety_switch=True)
    held = gate.wait_for(lambda s: "SAFETY_SWITCH" in [i["name"] for i in s["inhibits"]])
    assert held.status["motion_possible"] is False
    fake.set(safety_switch=False)
    gate.wait_for(lambda s: "SAFETY_SWITCH" not in [i["name"] for i in s["inhibits"]], after=held.at)


def test_a_lost_link_makes_everything_unknown_after_3_5_s_and_the_lines_keep_coming(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address)
    last = rover.beat(armed=True, custom_mode=10)
    gate.wait_for(lambda s: s["drives_powered"] is True)
    lost = gate.wait_for(lambda s: s["link"]["state"] == "LOST")
    assert lost.at - last > 3.4
    assert in_time(lost.at - last - 3.5, 0.3)
    status = lost.status
    fields = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error", "error_code")
    assert [status[f] for f in fields] == ["UNKNOWN", None, None, None, None, None, 0]
    assert [i["name"] for i in status["inhibits"]] == ["LINK_STALE"]
    assert status["vehicle"] == {
        "autopilot": "ARDUPILOTMEGA", "type": "GROUND_ROVER", "flight_mode": None, "custom_mode": None, "state": None,
    }  # fmt: skip
    assert gate.wait_for_lines(6, after=lost.at).stamp - lost.stamp > 0.4  # at 10 Hz
    again = rover.beat()
    back = gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED", after=again)
    assert in_time(back.at - again, 1.0)
    assert back.status["drives_powered"] is True
    for line in gate.lines:
        validate(line.status)


@pytest.mark.parametrize(("arguments", "rate"), [((), 10.0), (("--rate", "2"), 2.0)])
def test_lines_keep_the_chosen_rate(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], arguments: tuple[str, ...], rate: float
) -> None:
    gate = gateway("udpin:127.0.0.1:0", *arguments)
    wire(gate.address).beating()
    gate.wait_for(lambda s: s["seq"] >= 4)
    periods = sorted(b.stamp - a.stamp for a, b in pairwise(gate.lines))
    period = periods[len(periods) // 2]
    assert period > 0.7 / rate
    assert in_time(period, 1.3 / rate)


def test_changes_only_gives_a_line_for_each_change_and_no_other(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--changes-only")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["mode"] == "MANUAL")
    rover.wait_for("ROBOT_STATUS", after=time.monotonic(), count=2)  # one a second, whatever changes
    rover.beat(custom_mode=10)
    gate.wait_for(lambda s: s["mode"] == "AUTO")
    assert all(timeless(a) != timeless(b) for a, b in pairwise(gate.lines))


def timeless(line: Line) -> dict[str, Any]:
    """What counts as a change."""
    return {**line.status, "stamp": "", "seq": 0, "link": line.status["link"]["state"]}


def test_two_vehicles_on_one_port_have_two_handles(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    wire(gate.address, system=7).beat()
    gate.wait_for(lambda s: s["system"] == 7)
    wire(gate.address, system=9).beat(armed=True)
    second = gate.wait_for(lambda s: s["system"] == 9)
    assert second.status["handle"] == f"{HANDLE}/9.1"
    assert second.status["seq"] == 0
    assert {line.status["handle"] for line in gate.lines if line.status["system"] == 7} == {f"{HANDLE}/7.1"}


def test_vehicle_1_1_has_the_plain_handle_although_a_forger_was_heard_first(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    wire(gate.address, system=66).beat()
    forged = gate.wait_for(lambda s: s["system"] == 66)
    assert forged.status["handle"] == f"{HANDLE}/66.1"
    wire(gate.address).beat()
    assert gate.wait_for(lambda s: s["system"] == 1).status["handle"] == HANDLE
    assert {line.status["system"] for line in gate.lines if line.status["handle"] == HANDLE} == {1}


def test_the_chosen_system_has_lines_from_the_start_and_others_are_ignored(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--system", "5")
    first = gate.wait_for(lambda s: True)
    assert first.status["link"] == {"state": "NEVER_SEEN", "heartbeat_age": None}
    assert (first.status["system"], first.status["component"]) == (5, None)
    assert first.status["handle"] == HANDLE
    validate(first.status)
    wire(gate.address, system=4).beat()
    wire(gate.address, system=5).beat()
    gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    assert {line.status["system"] for line in gate.lines} == {5}


def test_a_named_vehicle_has_its_name_in_each_line_and_others_are_served_too(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], validate: Callable[[Any], None], tmp_path: Path
) -> None:
    config = tmp_path / "names.yaml"
    config.write_text("vehicles: [{system: 1, name: Rover-A}]")
    gate = gateway("udpin:127.0.0.1:0", "--config", str(config), "--name", "2.1=Boot Süd")
    for system in (1, 2, 3):
        wire(gate.address, system=system).beat()
    lines = [gate.wait_for(lambda s, system=system: s["system"] == system) for system in (1, 2, 3)]  # type: ignore[misc]
    assert [line.status["vehicle"].get("name") for line in lines] == ["Rover-A", "Boot Süd", None]
    assert "name" not in lines[2].status["vehicle"]
    for line in lines:
        validate(line.status)


def test_a_configuration_with_two_vehicles_and_two_controllers_on_a_handle(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], tmp_path: Path
) -> None:
    other = tmp_path / "slow.jsonl"
    config = tmp_path / "two.yaml"
    config.write_text(f"""
links: ["udpin:127.0.0.1:0"]
vehicles:
  - {{system: 1, handle: rover}}
  - {{system: 2, handle: copter}}
fast:
  type: mav_robot_status/IndustrialRobotStatusController
  handle_name: rover
  publish_rate: 20
  publishers: [json]
slow:
  type: industrial_robot_status_controller/IndustrialRobotStatusController
  handle_name: rover
  publish_rate: 2
  publishers: [{{type: json, path: {other}, format: ros2}}, mavlink]
copter: {{type: mav_robot_status/IndustrialRobotStatusController, handle_name: copter, publishers: [json]}}
""")
    gate = gateway("--config", str(config))
    rover = wire(gate.address)
    wire(gate.address, system=2).beat()
    rover.beat(armed=True)
    gate.wait_for(lambda s: s["handle"] == "rover" and s["drives_powered"] is True)
    gate.wait_for(lambda s: s["handle"] == "copter" and s["drives_powered"] is False)
    rover.wait_for("ROBOT_STATUS", lambda m: m.drives_powered == 1)
    assert gate.stop() == 0
    assert '"error_codes": []' in other.read_text("utf-8")


def test_ipv6(gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
            probe.bind(("::1", 0))
    except OSError:
        pytest.skip("this machine has no IPv6")
    gate = gateway("udpin:[::1]:0")
    rover = wire(("::1", gate.port))
    rover.beat()
    gate.wait_for(lambda s: s["mode"] == "MANUAL")
    rover.wait_for("ROBOT_STATUS")
