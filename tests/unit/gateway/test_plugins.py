from __future__ import annotations

from importlib.metadata import distribution

import pytest

from mav_robot_status.controller import IndustrialRobotStatusController
from mav_robot_status.errors import ConfigError
from mav_robot_status.gateway import plugins
from mav_robot_status.publishers.mavlink import MavlinkPublisher

from .third_party import Collecting, FaultyController


def test_our_table_holds_the_same_as_our_entry_points() -> None:
    points = distribution("mav-robot-status").entry_points
    assert {g: {p.name: p.value for p in points if p.group == g} for g in plugins.OURS} == plugins.OURS


@pytest.mark.parametrize("name", plugins.OURS[plugins.CONTROLLERS])
def test_our_controller_is_found_under_both_its_names(name: str) -> None:
    assert plugins.load(plugins.CONTROLLERS, name, "f:1:1") is IndustrialRobotStatusController


def test_publishers_are_found_by_name() -> None:
    assert plugins.load(plugins.PUBLISHERS, "mavlink", "f:1:1") is MavlinkPublisher


def test_a_third_partys_are_found_by_their_entry_points(installed: list[Collecting]) -> None:
    assert plugins.load(plugins.CONTROLLERS, "third_party/Faulty", "f:1:1") is FaultyController
    assert plugins.load(plugins.PUBLISHERS, "collecting", "f:1:1") is Collecting


def test_a_name_nobody_registered_is_an_error_with_the_nearest_one() -> None:
    with pytest.raises(ConfigError, match=r"f:3:1: nothing is registered as 'jsn'.*did you mean 'json'\?"):
        plugins.load(plugins.PUBLISHERS, "jsn", "f:3:1")


def test_a_name_like_no_other_is_an_error_that_lists_what_there_is() -> None:
    with pytest.raises(ConfigError, match=r"there are .*'json', .*'mavlink'"):
        plugins.load(plugins.PUBLISHERS, "pigeon", "f:3:1")


def test_a_module_that_cannot_be_imported_is_an_error_in_one_line(installed: list[Collecting]) -> None:
    with pytest.raises(ConfigError, match=r"f:3:1: cannot load 'third_party/Absent' .*numpy"):
        plugins.load(plugins.CONTROLLERS, "third_party/Absent", "f:3:1")
