import itertools
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.errors import UsageError
from mav_robot_status.links.log import (
    BLOCK,
    DAY_US,
    END,
    SMALL_STEP_US,
    Counts,
    LogReader,
    Record,
    Stamped,
    follows,
    timed,
)

START = 1_700_000_000_000_000
SECOND = 1_000_000


def record(stamp: int) -> Record:
    return None, None, None, None, None, stamp


def records(stamps: list[int], counts: Counts) -> list[Stamped]:
    """The time of each stamp; no bytes follow the last record."""
    found = list(itertools.islice(timed(map(record, stamps), lambda: END, counts), len(stamps)))
    assert [what[-1] for _, what, _ in found] == stamps
    return found


def times(stamps: list[float]) -> tuple[list[tuple[float, float, bool]], Counts]:
    """(mono, unix_us since START, new_segment) of each stamp; stamps are seconds since START."""
    counts = Counts()
    micros = [START + round(stamp * SECOND) for stamp in stamps]
    return [
        (round(now.mono, 6), (now.unix_us - START) / SECOND, new_segment)
        for now, _, new_segment in records(micros, counts)
    ], counts


def test_a_reader_gives_the_whole_file_in_blocks(tmp_path: Path) -> None:
    content = bytes(range(256)) * 1024
    path = tmp_path / "flight.tlog"
    path.write_bytes(content)
    blocks = list(LogReader(str(path)).blocks())
    assert b"".join(blocks) == content
    assert {len(block) for block in blocks} == {BLOCK}


def test_time_stands_still_after_a_small_step_back_until_the_log_catches_up() -> None:
    found, counts = times([0, 1, 2, 0.5, 1.5, 2.5, 3])
    assert [mono for mono, _, _ in found] == [0, 1, 2, 2, 2, 2.5, 3]
    assert [unix for _, unix, _ in found] == [0, 1, 2, 2, 2, 2.5, 3]
    assert counts == Counts(held=2)


def test_many_small_steps_back_do_not_stop_time_longer_than_one() -> None:
    found, counts = times([10, 6, 2, 2.1])
    assert found == [(0, 10, False), (0, 10, False), (0, 2, True), (0.1, 2.1, False)]
    assert counts == Counts(held=1, jumps=1)


@pytest.mark.parametrize("jump", [-3600, -12, 86402, 900 * 86400])
def test_a_lasting_jump_starts_a_new_segment_and_adds_no_time(jump: float) -> None:
    found, counts = times([0, 1, 1 + jump, 2 + jump, 3 + jump])
    assert found == [(0, 0, False), (1, 1, False), (1, 1 + jump, True), (2, 2 + jump, False), (3, 3 + jump, False)]
    assert counts == Counts(jumps=1)


def test_a_silence_of_less_than_a_day_is_replayed() -> None:
    found, counts = times([0, 1, 80000, 80001])
    assert [mono for mono, _, _ in found] == [0, 1, 80000, 80001]
    assert counts == Counts()


def test_a_jump_after_a_silence_is_not_a_wrong_stamp() -> None:
    found, _ = times([0, 100, 3, 4])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (0, False), (3, False), (4, False)]
    found, _ = times([50, 100, 3, 4])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (50, False), (50, True), (51, False)]


def test_a_far_stamp_at_the_end_is_corrected() -> None:
    for last in (-3600, 90000):
        found, counts = times([0, 1, last])
        assert found[-1] == (1, 1, False)
        assert counts == Counts(corrected=1)


def test_a_wrong_first_stamp_ends_at_the_second() -> None:
    found, counts = times([-START / SECOND, 0, 1])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (0, True), (1, False)]
    assert counts == Counts(jumps=1)


@given(
    st.lists(st.one_of(st.integers(0, (1 << 64) - 1), st.integers(0, 20).map(lambda s: START + s * SECOND)), min_size=1)
)
def test_time_never_decreases_for_any_stamps(stamps: list[int]) -> None:
    counts = Counts()
    found = records(stamps, counts)
    monos = [now.mono for now, _, _ in found]
    assert monos == sorted(monos)
    assert sum(new_segment for _, _, new_segment in found) == counts.jumps
    for (before, _, _), (after, _, new_segment) in itertools.pairwise(found):
        assert new_segment or after.unix_us >= before.unix_us


def test_neighbours_are_five_seconds_back_to_a_day_forward() -> None:
    assert follows(START, START - SMALL_STEP_US)
    assert follows(START, START + DAY_US)
    assert not follows(START, START - SMALL_STEP_US - 1)
    assert not follows(START, START + DAY_US + 1)
    assert not follows(START, END)


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (None, "cannot read the log '{}': No such file or directory"),
        (b"", "the log '{}' is empty"),
    ],
)
def test_a_file_that_is_not_a_log_is_a_one_line_error(tmp_path: Path, content: bytes | None, part: str) -> None:
    path = tmp_path / "flight.tlog"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError, match=re.escape(part.format(path))):
        LogReader(str(path))


def test_a_directory_is_not_a_log(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Is a directory"):
        LogReader(str(tmp_path))
