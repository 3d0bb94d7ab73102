"""The verdict on a log: what, when, why, how it ended. One story each."""

from __future__ import annotations

import pytest

from mav_robot_status.views.timeline import Reason, Segment, Span, Timeline, VehicleTimeline
from mav_robot_status.views.verdict import LONGEST, verdict

SECOND = 1_000_000
END = 100 * SECOND
START_US = 1_800_000_000_000_000  # 08:00:00


def spans(*values: tuple[float, str] | tuple[float, str, str, str]) -> list[Span]:
    """A track: each value from its second to the next."""
    ends = [*(round(value[0] * SECOND) for value in values[1:]), END]
    return [Span(round(v[0] * SECOND), end, *v[1:]) for v, end in zip(values, ends, strict=True)]


def said(errors: tuple[Reason, ...] = (), inhibits: tuple[Reason, ...] = (), **tracks: list[Span]) -> tuple[str, str]:
    """The verdict on a vehicle that is linked throughout."""
    vehicle = VehicleTimeline("handle", 1, 1)
    vehicle.tracks |= {"link": spans((0, "CONNECTED")), **tracks}
    vehicle.errors, vehicle.inhibits = list(errors), list(inhibits)
    found = verdict(Timeline("flight", [Segment(0, END, START_US)], [vehicle]), vehicle)
    assert len(found.sentence) <= LONGEST
    assert found.members()["state"] == found.state.word.replace(" ", "_")
    return found.state.word, found.sentence


def error(start: float, end: float, name: str, text: str | None = None) -> Reason:
    return Reason(round(start * SECOND), round(end * SECOND), name, 1, text)


ARMED = spans((0, "FALSE"), (20, "TRUE", "armed by ground station 255", "ARM.Method 1"), (70, "FALSE"))


def test_a_stop_in_motion_comes_before_one_at_rest() -> None:
    rule = "emergency stop by ground station 255 while it moved at 4.1 m/s"
    stops = spans((0, "FALSE"), (10, "TRUE"), (15, "FALSE"), (50.9, "TRUE", rule, "EV 54"), (58, "FALSE"))
    moves = spans((0, "FALSE"), (30, "TRUE"), (54, "FALSE"))
    assert said(e_stopped=stops, armed=ARMED, in_motion=moves) == (
        "EMERGENCY STOP",
        "EMERGENCY STOP at +50.9 s (08:00:50) while it moved at 4.1 m/s (by ground station 255, EV 54); "
        "released at +58.0 s (08:00:58); 2 stops in all.",
    )


def test_a_stop_of_the_wire_that_lasts() -> None:
    stops = spans((0, "FALSE"), (60, "TRUE", "the autopilot said so", "STATUSTEXT: RC7: MotorEStop HIGH"))
    assert said(e_stopped=stops, armed=ARMED)[1] == (
        "EMERGENCY STOP at +60.0 s (08:01:00) while it was armed (STATUSTEXT: RC7: MotorEStop HIGH); still engaged at "
        "the end of the log."
    )


def test_a_stop_of_a_parked_robot_that_is_released_does_not_hide_a_crash() -> None:
    stops = spans((0, "FALSE"), (10, "TRUE"), (15, "FALSE"))
    armed = spans((0, "FALSE"), (20, "TRUE"), (51.2, "FALSE", "disarmed by the crash check", "ARM.Method 12"))
    mode = spans((0, "MANUAL"), (35, "AUTO"))
    crash = error(50, 100, "CRASH", "Crash: Going to HOLD")
    assert said((crash,), e_stopped=stops, armed=armed, flight_mode=mode) == (
        "CRASHED",
        "CRASHED at +50.0 s (08:00:50), 15 s into AUTO: “Crash: Going to HOLD”; disarmed by the crash check "
        "(ARM.Method 12) 1.2 s later.",
    )


def test_a_disarm_in_the_air_by_a_failsafe() -> None:
    armed = spans((0, "FALSE"), (20, "TRUE"), (93.4, "FALSE", "disarmed by the battery failsafe", "ARM.Method 7"))
    moves = spans((0, "FALSE"), (25, "TRUE", "airborne", "EV 28"))
    assert said(armed=armed, in_motion=moves)[1] == (
        "FAULT: disarmed in the air at +93.4 s (08:01:33) by the battery failsafe (ARM.Method 7)."
    )


def test_a_failsafe_that_takes_over() -> None:
    mode = spans((0, "LOITER"), (40, "RTL", "mode RTL, by the radio failsafe", "MODE.Rsn 3"))
    assert said(armed=ARMED, flight_mode=mode)[1] == (
        "FAULT: the radio failsafe switched to RTL at +40.0 s (08:00:40) (MODE.Rsn 3); disarmed at +70.0 s (08:01:10)."
    )


def test_an_error_of_the_wire() -> None:
    assert said((error(30, 35, "RC_LOST", "Radio Failsafe"),), armed=ARMED)[1] == (
        "FAULT at +30.0 s (08:00:30): RC_LOST: “Radio Failsafe”; disarmed at +70.0 s (08:01:10)."
    )


def test_never_armed_with_the_last_reason() -> None:
    first = Reason(0, 12 * SECOND, "PREARM_FAILING", None, "PreArm: Accels inconsistent")
    last = Reason(12 * SECOND, END, "PREARM_FAILING", None, "PreArm: Compass not healthy")
    assert said((error(12, 100, "SENSOR_3D_MAG"),), (first, last), armed=spans((0, "FALSE"))) == (
        "CANNOT ARM",
        "CANNOT ARM: never armed in 2 min; “PreArm: Compass not healthy” from +12.0 s (08:00:12) to the end.",
    )


def test_nothing_stopped_it() -> None:
    armed = spans((0, "FALSE"), (20, "TRUE"), (70, "FALSE", "disarmed by the landing", "ARM.Method 13"))
    mode = spans((0, "MANUAL"), (30, "AUTO"))
    assert said(armed=armed, mode=mode)[1] == (
        "READY: nothing stopped it, no fault: one drive of 50 s in MANUAL and AUTO, armed from +20.0 s (08:00:20) to "
        "+70.0 s (08:01:10), disarmed by the landing (ARM.Method 13)."
    )


def test_a_log_that_is_cut_off() -> None:
    moves = spans((0, "FALSE"), (30, "TRUE"))
    assert said(armed=spans((0, "FALSE"), (20, "TRUE")), in_motion=moves)[1] == (
        "MOVING: the log ends at +100.0 s (08:01:40) while it is armed and moving; it does not tell what happened then."
    )


@pytest.mark.parametrize(
    ("armed", "link", "sentence"),
    [
        ([(0, "FALSE")], [(0, "CONNECTED")], "PARKED: never armed in 2 min, no fault."),
        ([(0, "UNKNOWN")], [(0, "CONNECTED")], "UNKNOWN: the log of 2 min does not tell whether it was armed."),
        ([(0, "UNKNOWN")], [(0, "NEVER_SEEN")], "NOT HEARD: it is not heard in this log."),
        ([(0, "TRUE")], [(0, "CONNECTED"), (40, "LOST")], "LOST at +40.0 s (08:00:40), to the end of the log."),
    ],
)
def test_what_a_quiet_log_says(armed: list[tuple[float, str]], link: list[tuple[float, str]], sentence: str) -> None:
    assert said(armed=spans(*armed), link=spans(*link))[1] == sentence


def test_a_long_text_is_cut() -> None:
    crash = error(50, 100, "CRASH", "Crash: " + "x" * 300)
    assert "…" in said((crash,), armed=ARMED)[1]
