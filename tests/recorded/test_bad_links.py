"""Recordings over bad links: the status becomes UNKNOWN or late there. It calls no live vehicle safe."""

from __future__ import annotations

import functools
from collections import Counter

import pytest

from .bad_link_verdicts import Damaged, Recording, Verdicts
from .bad_links import BAD_LINKS, SECOND, UNTIL_LOST, Record, damaged, read, written
from .replays import OURS, Lines

LOGS = sorted(OURS.glob("*.tlog"))
LOG = OURS / "px4-rover-1.17dev-aa850d5c1c-estop.tlog"
LONG_LOG = OURS / "arducopter-4.5.6-estop.tlog"

# The least share of right answers, of those that are right in the undamaged recordings, and the most WRONG ones.
# WRONG may be what a lost message has said that is sent only once.
LIMITS = {
    "each frame again after 5 ms": (0.995, 0),
    "each frame again after 100 to 200 ms": (0.995, 0),
    "30 % of the frames again within 10 ms": (0.995, 0),
    "each frame up to 200 ms late": (0.995, 0),
    "5 s of 20 s held, then delivered at once": (0.99, 0),
    "30 % of the frames lost": (0.98, 0),
    "60 % of the frames lost": (0.83, 1),
    "silent for 1 to 4 s, 20 % of the time": (0.97, 1),
    "5 frames a second": (0.57, 4),
    "streams of one message in 5 s": (0.85, 0),
}


@functools.cache
def over(name: str) -> list[Damaged]:
    """Every recording, over the bad link of this name."""
    return [recording.over(name) for recording in recordings()]


@functools.cache
def recordings() -> list[Recording]:
    return [Recording(log) for log in LOGS]


@functools.cache
def records() -> list[Record]:
    return read(LONG_LOG)


# -- the status -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", BAD_LINKS)
def test_over_a_bad_link_no_line_calls_a_live_vehicle_safe(name: str) -> None:
    safe = {one.undamaged.log.name: lines for one in over(name) if (lines := list(one.safe_lines()))}
    assert not safe


@pytest.mark.parametrize("name", BAD_LINKS)
def test_over_a_bad_link_few_answers_are_lost_and_hardly_one_is_wrong(name: str) -> None:
    verdicts = functools.reduce(Verdicts.plus, (one.verdicts() for one in over(name)))
    least, most = LIMITS[name]
    assert verdicts.safe == ()
    assert len(verdicts.wrong) <= most, verdicts.wrong
    assert verdicts.right >= least * verdicts.right_undamaged, verdicts


# -- the judge --------------------------------------------------------------------------------------------------------


def with_answers(excused: float, **answers: object) -> Damaged:
    """A recording whose status, without damage, has these answers all the time."""
    recording = Recording(LOG)
    rows = [{**row, **answers} for row in recording.lines.rows]
    return Damaged(recording, recording.heard, Lines(recording.lines.stamps, rows), excused)


@pytest.mark.parametrize("answers", [{"drives_powered": False}, {"motion_possible": False}, {"e_stopped": True}])
def test_an_answer_that_calls_a_live_vehicle_safe_is_found(answers: dict[str, object]) -> None:
    status = with_answers(UNTIL_LOST, **answers)
    assert {one.field for one in status.verdicts().safe} == set(answers)
    assert {field for _, field in status.safe_lines()} == set(answers)


def test_an_answer_in_the_other_direction_is_wrong_and_not_safe() -> None:
    status = with_answers(0.0, drives_powered=True)
    verdicts = status.verdicts()
    assert verdicts.wrong
    assert not verdicts.safe
    assert not list(status.safe_lines())


def test_a_disarmed_status_is_excused_until_an_arming_gets_through() -> None:
    status = with_answers(UNTIL_LOST, drives_powered=False)
    armed = status.heard.last_arming(status.lines.stamps[-1])[1]
    told = [t for t, _ in status.safe_lines()]
    deaf = status._replace(heard=status.heard._replace(heartbeats=[], accepted=[]))
    not_told = [t for t, _ in deaf.safe_lines()]
    assert min(t for t in told if t > armed) < armed + 0.2
    lines = zip(*status.undamaged.lines, strict=True)
    said = max(t for t, row in lines if t < armed and row["drives_powered"] is False)
    assert min(t for t in not_told if t > armed) == pytest.approx(said + UNTIL_LOST, abs=0.2)


def test_an_answer_in_a_silence_does_not_count() -> None:
    status = with_answers(0.0, drives_powered=True, e_stopped=None)
    silent = status._replace(heard=status.heard._replace(arrivals=[]))
    assert silent.verdicts() == Verdicts()
    assert status.verdicts().checkpoints == len(status.undamaged.judged)


# -- the damage -------------------------------------------------------------------------------------------------------


def test_a_log_that_is_read_and_written_is_the_same() -> None:
    assert written(read(LOG)) == LOG.read_bytes()


@pytest.mark.parametrize("name", BAD_LINKS)
def test_no_frame_is_changed_invented_or_early(name: str) -> None:
    after = damaged(records(), name)
    assert {one.frame for one in after} <= {one.frame for one in records()}
    assert all(one.arrival >= one.frame.stamp for one in after)
    assert after == sorted(after, key=lambda one: one.arrival)


@pytest.mark.parametrize("name", BAD_LINKS)
def test_a_damage_can_be_repeated(name: str) -> None:
    assert damaged(records(), name, "a seed") == damaged(records(), name, "a seed")


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("each frame again after 5 ms", 2.0, 2.0),
        ("each frame again after 100 to 200 ms", 2.0, 2.0),
        ("30 % of the frames again within 10 ms", 1.25, 1.35),
        ("each frame up to 200 ms late", 1.0, 1.0),
        ("5 s of 20 s held, then delivered at once", 1.0, 1.0),
        ("30 % of the frames lost", 0.65, 0.75),
        ("60 % of the frames lost", 0.35, 0.45),
        ("silent for 1 to 4 s, 20 % of the time", 0.75, 0.85),
    ],
)
def test_a_damage_loses_and_repeats_its_share(name: str, least: float, most: float) -> None:
    shares = [len(damaged(records(), name, seed)) / len(records()) for seed in range(10)]
    assert least <= sum(shares) / len(shares) <= most


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("each frame up to 200 ms late", 0.19, 0.2),
        ("5 s of 20 s held, then delivered at once", 4.9, 5.0),
        ("each frame again after 100 to 200 ms", 0.19, 0.2),
    ],
)
def test_a_frame_is_as_late_as_the_damage_says(name: str, least: float, most: float) -> None:
    assert least <= max(one.arrival - one.frame.stamp for one in damaged(records(), name)) / SECOND <= most


def test_a_slow_link_has_its_frames_each_second_and_heartbeats_among_them() -> None:
    after = damaged(records(), "5 frames a second")
    seconds = Counter((one.arrival - after[0].arrival) // SECOND for one in after)
    heartbeats = sum(one.frame.message_id == 0 for one in after)
    assert max(seconds.values()) <= 2 * 5
    assert heartbeats > len(seconds) / 3


def test_slow_streams_have_all_heartbeats_and_texts() -> None:
    after = damaged(records(), "streams of one message in 5 s")
    counts, all_counts = (Counter(one.frame.message_id for one in some) for some in (after, records()))
    duration = (records()[-1].arrival - records()[0].arrival) / SECOND
    kept = {0, 77, 253, 410, 411}
    assert {i: counts[i] for i in kept} == {i: all_counts[i] for i in kept}
    assert max(counts[i] for i in counts if i not in kept) <= duration / 5 + 1
