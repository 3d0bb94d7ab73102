from __future__ import annotations

from importlib.metadata import distribution

import pytest

from mav_robot_status.controller import IndustrialRobotStatusController
from mav_robot_status.errors import ConfigError
from mav_robot_status.gateway import plugins
from mav_robot_status.publishers.mavlink import MavlinkPublisher

from .third_party import Collecting, FaultyController


def test_the_built_in_table_equals_the_entry_points() -> None:
    points = distribution("mav-robot-status").entry_points
    assert {g: {p.name: p.value for p in points if p.group == g} for g in plugins.OURS} == plugins.OURS


@pytest.mark.parametrize("name", plugins.OURS[plugins.CONTROLLERS])
def test_the_built_in_controller_is_found_under_both_names(name: str) -> None:
    assert plugins.load(plugins.CONTROLLERS, name, "f:1:1") is IndustrialRobotStatusController


def test_publishers_are_found_by_name() -> None:
    assert plugins.load(plugins.PUBLISHERS, "mavlink", "f:1:1") is MavlinkPublisher


def test_third_party_plugins_are_found_by_their_entry_points(installed: list[Collecting]) -> None:
    assert plugins.load(plugins.CONTROLLERS, "third_party/Faulty", "f:1:1") is FaultyController
    assert plugins.load(plugins.PUBLISHERS, "collecting", "f:1:1") is Collecting


def test_an_unregistered_name_is_an_error_that_suggests_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match=r"f:3:1: nothing is registered as 'jsn'.*did you mean 'json'\?"):
        plugins.load(plugins.PUBLISHERS, "jsn", "f:3:1")


def test_a_name_without_a_near_match_is_an_error_that_lists_the_registered_names() -> None:
    with pytest.raises(ConfigError, match=r"registered: .*'json', .*'mavlink'"):
        plugins.load(plugins.PUBLISHERS, "pigeon", "f:3:1")


def test_a_module_that_cannot_be_imported_is_a_one_line_error(installed: list[Collecting]) -> None:
    with pytest.raises(ConfigError, match=r"f:3:1: cannot load 'third_party/Absent' .*numpy"):
        plugins.load(plugins.CONTROLLERS, "third_party/Absent", "f:3:1")
