from __future__ import annotations

import contextlib
import dataclasses
import io
import itertools
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
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER, check
from mav_robot_status.gateway.mavlink_hardware import robot_hw
from mav_robot_status.gateway.pipeline import Pipeline
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.interface import Audience, LinkState
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.publishers.line_output import LineOutput
from mav_robot_status.publishers.mqtt.journal import Journal

from ..publishers.port import Port
from .third_party import ORDER, Collecting

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


def made(config: Config, port: Port, stdout: TextIO) -> Pipeline:
    return Pipeline(config, robot_hw(config), port, stdout)


def take(pipeline: Pipeline, frame: Frame, now: Instant) -> None:
    assert isinstance(pipeline.hw, MavlinkRobotHW)
    pipeline.hw.on_frame(frame, now)


def live(pipeline: Pipeline, start: Instant, seconds: float) -> int:
    """Advance the time from one due moment to the next. Returns the number of turns."""
    end, now, ticks = start.mono + seconds, start, 0
    while (due := pipeline.next_due(now.mono)) <= end:
        assert due > now.mono
        now = later(start, due - start.mono)._replace(mono=due)
        pipeline.tick(now)
        ticks += 1
    return ticks


def test_every_detected_autopilot_gets_its_own_handle_and_controller(stdout: TextIO) -> None:
    pipeline = made(Config(), Port(HEARER), stdout)
    pipeline.tick(START)
    take(pipeline, heartbeat(7), START)
    take(pipeline, heartbeat(9), START)
    pipeline.tick(START)
    pipeline.close(START)
    assert [line["handle"] for line in lines(stdout)] == [f"{NAME}/7.1", f"{NAME}/9.1"]


def test_a_vehicle_whose_handle_no_controller_reads_is_told_once(
    stdout: TextIO, caplog: pytest.LogCaptureFixture
) -> None:
    pasted = dataclasses.replace(DEFAULT_CONTROLLER, where="robot.yaml:1:1", publishers=(PublisherConfig("json"),))
    pipeline = made(Config(controllers=(pasted,)), Port(HEARER), stdout)
    for system in (1, 7, 9):
        take(pipeline, heartbeat(system), START)
    pipeline.tick(START)
    pipeline.close(START)
    assert [line["handle"] for line in lines(stdout)] == [NAME]
    (told,) = [record.message for record in caplog.records if "no controller reads" in record.message]
    assert f"handle_name: {NAME}/7.1" in told
    assert "vehicles: [{system: 7}]" in told


def test_a_controller_can_read_the_handle_of_a_vehicle_that_is_not_configured(stdout: TextIO) -> None:
    publishers = (PublisherConfig("json"),)
    seven = ControllerConfig("seven", DEFAULT_CONTROLLER.type, {"handle_name": f"{NAME}/7.1"}, "f:1:1", publishers)
    pipeline = made(Config(controllers=(seven,)), Port(HEARER), stdout)
    for system in (1, 7, 9):
        take(pipeline, heartbeat(system), START)
    pipeline.tick(START)
    pipeline.close(START)
    assert [line["system"] for line in lines(stdout)] == [7]


@pytest.mark.parametrize("ids", ["1.1", "0.1", "7.256", "7", "07.1"])
def test_a_handle_that_no_vehicle_gets_is_an_error(ids: str) -> None:
    stanza = ControllerConfig("status", DEFAULT_CONTROLLER.type, {"handle_name": f"{NAME}/{ids}"}, "f:1:1")
    with pytest.raises(ConfigError, match="f:1:1: there is no handle"):
        check(Config(controllers=(stanza,)))


def test_expected_vehicles_are_published_before_their_first_heartbeat(stdout: TextIO) -> None:
    port = Port(HEARER)
    pipeline = made(Config(vehicles=(VehicleConfig(3, None, "rover"),)), port, stdout)
    pipeline.tick(START)
    pipeline.close(START)
    (line,) = lines(stdout)
    assert (line["handle"], line["system"], line["link"]["state"]) == ("rover", 3, "NEVER_SEEN")
    assert port.sent == []


def test_the_pipeline_is_due_only_as_often_as_it_has_work(stdout: TextIO) -> None:
    pipeline = made(Config(), Port(HEARER), stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    assert live(pipeline, START, 5.0) < 5 * (10 + 10) + 20  # the lines, the hardware reads and a few more
    pipeline.close(START)


def test_if_nobody_takes_periodic_messages_the_pipeline_sleeps_until_an_audience_gets_a_present_status(
    stdout: TextIO,
) -> None:
    port = Port()
    publishers = PublisherConfig("json", {"changes_only": True}), PublisherConfig("mavlink")
    pipeline = made(Config(controllers=(controller("c", OURS, *publishers),)), port, stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    live(pipeline, START, 10.0)
    silent = later(START, 10.0)
    assert live(pipeline, silent, 30.0) <= 30
    now = later(START, 40.0)
    port.present = [HEARER]
    pipeline.tick(now)
    assert pipeline.next_due(now.mono) == now.mono
    pipeline.tick(now)
    assert live(pipeline, now, 5.0) >= 5
    times = [sent.message.time_usec - START.unix_us for sent in port.sent if sent.message._fields[0] == "time_usec"]
    assert times[0] == pytest.approx(40.0e6, abs=0.2e6)
    assert len(times) == pytest.approx(6, abs=1)
    pipeline.close(now)


def test_with_changes_only_the_pipeline_wakes_for_the_messages_to_an_audience_alone(stdout: TextIO) -> None:
    port = Port(HEARER)
    publishers = PublisherConfig("json", {"changes_only": True}), PublisherConfig("mavlink")
    pipeline = made(Config(controllers=(controller("c", OURS, *publishers),)), port, stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    live(pipeline, START, 10.0)
    port.sent.clear()
    assert live(pipeline, later(START, 10.0), 20.0) <= 2 * 20 + 20
    times = [sent.message.time_usec / 1e6 for sent in port.sent]
    assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx([1.0] * (len(times) - 1), abs=0.02)
    assert len(times) == pytest.approx(20, abs=1)
    pipeline.close(START)


def test_a_controller_is_updated_only_when_its_handle_changes_or_it_is_due(
    stdout: TextIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    updates: list[tuple[str, float, float]] = []

    def update(self: IndustrialRobotStatusController, now: Instant, period: float) -> None:
        updates.append((self.handle.name, round(now.mono - START.mono, 3), round(period, 3)))

    monkeypatch.setattr(IndustrialRobotStatusController, "update", update)
    monkeypatch.setattr(IndustrialRobotStatusController, "next_due", lambda _, now: now + 2)
    pipeline = made(Config(), Port(), stdout)
    for at, frame in ((0.0, heartbeat(1)), (0.5, heartbeat(2)), (1.0, heartbeat(1)), (1.5, heartbeat(2, armed=True))):
        take(pipeline, frame, later(START, at))
        pipeline.tick(later(START, at))
    first, second = NAME, f"{NAME}/2.1"
    assert updates == [(first, 0.0, 0.0), (second, 0.5, 0.0), (second, 1.5, 1.0)]
    assert pipeline.next_due(START.mono + 1.5) == START.mono + 2
    pipeline.tick(later(START, 2.0))
    assert updates[3:] == [(first, 2.0, 2.0)]


def test_two_controllers_share_an_output_with_equal_options(installed: list[Collecting], stdout: TextIO) -> None:
    config = Config(controllers=(controller("a", OURS, PublisherConfig("collecting")),
                                 controller("b", OURS, PublisherConfig("collecting")),
                                 controller("c", OURS, PublisherConfig("collecting", {"x": 1}))))  # fmt: skip
    pipeline = made(config, Port(HEARER), stdout)
    assert len(installed) == 2
    pipeline.close(START)
    assert all(made.closed for made in installed)


@pytest.mark.parametrize("controllers", [1, 2])
def test_mqtt_writes_its_spool_to_disk_before_other_outputs_publish(
    stdout: TextIO, tmp_path: Path, controllers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise LinkError("cannot write JSON lines")

    monkeypatch.setattr(LineOutput, "write", fail)
    fails = PublisherConfig("json", {"path": str(tmp_path / "lines")})
    keeps = PublisherConfig("mqtt", {"url": "mqtt://127.0.0.1:1/robots", "spool": str(tmp_path / "s"), "robot": "r"})
    both = (controller("c", OURS, fails, keeps),)
    one_each = (controller("a", OURS, fails), controller("b", OURS, keeps))
    pipeline = made(Config(controllers=both if controllers == 1 else one_each), Port(HEARER), stdout)
    take(pipeline, heartbeat(), START)
    with pytest.raises(LinkError, match="cannot write JSON lines"):
        pipeline.tick(START)
    with contextlib.closing(Journal(str(tmp_path / "s-new"), 0)) as journal:
        assert [json.loads(event.text)["robot"] for event in journal.left] == ["r"]
    with contextlib.suppress(LinkError):
        pipeline.close(START)


@pytest.mark.parametrize(("patient", "made"), [(False, ["LiveOnly", "Collecting"]), (True, ["Collecting"])])
def test_a_replay_skips_live_only_third_party_publishers(
    installed: list[Collecting], stdout: TextIO, patient: bool, made: list[str]
) -> None:
    both = controller("c", OURS, PublisherConfig("live only"), PublisherConfig("collecting"))
    config = Config(controllers=(both,))
    pipeline = Pipeline(config, robot_hw(config), Port(HEARER), stdout, patient=patient)
    assert [type(one).__name__ for one in installed] == made
    pipeline.close(START)


@pytest.mark.parametrize("controllers", [1, 2])
def test_a_durable_third_party_publisher_runs_first(
    installed: list[Collecting], stdout: TextIO, controllers: int
) -> None:
    shown, durable = PublisherConfig("shown"), PublisherConfig("durable")
    both = (controller("c", OURS, shown, durable),)
    one_each = (controller("a", OURS, shown), controller("b", OURS, durable))
    pipeline = made(Config(controllers=both if controllers == 1 else one_each), Port(HEARER), stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    assert ORDER == ["durable", "shown"]
    pipeline.close(START)


def test_a_failed_controller_is_stopped_and_the_others_continue(
    installed: list[Collecting], stdout: TextIO, caplog: pytest.LogCaptureFixture
) -> None:
    config = Config(controllers=(controller("bad", "third_party/Faulty"),
                                 controller("good", OURS, PublisherConfig("json"))))  # fmt: skip
    pipeline = made(config, Port(HEARER), stdout)
    take(pipeline, heartbeat(), START)
    with caplog.at_level(logging.ERROR):
        for tick in range(3):
            take(pipeline, heartbeat(armed=bool(tick % 2)), later(START, tick))
            pipeline.tick(later(START, tick))
        live(pipeline, later(START, 2), 1.0)
    pipeline.close(later(START, 4))
    assert len(lines(stdout)) >= 3
    assert [r.message for r in caplog.records] == ["controller 'bad' failed and is stopped; all other parts continue"]


def test_a_failed_publisher_does_not_affect_the_other_outputs_of_its_controller(
    installed: list[Collecting], stdout: TextIO, caplog: pytest.LogCaptureFixture
) -> None:
    faulty, good = PublisherConfig("collecting", {"faulty": True}), PublisherConfig("collecting")
    pipeline = made(Config(controllers=(controller("c", OURS, faulty, good),)), Port(HEARER), stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    take(pipeline, heartbeat(armed=True), later(START, 1))
    pipeline.tick(later(START, 1))
    pipeline.close(later(START, 1))
    assert len(installed[1].messages) == 2
    assert [r.message for r in caplog.records if r.levelno == logging.ERROR] == [
        "publisher 'collecting' failed and is stopped; all other parts continue"
    ]


def test_a_controller_that_cannot_be_created_is_an_error_and_leaves_nothing_open(
    installed: list[Collecting], stdout: TextIO
) -> None:
    config = Config(
        vehicles=(VehicleConfig(),),
        controllers=(controller("c", "third_party/Impossible", PublisherConfig("collecting")),),
    )
    with pytest.raises(ConfigError, match="f:1:1: controller 'c' cannot be made: KeyError: 'gripper'"):
        made(config, Port(HEARER), stdout)
    assert installed[0].closed


def test_an_output_that_cannot_be_opened_is_an_error_before_any_input_is_read(stdout: TextIO) -> None:
    config = Config(controllers=(controller("c", OURS, PublisherConfig("json", {"path": "/nowhere/x"})),))
    with pytest.raises(LinkError, match="cannot write JSON lines to /nowhere/x"):
        made(config, Port(HEARER), stdout)


@pytest.mark.parametrize("kind", [OURS, "third_party/Faulty"])
def test_an_unregistered_handle_is_an_error_that_lists_the_registered_handles(
    installed: list[Collecting], kind: str
) -> None:
    vehicles = (VehicleConfig(1, None, "rover"), VehicleConfig(2, None, "copter"))
    with pytest.raises(ConfigError, match="f:1:1: there is no handle 'x'; registered: 'rover', 'copter'"):
        check(Config(vehicles=vehicles, controllers=(controller("c", kind, handle_name="x"),)))
    with pytest.raises(ConfigError, match=r"Write `vehicles: \[\{handle: x\}\]`"):
        check(Config(controllers=(controller("c", kind, handle_name="x"),)))


def test_the_default_controller_needs_no_handle_of_the_default_name() -> None:
    check(Config(vehicles=(VehicleConfig(1, None, "rover"),), controllers=(DEFAULT_CONTROLLER,)))


def test_forgetting_restarts_the_vehicles_and_continues_the_sequence_numbers(stdout: TextIO) -> None:
    pipeline = made(Config(), Port(HEARER), stdout)
    for _ in range(2):
        take(pipeline, heartbeat(), START)
        pipeline.tick(START)
        pipeline.forget(START)
        pipeline.tick(START)
    pipeline.close(START)
    assert [line["seq"] for line in lines(stdout)] == [0, 1]


def test_statuses_are_also_sent_over_mavlink(stdout: TextIO) -> None:
    port = Port(HEARER)
    pipeline = made(Config(), port, stdout)
    take(pipeline, heartbeat(7), START)
    pipeline.tick(START)
    pipeline.close(START)
    ((message, system, _),) = port.sent
    assert (type(message).__name__, system, message.subject_system) == ("RobotStatus", 7, 7)


def test_a_standard_output_without_a_descriptor_is_an_error() -> None:
    with pytest.raises(ConfigError, match="publisher 'json' cannot be made"):
        made(Config(), Port(HEARER), io.StringIO())


def test_a_handle_that_another_configuration_lacks_is_unknown_on_the_outputs_that_stay(stdout: TextIO) -> None:
    port = Port(HEARER)
    before, after = (Config(vehicles=(VehicleConfig(1, handle=name),)) for name in ("rover", "boat"))
    pipeline = made(before, port, stdout)
    take(pipeline, heartbeat(), START)
    pipeline.tick(START)
    assert lines(stdout)[-1]["drives_powered"] is False

    def renewed() -> MavlinkRobotHW:
        hardware = robot_hw(after)
        hardware.on_frame(heartbeat(armed=True), START)
        return hardware

    pipeline.change(after, renewed, later(START, 0.1))
    pipeline.tick(later(START, 0.2))
    assert lines(stdout)[-1]["handle"] == "boat"
    last = [line for line in lines(stdout) if line["handle"] == "rover"][-1]
    assert (last["link"]["state"], last["drives_powered"], last["system"]) == ("NEVER_SEEN", None, 1)
    port.taken()
    port.asked = [(HEARER.key, 1)]
    pipeline.tick(later(START, 0.3))
    assert {sent.message.drives_powered for sent in port.taken() if hasattr(sent.message, "drives_powered")} == {1}


def test_a_handle_that_was_removed_before_does_not_stop_another_configuration(stdout: TextIO) -> None:
    pipeline = made(Config(), Port(), stdout)
    take(pipeline, heartbeat(7), START)
    pipeline.tick(START)
    pipeline.hw.handles.remove_handle(f"{NAME}/7.1")
    pipeline.tick(later(START, 0.1))
    pipeline.change(Config(), lambda: robot_hw(Config()), later(START, 0.2))
    pipeline.tick(later(START, 0.3))


def test_a_removed_handle_has_a_last_line_and_its_controller_ends(stdout: TextIO) -> None:
    pipeline = made(Config(), Port(), stdout)
    take(pipeline, heartbeat(7), START)
    take(pipeline, heartbeat(8), START)
    pipeline.tick(START)
    handles = pipeline.hw.handles
    gone = handles.get_handle(f"{NAME}/8.1")
    gone.detail = gone.detail._replace(link=LinkState.NEVER_SEEN)
    handles.remove_handle(gone.name)
    pipeline.tick(later(START, 1.0))
    pipeline.tick(later(START, 2.0))
    found = [line for line in lines(stdout) if line["handle"] == gone.name]
    assert found[-1]["link"]["state"] == "NEVER_SEEN"
    assert found[-1]["stamp"] < lines(stdout)[-1]["stamp"]
