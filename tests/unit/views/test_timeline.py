from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.interface import Evidence, Inhibit
from mav_robot_status.views.timeline import TRACKS, Reason, Span

from .flights import FALSE, START_US, TRUE, UNKNOWN, Flight, S, error


def values(spans: list[Span]) -> list[tuple[float, float, str]]:
    return [(span.start / S, span.end / S, span.value) for span in spans]


def test_a_constant_value_is_one_interval() -> None:
    flight = Flight().say(0, in_motion=FALSE).say(1, in_motion=FALSE, in_error=FALSE).say(2, in_motion=TRUE)
    assert values(flight.vehicle(5).tracks["in_motion"]) == [(0, 2, "FALSE"), (2, 5, "TRUE")]


def test_unknown_is_a_separate_value() -> None:
    flight = Flight().say(0, in_error=FALSE).say(1, in_error=UNKNOWN).say(2, in_error=TRUE)
    assert [value for *_, value in values(flight.vehicle(3).tracks["in_error"])] == ["FALSE", "UNKNOWN", "TRUE"]


def test_an_interval_has_the_evidence_of_its_start() -> None:
    flight = Flight().say(0, in_error=FALSE, because=Evidence("no cause is active", "SYS_STATUS", 100.0))
    flight.say(1, in_error=FALSE, in_motion=TRUE, because=Evidence("another rule", None, None))
    (span,) = flight.vehicle(2).tracks["in_error"]
    assert (span.rule, span.source) == ("no cause is active", "SYS_STATUS")


def test_the_tracks_of_a_vehicle_begin_with_its_first_heartbeat() -> None:
    vehicle = Flight().say(4, in_motion=FALSE).vehicle(5)
    assert all(spans[0].start == 4 * S for spans in vehicle.tracks.values())


def test_an_empty_interval_is_left_out() -> None:
    flight = Flight().say(0, in_motion=FALSE).say(1, in_motion=TRUE).say(1, in_motion=FALSE)
    assert [value for *_, value in values(flight.vehicle(2).tracks["in_motion"])] == ["FALSE", "FALSE"]


def test_a_vehicle_is_armed_without_the_inhibit_disarmed_and_unknown_on_a_lost_link() -> None:
    flight = Flight().say(0, armed=False).say(1).lose(2).say(3)
    assert values(flight.vehicle(4).tracks["armed"]) == [
        (0, 1, "FALSE"),
        (1, 2, "TRUE"),
        (2, 3, "UNKNOWN"),
        (3, 4, "TRUE"),
    ]


def test_the_same_inhibit_of_two_members_is_two_intervals_and_a_group_is_not_armed() -> None:
    flight = Flight()
    flight.detail = flight.detail._replace(members=("base", "arm"))
    of_arm, of_base = (Inhibit("E_STOPPED", None, START_US, handle) for handle in ("arm", "base"))
    vehicle = flight.say(0, inhibits=(of_arm, of_base)).say(2, inhibits=(of_base,)).vehicle(3)
    assert [(reason.title, reason.end / S) for reason in vehicle.inhibits] == [
        ("arm: E_STOPPED", 2),
        ("base: E_STOPPED", 3),
    ]
    assert vehicle.members == ("base", "arm")
    assert values(vehicle.tracks["armed"]) == [(0, 3, "UNKNOWN")]


def test_a_lost_vehicle_keeps_its_name_and_has_no_flight_mode() -> None:
    vehicle = Flight().say(0).lose(2).vehicle(3)
    assert (vehicle.system, vehicle.component, vehicle.autopilot, vehicle.type) == (1, 1, "PX4", "QUADROTOR")
    assert values(vehicle.tracks["flight_mode"]) == [(0, 2, "POSCTL"), (2, 3, "")]
    assert values(vehicle.tracks["link"]) == [(0, 2, "CONNECTED"), (2, 3, "LOST")]


def test_causes_begin_and_end_independently() -> None:
    gps, rc = error(2008, "GPS"), error(2001, "RC_LOST", "Radio Failsafe")
    flight = Flight().say(0).say(1, errors=(gps,)).say(2, errors=(rc, gps)).say(3, errors=(rc,)).say(4)
    assert flight.vehicle(5).errors == [
        Reason(1 * S, 3 * S, "GPS", 2008, None),
        Reason(2 * S, 4 * S, "RC_LOST", 2001, "Radio Failsafe"),
    ]


def test_a_new_text_of_a_reason_begins_another_interval() -> None:
    flight = Flight()
    for second, text in ((0, "GPS"), (1, "GPS"), (2, "Compass")):
        flight.say(second, armed=False, inhibits=(Inhibit("PREARM_FAILING", text, START_US),))
    found = [reason for reason in flight.vehicle(3).inhibits if reason.name == "PREARM_FAILING"]
    assert found == [
        Reason(0, 2 * S, "PREARM_FAILING", None, "GPS"),
        Reason(2 * S, 3 * S, "PREARM_FAILING", None, "Compass"),
    ]


def test_several_texts_of_one_reason_begin_and_end_independently() -> None:
    gps, compass = (Inhibit("PREARM_FAILING", text, START_US) for text in ("GPS", "Compass"))
    flight = Flight().say(0, inhibits=(gps,)).say(1, inhibits=(gps, compass)).say(3, inhibits=(compass,)).say(4)
    assert flight.vehicle(5).inhibits == [
        Reason(0, 3 * S, "PREARM_FAILING", None, "GPS"),
        Reason(1 * S, 4 * S, "PREARM_FAILING", None, "Compass"),
    ]


def test_no_interval_spans_a_jump_of_the_clock() -> None:
    flight = Flight().say(0, in_motion=TRUE, errors=(error(2008, "GPS"),))
    flight.jump(3, -7200 * S).say(4, in_motion=TRUE, errors=(error(2008, "GPS"),))
    timeline = flight.end(6)
    assert values(timeline.vehicles[0].tracks["in_motion"]) == [(0, 3, "TRUE"), (4, 6, "TRUE")]
    assert [(reason.start, reason.end) for reason in timeline.vehicles[0].errors] == [(0, 3 * S), (4 * S, 6 * S)]
    assert [(segment.start, segment.end) for segment in timeline.segments] == [(0, 3 * S), (3 * S, 6 * S)]


def test_each_segment_has_its_own_start_in_utc() -> None:
    timeline = Flight().say(0).jump(3, 7200 * S).say(4).end(6)
    assert timeline.unix_us(0, 3 * S) == START_US + 3 * S
    assert timeline.unix_us(3 * S, 3 * S) == START_US + 7203 * S
    assert timeline.unix_us(4 * S, 6 * S) == START_US + 7206 * S


def test_an_empty_log_has_no_length() -> None:
    assert Flight().end(0).end == 0


steps = st.lists(
    st.tuples(st.integers(0, 3), st.sampled_from(["say", "lose", "jump"]), st.sampled_from([TRUE, FALSE, UNKNOWN])),
    max_size=30,
)


@given(steps)
def test_intervals_of_a_track_never_overlap_and_leave_no_gap_after_the_first_heartbeat(
    story: list[tuple[int, str, object]],
) -> None:
    flight, second = Flight().say(0), 0
    for wait, what, value in story:
        second += wait
        if what == "say":
            flight.say(second, in_motion=value)  # type: ignore[arg-type]
        elif what == "lose":
            flight.lose(second)
        else:
            flight.jump(second, 10**12).say(second)
    timeline = flight.end(second + 1)
    for name in TRACKS:
        spans = timeline.vehicles[0].tracks[name]
        assert all(before.end <= after.start for before, after in itertools.pairwise(spans))
        assert sum(span.end - span.start for span in spans) == timeline.end
