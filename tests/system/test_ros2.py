"""ROS 2 through the installed command: what subscribers of others receive, and what happens when the network fails."""

from __future__ import annotations

import contextlib
import json
import signal
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.interface import RobotMode
from mav_robot_status.publishers.ros.messages import ROBOT_STATUS
from mav_robot_status.publishers.ros.settings import read_url
from mav_robot_status.publishers.ros.transport import Sample
from mav_robot_status.testing import Scenario, ardurover
from mav_robot_status.testing.firmwares import ARDUROVER
from mav_robot_status.testing.scenario import RC_RECEIVER, Action, step

from ..deadline import wait_until
from ..loopback import LOOPBACK
from ..ports import free_port
from .gateway_process import Gateway, run
from .ros2_network import NO_DDS, NO_FAST_DDS, NO_ZENOH, Program, build_fast_dds_reader, tokens
from .ros2_programs import TRI_STATES, of_ros

OVER_ZENOH = pytest.mark.skipif(NO_ZENOH is not None, reason=str(NO_ZENOH))
OVER_DDS = pytest.mark.skipif(NO_DDS is not None, reason=str(NO_DDS))
DOMAIN = 77
Start = Callable[..., Any]

DRIVE = Scenario(
    "armed, a mission, a failsafe, silence",
    ARDUROVER,
    ARDUROVER.ready,
    steps=(
        step(2.0, "armed", armed=True),
        step(3.5, "a mission", custom_mode=10, velocity=(2.0, 0.0, 0.0), throttle=40),
        step(
            5.0,
            "a failsafe",
            (4, "Radio Failsafe"),
            custom_mode=4,
            failsafe=True,
            sensors_health=ARDUROVER.ready.sensors_health & ~RC_RECEIVER,
            velocity=(0.0, 0.0, 0.0),
        ),
        step(7.0, "the link is cut", action=Action.SILENCE),
    ),
)


@pytest.fixture
def program(ended: contextlib.ExitStack) -> Start:
    return lambda *arguments: ended.enter_context(contextlib.closing(Program(*map(str, arguments))))


@pytest.fixture
def router(program: Start) -> tuple[Program, int]:
    port = free_port()
    return program("router", port), port


@pytest.fixture(autouse=True)
def _nothing_leaves_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def started(gateway: Start, url: str, *more: str) -> Gateway:
    made: Gateway = gateway("udp:127.0.0.1:0", "--changes-only", "--ros2", url, *more)
    return made


# -- what arrives ----------------------------------------------------------------------------------------------------


@OVER_ZENOH
def test_a_subscriber_over_zenoh_gets_every_change_in_order(
    gateway: Start, autopilot: Start, program: Start, router: tuple[Program, int]
) -> None:
    viewer = program("zenoh", router[1])
    running = started(gateway, f"zenoh://127.0.0.1:{router[1]}")
    running.wait_for_log("Zenoh router .*: connected")
    _gets_every_change(running, viewer, autopilot)


@pytest.mark.slow
@OVER_DDS
def test_a_reader_over_dds_gets_every_change_in_order(gateway: Start, autopilot: Start, program: Start) -> None:
    viewer = program("dds", DOMAIN)
    running = started(gateway, f"dds://{DOMAIN}")
    running.wait_for_log("DDS domain 77: connected")
    _gets_every_change(running, viewer, autopilot)


@pytest.mark.slow
@pytest.mark.skipif(NO_FAST_DDS is not None, reason=str(NO_FAST_DDS))
def test_a_reader_of_fast_dds_gets_the_bytes_of_every_change(
    gateway: Start, autopilot: Start, ended: contextlib.ExitStack, tmp_path: Path
) -> None:
    from mav_robot_status.publishers.ros.dds_types import TYPES

    domain = DOMAIN + 2
    command = (build_fast_dds_reader(tmp_path), str(domain), "rt/robot_status", ROBOT_STATUS.dds_name)
    viewer = ended.enter_context(contextlib.closing(Program(command=command)))
    running = started(gateway, f"dds://{domain}")
    autopilot(DRIVE, running.address)
    final = running.wait_for(lambda line: line["link"]["state"] == "LOST", seconds=30)

    def statuses() -> list[dict[str, Any]]:
        return [of_ros(TYPES["RobotStatus"].deserialize(bytes.fromhex(one["hex"]))) for one in list(viewer.heard)]

    wait_until(lambda: any(one["ns"] == _ns(final.status) for one in statuses()))
    heard = {one["ns"]: one for one in statuses()}
    expected = [_as_ros(line.status) for line in running.lines if _ns(line.status) >= min(heard)]
    assert [heard.get(one["ns"]) for one in expected] == expected
    assert len(expected) > 1  # a busy machine connects reader and writer late


def _gets_every_change(running: Gateway, viewer: Program, autopilot: Start) -> None:
    """The changes are the JSON lines. A volatile topic has them from the first message on."""
    autopilot(DRIVE, running.address)
    lost = viewer.wait_for(lambda one: one.get("level") == 3, 30)
    assert lost["values"]["link"] == "LOST"
    assert lost["message"] == "NO LINK: its state is unknown, it may move"
    final = running.wait_for(lambda line: line["link"]["state"] == "LOST")
    viewer.wait_for(lambda one: one.get("ns") == _ns(final.status))
    heard = {one["ns"]: one for one in viewer.statuses}
    begin = viewer.statuses[0]["ns"]
    expected = [_as_ros(line.status) for line in running.lines if _ns(line.status) >= begin]
    assert [heard.get(one["ns"]) for one in expected] == expected
    assert len(expected) > 1  # a busy machine connects reader and writer late
    assert list(heard) == sorted(heard)
    assert {1, -1} <= {one["drives_powered"] for one in heard.values()}
    assert any(one["error_codes"] for one in heard.values())
    count = len(viewer.statuses)
    wait_until(lambda: len(viewer.statuses) > count + 1, what="a lost vehicle stays on its topic")
    assert {viewer.statuses[-1][name] for name in ("mode", *TRI_STATES)} == {-1}
    assert running.stop() == 0
    assert not [line for line in running.log if not line.startswith("mav-robot-status: ")]


def _as_ros(line: dict[str, Any]) -> dict[str, Any]:
    """A JSON line in the numbers of industrial_msgs."""
    return {
        "ns": _ns(line),
        "handle": line["handle"],
        "mode": RobotMode[line["mode"]].value,
        **{name: -1 if line[name] is None else int(line[name]) for name in TRI_STATES},
        "error_codes": [error["code"] for error in line["errors"]],
    }


def _ns(line: dict[str, Any]) -> int:
    stamp = datetime.fromisoformat(line["stamp"].replace("Z", "+00:00")) - datetime(1970, 1, 1, tzinfo=timezone.utc)
    return (stamp.days * 86400 + stamp.seconds) * 1_000_000_000 + stamp.microseconds * 1000


@OVER_ZENOH
def test_every_vehicle_has_its_topic_in_the_namespace(
    gateway: Start, autopilot: Start, router: tuple[Program, int]
) -> None:
    running = started(gateway, f"zenoh://127.0.0.1:{router[1]}/3", "--ros2-namespace", "plant")
    for system in (1, 2):
        autopilot(ardurover.READY, running.address, system=system)
        running.wait_for(_of(system))  # the first one has the default handle
    wait_until(lambda: len(tokens(router[1])) == 4)
    found = {token.split("/")[9] for token in tokens(router[1]) if "/MP/" in token}
    assert found == {"%plant%robot_status", "%plant%robot_2_1%robot_status", "%diagnostics"}
    assert {token.split("/")[1] for token in tokens(router[1])} == {"3"}


def _of(system: int) -> Callable[[dict[str, Any]], bool]:
    return lambda line: bool(line["system"] == system)


# -- when the network fails ------------------------------------------------------------------------------------------


@pytest.mark.slow
@OVER_ZENOH
def test_a_router_that_is_away_killed_and_back_is_one_log_line_each(
    gateway: Start, autopilot: Start, program: Start
) -> None:
    port = free_port()
    running = started(gateway, f"zenoh://127.0.0.1:{port}")
    autopilot(ardurover.READY, running.address)
    running.wait_for_log(f"Zenoh router 127.0.0.1:{port}: nothing listens there")
    running.wait_for(lambda line: line["mode"] != "UNKNOWN")
    first = program("router", port)
    wait_until(lambda: len(tokens(port)) == 3, 20)
    # it is logged after ten steady seconds
    wait_until(lambda: any("connected again" in line for line in running.log), 40)
    first.kill()
    wait_until(lambda: len([line for line in running.log if "nothing listens" in line]) == 2, 20)
    again = program("router", port)
    wait_until(lambda: len(tokens(port)) == 3, 20, "the tokens are not declared again")
    viewer = program("zenoh", port)
    wait_until(lambda: len(viewer.statuses) > 1)
    wait_until(lambda: len([line for line in running.log if "connected again" in line]) == 2, 40)
    assert len([line for line in running.log if "ros2" in line]) == 5
    again.close()


@OVER_ZENOH
def test_a_gateway_that_is_killed_is_gone_from_the_graph(
    gateway: Start, autopilot: Start, router: tuple[Program, int]
) -> None:
    running = started(gateway, f"zenoh://127.0.0.1:{router[1]}")
    autopilot(ardurover.READY, running.address)
    wait_until(lambda: len(tokens(router[1])) == 3)
    running.stop(signal.SIGKILL)
    wait_until(lambda: tokens(router[1]) == [])


@OVER_ZENOH
def test_a_router_that_reads_nothing_delays_neither_the_lines_nor_the_end(
    gateway: Start, autopilot: Start, router: tuple[Program, int]
) -> None:
    running = gateway("udp:127.0.0.1:0", "--ros2", f"zenoh://127.0.0.1:{router[1]}")
    autopilot(ardurover.READY, running.address)
    wait_until(lambda: len(tokens(router[1])) == 3)
    router[0].freeze()
    after = running.wait_for_lines(20, running.lines[-1].at)
    assert after.at - running.lines[-21].at < 4
    assert running.stop() == 0


@OVER_ZENOH
def test_a_session_is_renewed_after_many_topics_were_removed(
    router: tuple[Program, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    from mav_robot_status.publishers.ros import zenoh as module

    monkeypatch.setattr(module, "MOST_REMOVED", 3)
    sessions = set()
    with contextlib.closing(module.ZenohTransport(read_url(f"zenoh://127.0.0.1:{router[1]}"))) as transport:
        transport.open()
        for number in range(6):
            transport.send(Sample(f"/forged{number}", ROBOT_STATUS, b"", 1))
            transport.remove(f"/forged{number}")
            transport.send(Sample("/stays", ROBOT_STATUS, b"", 1))
            wait_until(lambda: [t.split("/")[9] for t in tokens(router[1]) if "/MP/" in t] == ["%stays"])
            sessions |= {token.split("/")[2] for token in tokens(router[1])}
    assert len(sessions) == 3


@OVER_ZENOH
@pytest.mark.parametrize(
    ("address", "reason"), [("no-such-host.invalid", "cannot resolve the name"), ("127.0.0.1:1", "nothing listens")]
)
def test_a_wrong_address_is_one_line_and_the_status_keeps_coming(
    gateway: Start, autopilot: Start, address: str, reason: str
) -> None:
    running = gateway("udp:127.0.0.1:0", "--ros2", f"zenoh://{address}")
    autopilot(ardurover.READY, running.address)
    running.wait_for_log(reason)
    running.wait_for_lines(30)
    assert len([line for line in running.log if "ros2" in line]) == 1
    assert running.stop() == 0


# -- doctor ----------------------------------------------------------------------------------------------------------


@OVER_ZENOH
def test_doctor_says_who_receives(program: Start) -> None:
    port = free_port()
    url = f"zenoh://127.0.0.1:{port}"
    assert _doctor(url) == (1, "ros2-unreachable", [])
    program("router", port)
    assert _doctor(url) == (0, "ros2-no-subscriber", [])
    program("zenoh", port)
    topics = ["/diagnostics", "/robot_status"]
    assert _doctor(url) == (0, "ros2-ok", topics)
    assert _doctor(f"{url}/5") == (1, "ros2-other-domain", topics)
    shown = run("doctor", "--ros2", url)
    assert "/viewer subscribes to /robot_status in domain 0" in shown.stdout


@pytest.mark.slow
@OVER_DDS
def test_doctor_says_who_receives_over_dds(program: Start) -> None:
    assert _doctor(f"dds://{DOMAIN + 1}") == (0, "ros2-no-subscriber", [])
    program("dds", DOMAIN + 1)
    assert _doctor(f"dds://{DOMAIN + 1}") == (0, "ros2-ok", ["/diagnostics", "/robot_status"])


def test_doctor_looks_at_the_vehicle_too(demo_log: Path) -> None:
    done = run("doctor", str(demo_log), "--ros2", "zenoh://127.0.0.1:1", "--as-json")
    log, network = map(json.loads, done.stdout.splitlines())
    assert done.returncode == 1
    assert (log["connection"], network["cause"]) == (str(demo_log), "ros2-unreachable")


def _doctor(url: str) -> tuple[int, str, list[str]]:
    done = run("doctor", "--ros2", url, "--as-json")
    found = json.loads(done.stdout)
    assert found["ros2"] == url
    return done.returncode, found["cause"], sorted(one["topic"] for one in found["subscriptions"])


# -- what a person writes --------------------------------------------------------------------------------------------


def test_a_recorded_log_is_not_published(demo_log: Path) -> None:
    done = run(str(demo_log), "--ros2", "zenoh://127.0.0.1")
    assert done.returncode == 2
    assert "a recorded log is not a live status: replay it without --ros2" in done.stderr


def test_a_misspelt_key_has_its_place_and_a_suggestion(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(
        "links: ['udp:127.0.0.1:0']\nrobot_status_controller:\n"
        "  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  publishers: [{type: ros2, url: 'zenoh://127.0.0.1', namspace: x}]\n"
    )
    done = run("check-config", str(file))
    assert done.returncode == 2
    assert f"{file}:4:" in done.stderr
    assert "did you mean 'namespace'" in done.stderr


def test_another_address_is_one_line_with_the_right_forms() -> None:
    done = run("udp:127.0.0.1:0", "--ros2", "127.0.0.1:7447")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].endswith(
        "write zenoh://127.0.0.1:7447 for a Zenoh router, or dds://0 for the DDS domain 0"
    )
