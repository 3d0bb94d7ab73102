from __future__ import annotations

import logging
import math

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway.guards import Guard
from mav_robot_status.gateway.guards.publisher import GuardedPublisher
from mav_robot_status.interface import Detail, RobotStatus, RobotStatusMsg

NOW = Instant(0.0, 0)
MSG = RobotStatusMsg("robot", 0, RobotStatus(), Detail(), None)


class Faulty:
    periodic = False

    def __init__(self, error: Exception) -> None:
        self.error = error
        self.closed = False
        self.published = 0

    def busy(self) -> bool:
        return True

    def publish(self, msg: RobotStatusMsg) -> None:
        self.published += 1
        raise self.error

    def service(self, now: Instant) -> float | None:
        return 1.5

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(("told", "counted"), [(3, 3), (len, 0), ("many", 0), (None, 0)])
def test_a_publishers_counters_are_passed_on_if_they_are_numbers(told: object, counted: int) -> None:
    publisher = Faulty(ValueError())
    publisher.queued = publisher.dropped = told  # type: ignore[attr-defined]
    guarded = GuardedPublisher(publisher, "mine")
    assert (guarded.queued, guarded.dropped) == (counted, counted)


@pytest.mark.parametrize(
    ("told", "taken"), [(3.5, 3.5), (None, -math.inf), ("later", -math.inf), (math.nan, -math.inf)]
)
def test_a_publisher_rests_until_the_time_that_it_says(told: object, taken: float) -> None:
    publisher = Faulty(ValueError())
    publisher.rests_until = lambda handle: told  # type: ignore[attr-defined]
    assert GuardedPublisher(publisher, "mine").rests_until("robot") == taken


def test_a_publisher_that_says_nothing_or_fails_does_not_rest() -> None:
    publisher = Faulty(ValueError())
    guarded = GuardedPublisher(publisher, "mine")
    assert guarded.rests_until("robot") == -math.inf
    publisher.rests_until = lambda handle: 1 / 0  # type: ignore[attr-defined]
    assert guarded.rests_until("robot") == -math.inf


def test_a_guard_returns_the_result_of_the_function() -> None:
    assert Guard("x").call(0, max, 3, 4) == 4


def test_the_first_exception_is_logged_and_the_part_is_not_called_again(caplog: pytest.LogCaptureFixture) -> None:
    guard = Guard("controller 'arm'")
    with caplog.at_level(logging.ERROR):
        assert guard.call(7, int, "no number") == 7
        assert guard.call(7, int, "8") == 7
    assert [record.message for record in caplog.records] == [
        "controller 'arm' failed and is stopped; all other parts continue"
    ]


@pytest.mark.parametrize("error", [LinkError("full"), BrokenPipeError()])
def test_a_user_error_passes_through_the_guard_of_a_controller(error: Exception) -> None:
    with pytest.raises(type(error)):
        Guard("x").call(None, Faulty(error).publish, MSG)


def test_a_faulty_publisher_is_not_called_again_but_is_closed() -> None:
    faulty = Faulty(BrokenPipeError("its own socket"))
    guarded = GuardedPublisher(faulty, "mine")
    assert guarded.periodic is False
    assert guarded.busy() is True
    assert guarded.service(NOW) == 1.5
    guarded.publish(MSG)
    guarded.publish(MSG)
    assert faulty.published == 1
    assert guarded.busy() is False
    assert guarded.service(NOW) is None
    guarded.close()
    assert faulty.closed


def test_a_publisher_may_end_the_gateway_with_a_user_error() -> None:
    with pytest.raises(LinkError, match="for good"):
        GuardedPublisher(Faulty(LinkError("for good")), "mine").publish(MSG)
