"""REQUEST_EVENT: each lost event is asked for once."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.requests.scheduler import LostEvents


def test_a_run_of_lost_events_is_one_request() -> None:
    lost = LostEvents(1, 1)
    request = lost.due((65534, 65535, 0, 1))
    assert request is not None
    assert (request.first_sequence, request.last_sequence) == (65534, 1)
    assert (request.target_system, request.target_component) == (1, 1)
    assert lost.due((65534, 65535, 0, 1)) is None


def test_two_gaps_are_two_requests() -> None:
    lost = LostEvents(1, 1)
    requests = [lost.due((3, 4, 8)) for _ in range(3)]
    assert [(r.first_sequence, r.last_sequence) if r else None for r in requests] == [(3, 4), (8, 8), None]


def test_a_number_of_another_run_is_asked_for_again() -> None:
    lost = LostEvents(1, 1)
    assert lost.due((3,))
    assert lost.due(()) is None
    assert lost.due((3,))


@given(st.lists(st.integers(0, 65535), max_size=20, unique=True))
def test_every_lost_event_is_asked_for_exactly_once(missing: list[int]) -> None:
    lost = LostEvents(1, 1)
    asked: list[int] = []
    while (request := lost.due(tuple(missing))) is not None:
        number = ((request.last_sequence - request.first_sequence) & 0xFFFF) + 1
        asked += [(request.first_sequence + i) & 0xFFFF for i in range(number)]
    assert asked == missing
