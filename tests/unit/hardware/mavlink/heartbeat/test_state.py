from __future__ import annotations

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.heartbeat.state import (
    RUNS,
    HeartbeatHistory,
    Run,
    armed_before,
    first_heartbeat,
    next_heartbeat,
)
from mav_robot_status.mavlink.definitions import Heartbeat

from ..driver import ACTIVE, CRITICAL

NOW = Instant(1000.0, 1_800_000_000_000_000)


def beat(armed: bool, state: int = ACTIVE) -> Heartbeat:
    return Heartbeat(0, 2, 3, 0x81 if armed else 1, state, 3)


def beaten(*beats: tuple[float, bool, int]) -> HeartbeatHistory:
    (_, armed, state), *more = beats
    heartbeats = first_heartbeat(beat(armed, state), later(NOW, beats[0][0]))
    for seconds, armed, state in more:
        heartbeats = next_heartbeat(heartbeats, beat(armed, state), later(NOW, seconds), True)
    return heartbeats


def test_a_vehicle_that_is_already_armed_at_the_start_has_no_arming_edge() -> None:
    heartbeats = beaten((0, True, ACTIVE), (1, True, ACTIVE))
    assert (heartbeats.armed, heartbeats.edge, heartbeats.edge_seen) == (True, NOW, False)


def test_arming_and_disarming_are_edges() -> None:
    heartbeats = beaten((0, False, ACTIVE), (1, True, ACTIVE), (2, True, ACTIVE))
    assert (heartbeats.armed, heartbeats.edge, heartbeats.edge_seen) == (True, later(NOW, 1), True)
    heartbeats = next_heartbeat(heartbeats, beat(False), later(NOW, 3), True)
    assert (heartbeats.armed, heartbeats.edge) == (False, later(NOW, 3))


def test_a_connection_after_a_loss_starts_a_new_history() -> None:
    heartbeats = next_heartbeat(beaten((0, False, ACTIVE), (1, True, ACTIVE)), beat(True), later(NOW, 9), False)
    assert (heartbeats.since, heartbeats.edge, heartbeats.edge_seen) == (later(NOW, 9), later(NOW, 9), False)


def test_calm_is_counted_from_the_end_of_critical() -> None:
    assert beaten((0, True, ACTIVE), (1, True, ACTIVE)).calm_since == NOW.mono
    assert beaten((0, True, ACTIVE), (1, True, CRITICAL)).calm_since is None
    assert beaten((0, True, CRITICAL), (1, True, ACTIVE), (2, True, ACTIVE)).calm_since == NOW.mono + 1


def test_the_state_has_its_start_time() -> None:
    assert beaten((0, True, ACTIVE), (1, True, CRITICAL), (2, True, CRITICAL)).state_since == later(NOW, 1)


def test_equal_heartbeats_form_one_run_and_only_the_last_runs_are_kept() -> None:
    assert beaten((0, True, ACTIVE), (1, True, ACTIVE)).runs == (Run(True, NOW.mono, NOW.mono + 1),)
    assert len(beaten(*((float(n), n % 2 == 0, ACTIVE) for n in range(20))).runs) == RUNS


def test_the_last_heartbeat_before_a_moment_gives_the_state_at_that_moment() -> None:
    heartbeats = beaten((0, False, ACTIVE), (10, True, ACTIVE), (20, True, ACTIVE), (25, False, ACTIVE))
    assert not armed_before(heartbeats, NOW.mono + 9, 30)
    assert armed_before(heartbeats, NOW.mono + 22, 30)
    assert not armed_before(heartbeats, NOW.mono + 26, 30)
    assert not armed_before(heartbeats, NOW.mono - 1, 30)


def test_an_armed_heartbeat_long_before_the_moment_is_ignored() -> None:
    heartbeats = beaten((0, True, ACTIVE), (100, False, ACTIVE))
    assert armed_before(heartbeats, NOW.mono + 30, 30)
    assert not armed_before(heartbeats, NOW.mono + 31, 30)
