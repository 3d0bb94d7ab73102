"""What is asked of an autopilot, and under which identity: again after a reboot, never slower, never as its station."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import FakeAutopilot, arducopter

from ..ports import free_port
from .gateway_process import Gateway, run
from .wire import Wire

ATTITUDE, SET_MESSAGE_INTERVAL = 30, 511
TEN_HZ = 100_000  # us
GCS = 6


def knows_motion(status: dict[str, object]) -> bool:
    return status["in_motion"] is False and status["in_error"] is False


@pytest.mark.slow  # it looks for missing messages three times, 30 s apart, and then not again without a reason
def test_a_copter_that_is_ready_at_once_after_a_reboot_is_asked_again_and_its_old_errors_end(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    copter = autopilot(arducopter.QUICK_REBOOT, gate.address)
    began = gate.wait_for(knows_motion, what="motion and errors", seconds=20).at
    gate.wait_for(knows_motion, after=began + 68, seconds=80)
    copter.arm()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    copter.say(2, "Potential Thrust Loss (1)")
    gate.wait_for(lambda s: s["error_code"] == 4003, what="the error")
    sent = time.monotonic()
    copter.reboot()
    rebooted = gate.wait_for(lambda s: s["drives_powered"] is False, after=sent, what="the new run").at
    ended = gate.wait_for(lambda s: all(error["code"] != 4003 for error in s["errors"]), rebooted, seconds=30)
    assert ended.at - rebooted < 10
    unknown = gate.wait_for(lambda s: s["in_motion"] is None, after=rebooted, what="the end of the streams")
    again = gate.wait_for(lambda s: s["in_motion"] is False, unknown.at, "motion after the reboot", seconds=30)
    gate.wait_for(lambda s: s["in_error"] is not None, after=again.at, what="errors after the reboot", seconds=30)
    assert gate.stop() == 0


@pytest.mark.slow
def test_the_rates_of_streams_that_begin_late_are_not_lowered(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    copter = autopilot(arducopter.LATE_STREAMS, gate.address)
    known = gate.wait_for(knows_motion, what="motion and errors", seconds=30).at
    gate.wait_for(knows_motion, after=known + 4, seconds=30)
    requested = [
        m.param2 for m in copter.heard("COMMAND_LONG") if m.command == SET_MESSAGE_INTERVAL and m.param1 == ATTITUDE
    ]
    assert all(interval <= TEN_HZ for interval in requested)


@pytest.mark.parametrize("command", [("check-config",), ("--config",)])
def test_the_id_of_ground_stations_is_refused_in_one_line(command: tuple[str, ...], tmp_path: Path) -> None:
    config = tmp_path / "station.yaml"
    config.write_text("links: [udpin:127.0.0.1:0]\nidentity: {system: 255}\n", encoding="ascii")
    done = run(*command, str(config))
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert f"{config}:2:20: " in line
    assert "SYSID_MYGCS" in line


def test_no_heartbeat_is_sent_with_the_id_of_a_ground_station_that_is_heard(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], tmp_path: Path
) -> None:
    station = wire(system=77, component=190)
    config = tmp_path / "station.yaml"
    config.write_text(
        f"links: [udpin:127.0.0.1:0]\nidentity: {{system: 77}}\nouts: ['udpout:127.0.0.1:{station.address[1]}']\n",
        encoding="ascii",
    )
    gate = gateway("--config", str(config))
    rover = wire(gate.address).beating()
    rover.wait_for("HEARTBEAT", lambda m: m.get_srcSystem() == 77)
    # the ground station is heard through the vehicle's router
    rover.send(encode(Heartbeat(0, GCS, 8, 0, 4, 3), system=77, component=190, sequence=0))
    gate.wait_for_log("a ground station uses this id")
    since = time.monotonic()
    rover.wait_for("ROBOT_STATUS", after=since + 3)
    assert not [one for one in rover.heard("HEARTBEAT") if one.at > since]
    assert sum("a ground station uses this id" in line for line in gate.log) == 1


@pytest.mark.slow
def test_explain_waits_for_the_parameters_of_a_live_copter(
    autopilot: Callable[..., FakeAutopilot], free_port: int
) -> None:
    autopilot(arducopter.READY, ("127.0.0.1", free_port))
    done = run("explain", "--as-json", f"udpin:127.0.0.1:{free_port}")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["fields"]["e_stopped"]["value"] is False
    assert "waiting up to" in done.stderr
    assert "no answer yet from vehicle 1.1" in done.stderr  # this copter has no RC5_OPTION


@pytest.fixture(name="free_port")
def fixture_free_port() -> int:
    return free_port()
