from __future__ import annotations

from itertools import pairwise

from mav_robot_status.interface import Inhibit
from mav_robot_status.views.timeline import Span
from mav_robot_status.views.totals import MOST_TEXTS, ArmCycle, totals, within

from .flights import FALSE, START_US, TRUE, UNKNOWN, Flight, S, error


def test_the_time_in_each_state_is_added_up() -> None:
    flight = Flight().say(0, in_motion=FALSE).say(1, in_motion=TRUE).say(4, in_motion=FALSE).say(6, in_motion=UNKNOWN)
    assert totals(flight.vehicle(7)).values["in_motion"] == {"TRUE": 3 * S, "FALSE": 3 * S, "UNKNOWN": 1 * S}


def test_the_time_counts_from_the_first_heartbeat() -> None:
    assert totals(Flight().say(4).vehicle(10)).watched == 6 * S


def test_the_time_of_a_lost_link_is_no_linked_time() -> None:
    found = totals(Flight().say(0, in_motion=TRUE).lose(2).say(7, in_motion=FALSE).lose(8).vehicle(60))
    assert (found.watched, found.linked) == (60 * S, 3 * S)
    assert found.linked_values["in_motion"] == {"TRUE": 2 * S, "FALSE": S}
    assert found.values["in_motion"] == {"TRUE": 2 * S, "FALSE": S, "UNKNOWN": 57 * S}


def test_linked_time_is_that_of_each_value_inside_it() -> None:
    def spans(*ends: int) -> list[Span]:
        return [Span(a, b, str(a)) for a, b in pairwise(ends)]

    linked = [Span(2, 4, "CONNECTED"), Span(6, 12, "CONNECTED")]
    assert [one[:2] for one in within(spans(0, 3, 7, 9, 20), linked)] == [(2, 3), (3, 4), (6, 7), (7, 9), (9, 12)]


def test_a_jump_of_the_clock_adds_no_time() -> None:
    found = totals(Flight().say(0).jump(3, 10**12).say(3).vehicle(5))
    assert found.watched == 5 * S
    assert found.values["link"] == {"CONNECTED": 5 * S}


def test_each_arming_begins_a_cycle() -> None:
    flight = Flight().say(0, armed=False).say(1).say(3, armed=False).say(5)
    assert totals(flight.vehicle(6)).arm_cycles == (ArmCycle(S, 3 * S, 2 * S), ArmCycle(5 * S, 6 * S, S))


def test_a_cycle_continues_over_a_lost_link_if_the_vehicle_is_armed_afterwards() -> None:
    flight = Flight().say(0).lose(2).say(7).say(8, armed=False)
    assert totals(flight.vehicle(9)).arm_cycles == (ArmCycle(0, 8 * S, 3 * S),)


def test_a_cycle_ends_with_a_lost_link_if_the_vehicle_is_disarmed_afterwards() -> None:
    flight = Flight().say(0).lose(2).say(7, armed=False).say(8)
    assert totals(flight.vehicle(9)).arm_cycles == (ArmCycle(0, 2 * S, 2 * S), ArmCycle(8 * S, 9 * S, S))


def test_a_cause_that_begins_twice_counts_twice() -> None:
    gps = error(2008, "GPS")
    flight = Flight().say(0, errors=(gps,)).say(2).say(5, errors=(gps,))
    (found,) = totals(flight.vehicle(6)).errors
    assert (found.code, found.occurrences, found.active) == (2008, 2, 3 * S)


def test_texts_at_the_same_time_count_once() -> None:
    gps, compass, accels = (Inhibit("PREARM_FAILING", text, START_US) for text in ("GPS", "Compass", "Accels"))
    flight = Flight().say(0, inhibits=(gps, accels)).say(1, inhibits=(gps, compass)).say(3, inhibits=(compass,)).say(4)
    (found,) = totals(flight.say(6, inhibits=(gps,)).vehicle(7)).inhibits
    assert (found.occurrences, found.active) == (2, 5 * S)
    assert set(found.texts) == {"GPS", "Compass", "Accels"}


def test_a_cause_with_a_new_text_counts_once() -> None:
    flight = Flight().say(0, errors=(error(6002, "TEXT_CRITICAL", "a"),))
    flight.say(2, errors=(error(6002, "TEXT_CRITICAL", "b"),)).say(3)
    (found,) = totals(flight.vehicle(6)).errors
    assert (found.occurrences, found.active, found.texts) == (1, 3 * S, ("a", "b"))


def test_the_number_of_texts_is_bounded() -> None:
    flight = Flight()
    for second in range(3 * MOST_TEXTS):
        flight.say(second, errors=(error(6002, "TEXT_CRITICAL", f"text {second}"),))
    (found,) = totals(flight.vehicle(100)).errors
    assert found.texts == tuple(f"text {second}" for second in range(MOST_TEXTS))


def test_the_longest_reason_comes_first() -> None:
    short, long = Inhibit("SAFETY_SWITCH", None, START_US), Inhibit("HIL", None, START_US)
    flight = Flight().say(0, inhibits=(short, long)).say(1, inhibits=(long,))
    assert [total.name for total in totals(flight.vehicle(3)).inhibits] == ["HIL", "SAFETY_SWITCH"]
