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


def test_a_state_that_changes_all_the_time_is_logged_seldom_and_its_end_always(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    now = [0.0]
    state_log = StateLog(logging.getLogger("a link"), lambda: now[0])
    for _ in range(100):
        now[0] += 1.0
        state_log.down("lost")
        state_log.up("connected")
    assert len(caplog.messages) == 16
    assert caplog.messages[-1] == "connected"
    state_log.down("lost")
    now[0] += 240.0
    state_log.down("lost")  # the next attempt
    assert caplog.messages[-1] == "lost (93 lines before it were left out)"
    state_log.up("connected")
    assert caplog.messages[-1] == "connected"
