"""The conformance tests of publishers and controllers: on ours, on third-party ones, and on some that must fail."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.controller import IndustrialRobotStatusController
from mav_robot_status.interface import Controller, Publisher, PublisherContext, RobotStatusMsg
from mav_robot_status.publishers.board import BoardPublisher
from mav_robot_status.publishers.json_lines import JsonLinesPublisher
from mav_robot_status.publishers.mavlink import MavlinkPublisher
from mav_robot_status.publishers.mcap.publisher import McapPublisher
from mav_robot_status.publishers.mqtt.publisher import MqttPublisher
from mav_robot_status.publishers.named_value import NamedValuePublisher
from mav_robot_status.publishers.ros.publisher import Ros2Publisher
from mav_robot_status.publishers.simple_message.publisher import SimpleMessagePublisher
from mav_robot_status.publishers.web.publisher import HttpPublisher
from mav_robot_status.testing.conformance import publisher as module
from mav_robot_status.testing.conformance.controller import ControllerConformance
from mav_robot_status.testing.conformance.publisher import PublisherConformance

from ...loopback import LOOPBACK
from ..gateway.third_party import Collecting


class TestJsonLines(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return JsonLinesPublisher(context)


class TestJsonLinesOfRos1(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return JsonLinesPublisher(context)

    options: Mapping[str, object] = {"format": "ros1", "changes_only": True}


class TestJsonLinesOfRos2(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return JsonLinesPublisher(context)

    options: Mapping[str, object] = {"format": "ros2", "path": "/dev/null"}


class TestMavlink(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return MavlinkPublisher(context)


class TestNamedValue(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return NamedValuePublisher(context)


class TestBoard(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return BoardPublisher(context)


class TestHttp(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return HttpPublisher(context)

    options: Mapping[str, object] = {"listen": "127.0.0.1:0"}


class TestMqtt(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return MqttPublisher(context)

    @pytest.fixture(autouse=True)
    def _spool(self, tmp_path: Path) -> None:
        self.options = {"url": "mqtt://127.0.0.1:1/robots", "spool": str(tmp_path / "spool"), "robot": "r-{handle}"}


class TestMcap(PublisherConformance):
    @pytest.fixture(autouse=True)
    def place(self, tmp_path: Path) -> None:
        self.options = {"path": str(tmp_path / "status.mcap")}

    def make_publisher(self, context: PublisherContext) -> Publisher:
        return McapPublisher(context)


class TestMcapOfRos2(TestMcap):
    @pytest.fixture(autouse=True)
    def place(self, tmp_path: Path) -> None:
        self.options = {"path": str(tmp_path / "status.mcap"), "format": "ros2"}


class TestSimpleMessage(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return SimpleMessagePublisher(context)

    options: Mapping[str, object] = {"port": 0}


class TestRos2OverZenoh(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return Ros2Publisher(context)

    options: Mapping[str, object] = {"url": "zenoh://127.0.0.1:1"}


class TestRos2OverDds(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return Ros2Publisher(context)

    options: Mapping[str, object] = {"url": "dds://71"}

    @pytest.fixture(autouse=True)
    def _loopback(self, monkeypatch: pytest.MonkeyPatch) -> None:
        pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: it has no wheel for this Python")
        monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


class TestThirdPartyPublisher(PublisherConformance):
    def make_publisher(self, context: PublisherContext) -> Publisher:
        return Collecting(context)


class TestOurController(ControllerConformance):
    def make_controller(self) -> Controller:
        return IndustrialRobotStatusController()


class Quiet(IndustrialRobotStatusController):
    """A third-party controller that publishes only on change."""

    def init(self, hw: Any, parameters: Any, publishers: Any) -> None:
        super().init(hw, {**parameters, "publish_rate": 0}, publishers)


class TestThirdPartyController(ControllerConformance):
    def make_controller(self) -> Controller:
        return Quiet()


# -- what must fail ----------------------------------------------------------------------------------------------------


class Blocking(Collecting):
    def publish(self, msg: RobotStatusMsg) -> None:
        time.sleep(60)


class Picky(Collecting):
    def publish(self, msg: RobotStatusMsg) -> None:
        assert msg.detail.system is not None


class OnceClosed(Collecting):
    def close(self) -> None:
        if self.closed:
            raise RuntimeError("closed already")
        self.closed = True


class Nervous(Collecting):
    def service(self, now: Instant) -> float | None:
        return float("nan")


class Vague(Collecting):
    durable = "yes"


class Undecided(Collecting):
    def busy(self) -> bool:
        self.faulty = not self.faulty
        return self.faulty


@pytest.mark.parametrize(
    ("publisher", "test"),
    [
        (Blocking, "test_no_call_blocks_without_a_reader"),
        (Picky, "test_it_publishes_every_status"),
        (OnceClosed, "test_it_can_be_closed_twice"),
        (Nervous, "test_service_without_a_message_returns_none_or_a_time"),
        (Vague, "test_its_flags_are_bools"),
        (Undecided, "test_busy_is_a_bool_and_changes_nothing"),
    ],
)
def test_a_publisher_that_breaks_a_rule_fails_its_test(
    publisher: Callable[[PublisherContext], Publisher], test: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module.within, "__defaults__", (0.2,))
    conformance = type("Broken", (PublisherConformance,), {"make_publisher": lambda _, context: publisher(context)})()
    conformance.setup_method()
    with pytest.raises((AssertionError, RuntimeError)):
        getattr(conformance, test)()
    conformance._made.clear()
    conformance.teardown_method()


class Pushy(IndustrialRobotStatusController):
    def update(self, time: Instant, period: float) -> None:
        for output in self._outputs:
            output.publisher.publish(RobotStatusMsg("another", 0, self.handle.status, self.handle.detail, None))


class Restless(IndustrialRobotStatusController):
    def next_due(self, now: float) -> float:
        return now


class Careless(IndustrialRobotStatusController):
    def init(self, hw: Any, parameters: Any, publishers: Any) -> None:
        super().init(hw, {}, publishers)


@pytest.mark.parametrize(
    ("controller", "test"),
    [
        (Pushy, "test_a_busy_publisher_gets_nothing"),
        (Pushy, "test_its_messages_are_valid_and_name_its_handle"),
        (Restless, "test_next_due_is_later_than_now"),
        (Careless, "test_an_unknown_handle_is_one_of_our_errors"),
    ],
)
def test_a_controller_that_breaks_a_rule_fails_its_test(
    controller: type[IndustrialRobotStatusController], test: str
) -> None:
    conformance = type("Broken", (ControllerConformance,), {"make_controller": lambda _: controller()})()
    conformance.setup_method()
    with pytest.raises((AssertionError, pytest.fail.Exception)):
        getattr(conformance, test)()
