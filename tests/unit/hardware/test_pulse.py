from __future__ import annotations

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.pulse import RUNS, Pulse, Run, armed_before, first_beat, next_beat
from mav_robot_status.mavlink.definitions import Heartbeat

from .driver import ACTIVE, CRITICAL

NOW = Instant(1000.0, 1_800_000_000_000_000)


def beat(armed: bool, state: int = ACTIVE) -> Heartbeat:
    return Heartbeat(0, 2, 3, 0x81 if armed else 1, state, 3)


def beaten(*beats: tuple[float, bool, int]) -> Pulse:
    (_, armed, state), *more = beats
    pulse = first_beat(beat(armed, state), later(NOW, beats[0][0]))
    for seconds, armed, state in more:
        pulse = next_beat(pulse, beat(armed, state), later(NOW, seconds), True)
    return pulse


def test_a_vehicle_that_is_joined_armed_has_no_edge_seen() -> None:
    pulse = beaten((0, True, ACTIVE), (1, True, ACTIVE))
    assert (pulse.armed, pulse.edge, pulse.edge_seen) == (True, NOW, False)


def test_arming_and_disarming_are_edges() -> None:
    pulse = beaten((0, False, ACTIVE), (1, True, ACTIVE), (2, True, ACTIVE))
    assert (pulse.armed, pulse.edge, pulse.edge_seen) == (True, later(NOW, 1), True)
    pulse = next_beat(pulse, beat(False), later(NOW, 3), True)
    assert (pulse.armed, pulse.edge) == (False, later(NOW, 3))


def test_a_connection_after_a_loss_begins_anew() -> None:
    pulse = next_beat(beaten((0, False, ACTIVE), (1, True, ACTIVE)), beat(True), later(NOW, 9), False)
    assert (pulse.since, pulse.edge, pulse.edge_seen) == (later(NOW, 9), later(NOW, 9), False)


def test_calm_is_counted_from_the_end_of_critical() -> None:
    assert beaten((0, True, ACTIVE), (1, True, ACTIVE)).calm_since == NOW.mono
    assert beaten((0, True, ACTIVE), (1, True, CRITICAL)).calm_since is None
    assert beaten((0, True, CRITICAL), (1, True, ACTIVE), (2, True, ACTIVE)).calm_since == NOW.mono + 1


def test_the_state_is_dated() -> None:
    assert beaten((0, True, ACTIVE), (1, True, CRITICAL), (2, True, CRITICAL)).state_since == later(NOW, 1)


def test_heartbeats_in_a_row_are_one_run_and_only_the_last_runs_are_kept() -> None:
    assert beaten((0, True, ACTIVE), (1, True, ACTIVE)).runs == (Run(True, NOW.mono, NOW.mono + 1),)
    assert len(beaten(*((float(n), n % 2 == 0, ACTIVE) for n in range(20))).runs) == RUNS


def test_what_was_so_before_a_moment_is_told_by_the_last_heartbeat_before_it() -> None:
    pulse = beaten((0, False, ACTIVE), (10, True, ACTIVE), (20, True, ACTIVE), (25, False, ACTIVE))
    assert not armed_before(pulse, NOW.mono + 9, 30)
    assert armed_before(pulse, NOW.mono + 22, 30)
    assert not armed_before(pulse, NOW.mono + 26, 30)
    assert not armed_before(pulse, NOW.mono - 1, 30)


def test_an_armed_heartbeat_long_before_the_moment_says_nothing() -> None:
    pulse = beaten((0, True, ACTIVE), (100, False, ACTIVE))
    assert armed_before(pulse, NOW.mono + 30, 30)
    assert not armed_before(pulse, NOW.mono + 31, 30)
