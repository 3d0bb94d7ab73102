import logging

import pytest

from mav_robot_status.links.retry import JITTER, Backoff, StateLog


def test_waits_double_up_to_the_longest_and_start_again_after_a_success() -> None:
    backoff = Backoff(0.2, 1.0, lambda: 0.0)
    assert [round(backoff.after(100.0) - 100.0, 6) for _ in range(5)] == [0.2, 0.4, 0.8, 1.0, 1.0]
    backoff.reset()
    assert backoff.after(200.0) == 200.2


def test_jitter_shortens_one_wait_and_no_later_one() -> None:
    chances = iter([1.0, 0.0])
    backoff = Backoff(1.0, 10.0, lambda: next(chances))
    assert backoff.after(0.0) == 1.0 - JITTER
    assert backoff.after(0.0) == 2.0


def test_a_state_is_logged_when_it_changes(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    state_log = StateLog(logging.getLogger("a link"))
    state_log.recovered("well")
    for _ in range(3):
        state_log.down("100% broken")
    state_log.recovered("well again")
    state_log.up("well again")
    state_log.down("100% broken")
    assert [(record.levelname, record.message, record.name) for record in caplog.records] == [
        ("WARNING", "100% broken", "a link"),
        ("INFO", "well again", "a link"),
        ("WARNING", "100% broken", "a link"),
    ]
