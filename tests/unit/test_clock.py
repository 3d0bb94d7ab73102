"""Time as a value."""

from __future__ import annotations

import re
import time
from datetime import datetime, timedelta, timezone

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import LAST_SECOND, Instant, later, now, rfc3339

EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


def test_a_stamp_is_utc_with_six_decimals() -> None:
    assert rfc3339(1_795_200_547_123_456) == "2026-11-20T18:49:07.123456Z"


def test_a_whole_second_has_six_zeros() -> None:
    assert rfc3339(1_795_200_547_000_000) == "2026-11-20T18:49:07.000000Z"


@given(st.integers(0, LAST_SECOND * 1_000_000))
def test_a_stamp_can_be_read_back(unix_us: int) -> None:
    read = datetime.strptime(rfc3339(unix_us), "%Y-%m-%dT%H:%M:%S.%fZ").replace(tzinfo=timezone.utc)
    assert (read - EPOCH) // timedelta(microseconds=1) == unix_us


@given(st.integers(-(1 << 70), 1 << 70))
def test_any_log_time_has_a_timestamp(unix_us: int) -> None:
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z", rfc3339(unix_us))


def test_later_advances_both_clocks() -> None:
    assert later(Instant(10.0, 5_000_000), 0.25) == Instant(10.25, 5_250_000)


def test_now_reads_the_monotonic_and_the_wall_clock() -> None:
    before, present, after = time.monotonic(), now(), time.monotonic()
    assert before <= present.mono <= after
    assert abs(present.unix_us / 1e6 - time.time()) < 60
