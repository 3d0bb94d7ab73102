"""The errors that a user can correct."""

from __future__ import annotations

import pytest

from mav_robot_status.errors import ConfigError, LinkError, MavRobotStatusError, UnknownHandleError, UsageError


@pytest.mark.parametrize(
    ("error", "exit_code"),
    [(MavRobotStatusError, 1), (LinkError, 1), (UsageError, 2), (ConfigError, 2), (UnknownHandleError, 2)],
)
def test_each_error_has_its_documented_exit_code(error: type[MavRobotStatusError], exit_code: int) -> None:
    assert error.exit_code == exit_code
    assert issubclass(error, MavRobotStatusError)


def test_a_configuration_error_is_a_usage_error() -> None:
    assert issubclass(ConfigError, UsageError)
