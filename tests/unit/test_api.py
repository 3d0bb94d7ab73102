from __future__ import annotations

import asyncio
import gc
import json
import pathlib
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

import mav_robot_status
from mav_robot_status import LinkState, RobotMode, RobotStatus, Statuses, TriState, statuses
from mav_robot_status.config import Config, GroupConfig, HardwareConfig, LinkConfig, VehicleConfig
from mav_robot_status.errors import ConfigError, LinkError, UsageError
from mav_robot_status.testing import FakeAutopilot, ardurover
from mav_robot_status.testing.fake_arm import FakeArm

from ..deadline import allow, wait_until
from ..ports import free_port

LOG = pathlib.Path(__file__).parents[1] / "recorded" / "logs" / "ardurover-4.5.6-auto.tlog"


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def live(port: int) -> Iterator[Statuses]:
    with FakeAutopilot(ardurover.READY, ("127.0.0.1", port)), statuses(f"udpin:127.0.0.1:{port}") as found:
        yield found


def threads() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name == "mav-robot-status"}


def test_a_live_vehicle_yields_messages_with_handle_status_and_detail(live: Statuses) -> None:
    msg = next(live)
    assert msg.handle == "industrial_robot_status_handle"
    assert isinstance(msg.status, RobotStatus)
    assert msg.status.mode is RobotMode.MANUAL
    assert msg.status.drives_powered is TriState.FALSE
    assert msg.detail.link is LinkState.CONNECTED
    assert msg.heartbeat_age is not None
    assert next(live).unix_us >= msg.unix_us


def test_a_log_gives_the_messages_of_the_command_line_and_ends() -> None:
    command = [sys.executable, "-m", "mav_robot_status", str(LOG), "-q"]
    lines = [json.loads(line) for line in subprocess.run(command, capture_output=True, check=True).stdout.splitlines()]
    found = list(statuses(str(LOG)))
    assert len(found) == len(lines) > 0
    for msg, line in zip(found, lines, strict=True):
        assert (msg.handle, msg.status.error_code) == (line["handle"], line["error_code"])
        assert msg.status.drives_powered is TriState.of(line["drives_powered"])


def test_a_configuration_file_gives_links_and_handles(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "config.yaml"
    file.write_text(f"links: [{LOG}]\nvehicles: [{{system: 1, handle: rover}}]\n")
    assert {msg.handle for msg in statuses(config=file)} == {"rover"}
    assert {msg.handle for msg in statuses(config=Config(links=(LinkConfig(str(LOG)),)))} == {
        "industrial_robot_status_handle"
    }


def test_a_group_yields_messages_beside_those_of_its_members(port: int) -> None:
    members = ("base", "arm")
    with FakeArm() as arm, FakeAutopilot(ardurover.READY, ("127.0.0.1", port)):
        ports = {"port": arm.port, "dashboard_port": arm.dashboard_port}
        config = Config(
            links=(LinkConfig(f"udpin:127.0.0.1:{port}"),),
            vehicles=(VehicleConfig(handle="base"),),
            interfaces=(HardwareConfig("ur", "arm", {"host": "127.0.0.1", **ports}),),
            groups={"robot": GroupConfig(members)},
        )
        with statuses(config=config) as found:
            of_group = next(m for m in found if m.handle == "robot" and m.status.drives_powered is TriState.TRUE)
            heard = {next(found).handle for _ in range(30)}
    assert heard == {"robot", *members}
    assert of_group.detail.members == members
    assert of_group.status.motion_possible is TriState.TRUE  # the base is disarmed, and the arm can move


def test_configured_publishers_run_too(tmp_path: pathlib.Path) -> None:
    lines, file = tmp_path / "status.jsonl", tmp_path / "config.yaml"
    controller = "type: mav_robot_status/IndustrialRobotStatusController"
    file.write_text(f"c:\n  {controller}\n  publishers: [{{type: json, path: {lines}}}]\n")
    assert len(list(statuses(str(LOG), config=str(file)))) == len(lines.read_text().splitlines())


def test_nothing_is_written_to_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    list(statuses(str(LOG)))
    assert capfd.readouterr().out == ""


def test_invalid_arguments_raise_package_errors_and_open_nothing(port: int, tmp_path: pathlib.Path) -> None:
    with pytest.raises(UsageError, match="no connection given"):
        statuses()
    with pytest.raises(UsageError, match="config: must be a path or a Config, not 3"):
        statuses("udp:127.0.0.1:14550", config=3)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="is replayed alone"):
        statuses(str(LOG), f"udpin:127.0.0.1:{port}")
    with pytest.raises(ConfigError, match=r"config\.yaml"):
        statuses("udp:127.0.0.1:14550", config=tmp_path / "config.yaml")
    with statuses(f"udpin:127.0.0.1:{port}"), pytest.raises(LinkError, match=str(port)):
        statuses(f"udpin:127.0.0.1:{port}")


def test_an_unreadable_log_raises_a_package_error(tmp_path: pathlib.Path) -> None:
    with pytest.raises(UsageError, match=r"absent\.tlog"):
        list(statuses(str(tmp_path / "absent.tlog")))


def test_close_stops_the_gateway_and_ends_the_iteration(live: Statuses) -> None:
    next(live)
    live.close()
    live.close()
    list(live)  # the queued messages
    assert list(live) == []
    assert not threads()


def test_close_ends_a_replay_without_a_reader() -> None:
    found = statuses(str(LOG))
    found.close()
    assert not threads()


def test_an_abandoned_iterator_ends_its_gateway(port: int) -> None:
    found = statuses(f"udpin:127.0.0.1:{port}")
    assert threads()
    del found
    gc.collect()
    wait_until(lambda: not threads())


def test_an_error_of_the_running_gateway_is_raised_by_the_iteration(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    def fail(_: object, now: object) -> None:
        raise ZeroDivisionError("in the gateway")

    monkeypatch.setattr("mav_robot_status.gateway.pipeline.Pipeline.tick", fail)
    with pytest.raises(ZeroDivisionError, match="in the gateway"):
        next(statuses(f"udpin:127.0.0.1:{port}"))


def test_asyncio_reads_through_a_thread(live: Statuses) -> None:
    async def first() -> str:
        msg = await asyncio.wait_for(asyncio.to_thread(next, live), allow(10))
        return msg.handle

    assert asyncio.run(first()) == "industrial_robot_status_handle"


def test_the_package_exports_only_its_public_names() -> None:
    for name in mav_robot_status.__all__:
        assert getattr(mav_robot_status, name) is not None
        assert name in dir(mav_robot_status)
    with pytest.raises(AttributeError, match="no attribute 'no_such_name'"):
        mav_robot_status.no_such_name  # noqa: B018


def test_importing_the_package_does_not_import_the_gateway() -> None:
    code = "import sys, mav_robot_status; print([m for m in sys.modules if m.startswith('mav_robot_status.')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['mav_robot_status.version']"


def test_python_m_runs_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mav_robot_status", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"mav-robot-status {mav_robot_status.__version__}\n"
