from __future__ import annotations

import contextlib
import io
import json
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.config import Config, ControllerConfig, PublisherConfig, VehicleConfig
from mav_robot_status.controller import IndustrialRobotStatusController
from mav_robot_status.errors import ConfigError, LinkError
from mav_robot_status.gateway.plant import DEFAULT_CONTROLLER, Plant, check
from mav_robot_status.interface import Audience
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.publishers.mqtt.journal import Journal

from ..publishers.port import Port
from .third_party import Collecting

OURS = "mav_robot_status/IndustrialRobotStatusController"
START = Instant(100.0, 1_800_000_000_000_000)
HEARER = Audience("ground station")
NAME = "industrial_robot_status_handle"


def heartbeat(system: int = 1, armed: bool = False) -> Frame:
    message = Heartbeat(0, 10, 3, 65 + 128 * armed, 4, 3)
    (frame,) = Parser({0}).feed(encode(message, system=system, component=1, sequence=0))
    return frame


def controller(name: str = "c", kind: str = OURS, *publishers: PublisherConfig, **parameters: object) -> Any:
    return ControllerConfig(name, kind, parameters, "f:1:1", publishers or None)


@pytest.fixture
def stdout(tmp_path: Path) -> Iterator[TextIO]:
    with open(tmp_path / "stdout", "w+", encoding="utf-8") as file:
        yield file


def lines(stdout: TextIO) -> list[dict[str, Any]]:
    stdout.seek(0)
    return [json.loads(line) for line in stdout]


def live(plant: Plant, start: Instant, seconds: float) -> int:
    """Let time pass from one due moment to the next; how often there was something to do."""
    end, now, ticks = start.mono + seconds, start, 0
    while (due := plant.next_due(now.mono)) <= end:
        assert due > now.mono
        now = later(start, due - start.mono)._replace(mono=due)
        plant.tick(now)
        ticks += 1
    return ticks


def test_every_autopilot_heard_gets_a_controller_on_a_handle_of_its_own(stdout: TextIO) -> None:
    plant = Plant(Config(), Port(HEARER), stdout)
    plant.tick(START)
    plant.take(heartbeat(7), START)
    plant.take(heartbeat(9), START)
    plant.tick(START)
    plant.close(START)
    assert [line["handle"] for line in lines(stdout)] == [NAME, f"{NAME}/9.1"]


def test_expected_vehicles_speak_before_they_are_heard(stdout: TextIO) -> None:
    port = Port(HEARER)
    plant = Plant(Config(vehicles=(VehicleConfig(3, None, "rover"),)), port, stdout)
    plant.tick(START)
    plant.close(START)
    (line,) = lines(stdout)
    assert (line["handle"], line["system"], line["link"]["state"]) == ("rover", 3, "NEVER_SEEN")
    assert port.sent == []


def test_there_is_never_something_due_at_once_again(stdout: TextIO) -> None:
    plant = Plant(Config(), Port(HEARER), stdout)
    plant.take(heartbeat(), START)
    plant.tick(START)
    assert live(plant, START, 5.0) < 5 * (10 + 10) + 20  # the lines, the looks of the hardware, and a few more
    plant.close(START)


def test_a_controller_is_updated_when_its_handle_changes_or_it_is_due_and_not_in_between(
    stdout: TextIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    updates: list[tuple[str, float, float]] = []

    def update(self: IndustrialRobotStatusController, now: Instant, period: float) -> None:
        updates.append((self.handle.name, round(now.mono - START.mono, 3), round(period, 3)))

    monkeypatch.setattr(IndustrialRobotStatusController, "update", update)
    monkeypatch.setattr(IndustrialRobotStatusController, "next_due", lambda _, now: now + 2)
    plant = Plant(Config(), Port(), stdout)
    for at, frame in ((0.0, heartbeat(1)), (0.5, heartbeat(2)), (1.0, heartbeat(1)), (1.5, heartbeat(2, armed=True))):
        plant.take(frame, later(START, at))
        plant.tick(later(START, at))
    first, second = NAME, f"{NAME}/2.1"
    assert updates == [(first, 0.0, 0.0), (second, 0.5, 0.0), (second, 1.5, 1.0)]
    assert plant.next_due(START.mono + 1.5) == START.mono + 2
    plant.tick(later(START, 2.0))
    assert updates[3:] == [(first, 2.0, 2.0)]


def test_two_controllers_share_an_output_of_the_same_options(installed: list[Collecting], stdout: TextIO) -> None:
    config = Config(controllers=(controller("a", OURS, PublisherConfig("collecting")),
                                 controller("b", OURS, PublisherConfig("collecting")),
                                 controller("c", OURS, PublisherConfig("collecting", {"x": 1}))))  # fmt: skip
    plant = Plant(config, Port(HEARER), stdout)
    assert len(installed) == 2
    plant.close(START)
    assert all(made.closed for made in installed)


@pytest.mark.parametrize("controllers", [1, 2])
def test_what_mqtt_keeps_is_on_the_disk_before_another_output_tells_it(
    stdout: TextIO, tmp_path: Path, controllers: int
) -> None:
    fails = PublisherConfig("json", {"path": "/dev/full"})
    keeps = PublisherConfig("mqtt", {"url": "mqtt://127.0.0.1:1/robots", "spool": str(tmp_path / "s"), "robot": "r"})
    both = (controller("c", OURS, fails, keeps),)
    one_each = (controller("a", OURS, fails), controller("b", OURS, keeps))
    plant = Plant(Config(controllers=both if controllers == 1 else one_each), Port(HEARER), stdout)
    plant.take(heartbeat(), START)
    with pytest.raises(LinkError, match="cannot write JSON lines"):
        plant.tick(START)
    with contextlib.closing(Journal(str(tmp_path / "s-new"), 0)) as journal:
        assert [json.loads(event.text)["robot"] for event in journal.left] == ["r"]
    with contextlib.suppress(LinkError):
        plant.close(START)


def test_a_controller_that_fails_is_stopped_and_the_others_go_on(
    installed: list[Collecting], stdout: TextIO, caplog: pytest.LogCaptureFixture
) -> None:
    config = Config(controllers=(controller("bad", "third_party/Faulty"),
                                 controller("good", OURS, PublisherConfig("json"))))  # fmt: skip
    plant = Plant(config, Port(HEARER), stdout)
    plant.take(heartbeat(), START)
    with caplog.at_level(logging.ERROR):
        for tick in range(3):
            plant.take(heartbeat(armed=bool(tick % 2)), later(START, tick))
            plant.tick(later(START, tick))
        live(plant, later(START, 2), 1.0)
    plant.close(later(START, 4))
    assert len(lines(stdout)) >= 3
    assert [r.message for r in caplog.records] == [
        "controller 'bad' has failed and is stopped; everything else goes on"
    ]


def test_a_publisher_that_fails_leaves_its_controllers_other_outputs_alone(
    installed: list[Collecting], stdout: TextIO, caplog: pytest.LogCaptureFixture
) -> None:
    faulty, good = PublisherConfig("collecting", {"faulty": True}), PublisherConfig("collecting")
    plant = Plant(Config(controllers=(controller("c", OURS, faulty, good),)), Port(HEARER), stdout)
    plant.take(heartbeat(), START)
    plant.tick(START)
    plant.take(heartbeat(armed=True), later(START, 1))
    plant.tick(later(START, 1))
    plant.close(later(START, 1))
    assert len(installed[1].messages) == 2
    assert [r.message for r in caplog.records if r.levelno == logging.ERROR] == [
        "publisher 'collecting' has failed and is stopped; everything else goes on"
    ]


def test_a_controller_that_cannot_be_made_is_an_error_and_leaves_nothing_open(
    installed: list[Collecting], stdout: TextIO
) -> None:
    config = Config(
        vehicles=(VehicleConfig(),),
        controllers=(controller("c", "third_party/Impossible", PublisherConfig("collecting")),),
    )
    with pytest.raises(ConfigError, match="f:1:1: controller 'c' cannot be made: KeyError: 'gripper'"):
        Plant(config, Port(HEARER), stdout)
    assert installed[0].closed


def test_an_output_that_cannot_be_opened_is_an_error_before_anything_is_heard(stdout: TextIO) -> None:
    config = Config(controllers=(controller("c", OURS, PublisherConfig("json", {"path": "/nowhere/x"})),))
    with pytest.raises(LinkError, match="cannot write JSON lines to /nowhere/x"):
        Plant(config, Port(HEARER), stdout)


@pytest.mark.parametrize("kind", [OURS, "third_party/Faulty"])
def test_a_handle_nobody_registers_is_an_error_that_lists_those_there_are(
    installed: list[Collecting], kind: str
) -> None:
    vehicles = (VehicleConfig(1, None, "rover"), VehicleConfig(2, None, "copter"))
    with pytest.raises(ConfigError, match="f:1:1: there is no handle 'x'; registered: 'rover', 'copter'"):
        check(Config(vehicles=vehicles, controllers=(controller("c", kind, handle_name="x"),)))
    with pytest.raises(ConfigError, match=r"Write `vehicles: \[\{handle: x\}\]`"):
        check(Config(controllers=(controller("c", kind, handle_name="x"),)))


def test_the_default_controller_needs_no_handle_of_the_default_name() -> None:
    check(Config(vehicles=(VehicleConfig(1, None, "rover"),), controllers=(DEFAULT_CONTROLLER,)))


def test_forgetting_begins_anew_and_goes_on_counting(stdout: TextIO) -> None:
    plant = Plant(Config(), Port(HEARER), stdout)
    for _ in range(2):
        plant.take(heartbeat(), START)
        plant.tick(START)
        plant.forget(START)
        plant.tick(START)
    plant.close(START)
    assert [line["seq"] for line in lines(stdout)] == [0, 1]


def test_statuses_go_out_as_mavlink_too(stdout: TextIO) -> None:
    port = Port(HEARER)
    plant = Plant(Config(), port, stdout)
    plant.take(heartbeat(7), START)
    plant.tick(START)
    plant.close(START)
    ((message, system, _),) = port.sent
    assert (type(message).__name__, system, message.subject_system) == ("RobotStatus", 7, 7)


def test_a_standard_output_without_a_descriptor_is_an_error_not_a_guess() -> None:
    with pytest.raises(ConfigError, match="publisher 'json' cannot be made"):
        Plant(Config(), Port(HEARER), io.StringIO())
