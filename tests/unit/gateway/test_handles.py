"""Publishers that serve one handle: which one it is, and what the log says about the others."""

from __future__ import annotations

import io
import logging

import pytest

from mav_robot_status.clock import later
from mav_robot_status.config import Config, ControllerConfig, HardwareConfig, PublisherConfig, VehicleConfig
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER
from mav_robot_status.gateway.handles import SingleHandles
from mav_robot_status.gateway.mavlink_hardware import robot_hw
from mav_robot_status.gateway.pipeline import Pipeline

from ..publishers.port import Port
from .test_pipeline import NAME, OURS, START, heartbeat, take
from .third_party import Collecting

ONE, ALL = PublisherConfig("one handle"), PublisherConfig("collecting")
BOTH = VehicleConfig(1, None, "rover"), VehicleConfig(2, None, "boat")
ROVER = ControllerConfig("r", OURS, {"handle_name": "rover"}, "f:1:1", (ONE, ALL))
BOAT = ControllerConfig("b", OURS, {"handle_name": "boat"}, "f:5:1", (ONE, ALL))
DEFAULT = ControllerConfig(
    DEFAULT_CONTROLLER.name, DEFAULT_CONTROLLER.type, {}, DEFAULT_CONTROLLER.where, publishers=(ONE, ALL)
)


@pytest.fixture(autouse=True)
def made(installed: list[Collecting]) -> list[Collecting]:
    return installed


def heard(made: list[Collecting]) -> list[list[str]]:
    """The handles of the messages, for each publisher."""
    return [list(dict.fromkeys(msg.handle for msg in one.messages)) for one in made]


def run(config: Config, *systems: int) -> Pipeline:
    """A pipeline that has heard these vehicles."""
    pipeline = Pipeline(config, robot_hw(config), Port(), io.StringIO())
    pipeline.tick(START)
    for number, system in enumerate(systems, 1):
        take(pipeline, heartbeat(system), later(START, number))
        pipeline.tick(later(START, number))
    return pipeline


def test_with_the_default_controller_it_is_the_plain_handle(
    made: list[Collecting], caplog: pytest.LogCaptureFixture
) -> None:
    run(Config(controllers=(DEFAULT,)), 1, 2, 3).close(START)
    assert heard(made) == [[NAME], [NAME, f"{NAME}/2.1", f"{NAME}/3.1"]]
    assert [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING] == [
        f"one handle serves one handle, '{NAME}', and not '{NAME}/2.1': choose another with --system N, or give each "
        "handle a controller and a one handle of its own"
    ]


def test_with_vehicles_in_the_configuration_it_is_the_first_of_them(made: list[Collecting]) -> None:
    run(Config(vehicles=BOTH, controllers=(DEFAULT,))).close(START)
    assert heard(made) == [["rover"], ["rover", "boat"]]


@pytest.mark.parametrize("first", [ROVER, BOAT])
def test_a_publisher_that_two_controllers_share_serves_the_first(made: list[Collecting], first: object) -> None:
    controllers = (ROVER, BOAT) if first is ROVER else (BOAT, ROVER)
    run(Config(vehicles=BOTH, controllers=controllers)).close(START)
    assert [sorted(handles) for handles in heard(made)] == [
        ["rover" if first is ROVER else "boat"],
        ["boat", "rover"],
    ]


def test_one_controller_needs_no_word_in_the_log(made: list[Collecting], caplog: pytest.LogCaptureFixture) -> None:
    run(Config(vehicles=BOTH, controllers=(BOAT,))).close(START)
    assert heard(made) == [["boat"], ["boat"]]
    assert not [r for r in caplog.records if r.levelno == logging.WARNING]


def test_after_a_reload_it_may_be_another_handle(made: list[Collecting]) -> None:
    before, after = Config(vehicles=BOTH, controllers=(ROVER,)), Config(vehicles=BOTH, controllers=(BOAT,))
    pipeline = run(before)
    pipeline.change(after, lambda: robot_hw(after), later(START, 5))
    pipeline.tick(later(START, 6))
    pipeline.close(START)
    assert heard(made) == [["rover", "boat"], ["rover", "boat"]]


def test_without_mavlink_it_is_the_first_hardware_interface() -> None:
    arms = HardwareConfig("arm", "left"), HardwareConfig("arm", "right")
    single = SingleHandles(Config(interfaces=arms, controllers=(DEFAULT,)))
    controllers = [ControllerConfig("c", OURS, {"handle_name": name}, "default") for name in ("left", "right")]
    assert [single.serves(ONE, controller) for controller in controllers] == [True, False]
