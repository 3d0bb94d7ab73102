"""The errors that a person can act on."""

from __future__ import annotations

import pytest

from mav_robot_status.errors import ConfigError, LinkError, MavRobotStatusError, UnknownHandleError, UsageError


@pytest.mark.parametrize(
    ("error", "exit_code"),
    [(MavRobotStatusError, 1), (LinkError, 1), (UsageError, 2), (ConfigError, 2), (UnknownHandleError, 2)],
)
def test_each_error_has_the_exit_code_that_users_were_told(error: type[MavRobotStatusError], exit_code: int) -> None:
    assert error.exit_code == exit_code
    assert issubclass(error, MavRobotStatusError)


def test_who_catches_usage_errors_also_gets_those_of_the_configuration() -> None:
    assert issubclass(ConfigError, UsageError)
