import logging

import pytest

from mav_robot_status.paced_log import PacedLog

log = logging.getLogger(__name__)


def test_a_paced_log_counts_what_it_leaves_out(caplog: pytest.LogCaptureFixture) -> None:
    tell = PacedLog(log, 2, 10.0)
    with caplog.at_level(logging.INFO):
        told = [tell(logging.INFO, at, f"line {at:g}") for at in (0.0, 1.0, 2.0, 9.0, 10.0, 11.0, 12.0)]
    assert caplog.messages == ["line 0", "line 1", "line 10 (2 lines before it were left out)", "line 11"]
    assert told == [True, True, False, False, True, True, False]
    assert tell.due == 20.0
