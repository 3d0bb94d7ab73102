from __future__ import annotations

import logging

import pytest

from mav_robot_status.publishers.error_reporter import ErrorReporter


def test_a_reason_is_logged_once_until_a_connection_is_steady(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    errors = ErrorReporter("mqtt", "127.0.0.1:1883")
    for _ in range(3):
        errors.fails("no answer")
    errors.opens()
    errors.holds()
    errors.fails("no answer")
    assert [record.message for record in caplog.records] == [
        "mqtt: 127.0.0.1:1883: no answer; trying again",
        "mqtt: 127.0.0.1:1883: connected again",
        "mqtt: 127.0.0.1:1883: no answer; trying again",
    ]
