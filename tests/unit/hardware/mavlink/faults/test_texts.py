"""Each row of the tables in docs/semantics/texts.md, with an example text of a vehicle."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.autopilots import ardupilot, px4, texts
from mav_robot_status.hardware.mavlink.autopilots.texts import Effect, TextRule, When, classify
from mav_robot_status.hardware.mavlink.faults import causes

from ..driver import ACTIVE, CRITICAL, TERMINATED, Flight, copter
from ..driver import px4 as px4_vehicle

CAUSE, CLEAR, ESTOP, RELEASE = Effect.CAUSE, Effect.CLEAR, Effect.ESTOP, Effect.RELEASE
READINESS, DETAIL, IGNORE = Effect.READINESS, Effect.DETAIL, Effect.IGNORE

ARDUPILOT: list[tuple[str, Effect, tuple[int, ...]]] = [
    # clearing texts
    ("Radio Failsafe Cleared", CLEAR, (2001,)),
    ("GCS Failsafe Cleared", CLEAR, (2002,)),
    ("MYGCS: 255 Failsafe Cleared", CLEAR, (2001, 2002)),
    ("EKF Failsafe Cleared", CLEAR, (2005,)),
    ("EKF failsafe cleared", CLEAR, (2005,)),
    ("Battery Failsafe Cleared", CLEAR, (2003, 2004)),
    ("Terrain Failsafe Cleared", CLEAR, (2006,)),
    ("Short Failsafe Cleared", CLEAR, (2001, 2002)),
    ("RC Long Failsafe Cleared", CLEAR, (2001, 2002)),
    ("Failsafe ended", CLEAR, (2001, 2002)),
    ("GCS Failsafe Off", CLEAR, (2002,)),
    ("Throttle failsafe off", CLEAR, (2001, 2002)),
    ("Failsafe. Short event off", CLEAR, (2001, 2002)),
    ("Failsafe. Long event off", CLEAR, (2001, 2002)),
    ("Glitch cleared", CLEAR, (2008,)),
    ("GPS Glitch cleared", CLEAR, (2008,)),
    ("Dead Reckoning stopped", CLEAR, (2008,)),
    ("Dead Reckoning timeout", CLEAR, (2008,)),
    ("Fence breach cleared", CLEAR, (2009,)),
    ("Aborting termination due to GCS request", CLEAR, (1002,)),
    ("Vibration compensation ON", IGNORE, ()),
    ("Vibration compensation OFF", IGNORE, ()),
    ("EKF primary changed:1", IGNORE, ()),
    ("EKF3 lane switch 1", IGNORE, ()),
    # emergency stop
    ("PreArm: Motors Emergency Stopped", ESTOP, ()),
    ("Arm: Motors Emergency Stopped", ESTOP, ()),
    ("MotorTest: Motor Emergency Stopped", ESTOP, ()),
    ("RC7: MotorEStop HIGH", ESTOP, ()),
    ("RC16: MotorEStop LOW", RELEASE, ()),
    # arming checks
    ("PreArm: Hardware safety switch", READINESS, ()),
    ("Arm: Hardware safety switch", READINESS, ()),
    ("PreArm: Internal errors 0x400 l:120 flow_of_ctrl", CAUSE, (5001,)),
    ("PreArm: Compass not calibrated", READINESS, ()),
    ("Arm: Mode requires mission", READINESS, ()),
    # crash and damage
    ("Crash: Disarming: AngErr=42>30, Accel=0.5<3.0", CAUSE, (4001,)),
    ("Crash: Going to HOLD", CAUSE, (4001,)),
    ("Crash detected", CAUSE, (4001,)),
    ("Crash detected. No action taken", CAUSE, (4001,)),
    ("Hard landing detected", CAUSE, (4002,)),
    ("Potential Thrust Loss (3)", CAUSE, (4003,)),
    ("Yaw Imbalance 92%", CAUSE, (4005,)),
    ("Parachute: Released", CAUSE, (4004,)),
    ("Parachute: Released again", IGNORE, ()),
    ("Terminating due to fence breach", CAUSE, (1002,)),
    ("Terminating due to RC failure", CAUSE, (1002,)),
    ("Terminating due to GCS request", CAUSE, (1002,)),
    # failsafes
    ("Radio + Battery Failsafe - Disarming", CAUSE, (2001,)),
    ("GCS + Battery Failsafe - Landing", CAUSE, (2002,)),
    ("Failsafe trigger 0x1", CAUSE, (2001,)),
    ("Failsafe trigger 0x2", CAUSE, (2002,)),
    ("Failsafe trigger 0x3", CAUSE, (2001, 2002)),
    ("Failsafe trigger 0x10", CAUSE, (2000,)),
    ("Radio Failsafe", CAUSE, (2001,)),
    ("Radio Failsafe - Disarming", CAUSE, (2001,)),
    ("RC Failsafe", CAUSE, (2001,)),
    ("RC Short Failsafe On", CAUSE, (2001,)),
    ("RC Long Failsafe On", CAUSE, (2001,)),
    ("Throttle failsafe on", CAUSE, (2001,)),
    ("Failsafe. Short event on", CAUSE, (2001,)),
    ("Failsafe. Long event on", CAUSE, (2001,)),
    ("Lost manual control", CAUSE, (2001,)),
    ("GCS Failsafe - Disarming", CAUSE, (2002,)),
    ("GCS Failsafe On: Long", CAUSE, (2002,)),
    ("MYGCS: 255, heartbeat lost", CAUSE, (2002,)),
    ("Battery 1 is low 10.50V used 1500 mAh", CAUSE, (2003,)),
    ("Battery 1 is critical 10.10V used 2100 mAh", CAUSE, (2004,)),
    ("Battery Failsafe - Landing", CAUSE, (2003,)),
    ("Low Battery!", CAUSE, (2003,)),
    ("Low battery", CAUSE, (2003,)),
    ("EKF Failsafe: changed to LAND Mode", CAUSE, (2005,)),
    ("EKF failsafe", CAUSE, (2005,)),
    ("EKF variance: over limits", CAUSE, (2005,)),
    ("EKF bad", CAUSE, (2005,)),
    ("Failsafe: Terrain data missing", CAUSE, (2006,)),
    ("Failsafe terrain triggered", CAUSE, (2006,)),
    ("GPS Glitch or Compass error", CAUSE, (2008,)),
    ("Dead Reckoning started", CAUSE, (2008,)),
    ("Circle fence breached", CAUSE, (2009,)),
    ("Min Alt, Polygon fences breached", CAUSE, (2009,)),
    ("Fence Breached", CAUSE, (2009,)),
    ("Leak Detected", CAUSE, (2010,)),
    ("Internal pressure critical!", CAUSE, (2011,)),
    ("Internal temperature critical!", CAUSE, (2012,)),
    ("Depth sensor error!", CAUSE, (2013,)),
    # the autopilot itself
    ("Internal Errors 0x400", CAUSE, (5001,)),
    ("Config Error: fix problem then reboot", CAUSE, (5002,)),
    ("WDG: T3 SL120 FL0 FT0", CAUSE, (5003,)),
    # ignored texts
    ("Arming motors", IGNORE, ()),
    ("Disarming motors", IGNORE, ()),
    ("Throttle armed", IGNORE, ()),
    ("Throttle disarmed", IGNORE, ()),
    ("Flight mode change failed", IGNORE, ()),
    ("No such mode 29", IGNORE, ()),
    ("Mode change to AUTO failed: init failed", IGNORE, ()),
]

ALWAYS, ARMED, IN_CRITICAL, IN_TROUBLE = When.ALWAYS, When.ARMED, When.CRITICAL, When.IN_TROUBLE
PX4: list[tuple[str, Effect, tuple[int, ...], When]] = [
    ("GCS connection regained", CLEAR, (2002,), ALWAYS),
    ("Connection to ground station regained", CLEAR, (2002,), ALWAYS),
    ("Kill engaged", ESTOP, (), ALWAYS),
    ("Kill disengaged", RELEASE, (), ALWAYS),
    ("Kill-switch engaged", ESTOP, (), ALWAYS),
    ("Manual kill-switch disengaged", RELEASE, (), ALWAYS),
    ("MANUAL KILL-SWITCH ENGAGED", ESTOP, (), ALWAYS),
    ("Switching to this mode is currently not possible", IGNORE, (), ALWAYS),
    ("Using minimum takeoff altitude: 2.50 m", IGNORE, (), ALWAYS),
    ("Mission finished, loitering.", IGNORE, (), ALWAYS),
    ("Failsafe activated", DETAIL, (), ALWAYS),
    ("Failsafe activated: entering Hold for 5 seconds", DETAIL, (), ALWAYS),
    ("Connection to mission computer lost", CAUSE, (2002,), ALWAYS),
    ("Connection to ground station lost", CAUSE, (2002,), IN_CRITICAL),
    ("Preflight Fail: Kill switch engaged", DETAIL, (), ALWAYS),
    ("Preflight Fail: Flight termination active", DETAIL, (), ALWAYS),
    ("Preflight Fail: Press safety button first", READINESS, (), ALWAYS),
    ("Preflight Fail: Attitude failure (roll)", CAUSE, (4006,), IN_TROUBLE),
    ("Preflight Fail: Attitude failure (pitch)", CAUSE, (4006,), IN_TROUBLE),
    ("Preflight Fail: Altitude failure", CAUSE, (4006,), IN_TROUBLE),
    ("Preflight Fail: Motor failure detected", CAUSE, (4003,), IN_TROUBLE),
    ("Preflight Fail: ESC failure detected", CAUSE, (4003,), IN_TROUBLE),
    ("Preflight Fail: Imbalanced propeller detected", CAUSE, (4005,), IN_TROUBLE),
    ("Preflight Fail: No manual control input", READINESS, (), ALWAYS),
    ("Arming denied: Resolve system health failures first", READINESS, (), ALWAYS),
    ("Disarming denied: not landed", READINESS, (), ALWAYS),
    ("Switching to Mission is currently not available", READINESS, (), ALWAYS),
    ("Unsupported auto mode", READINESS, (), ALWAYS),
    ("Low battery", CAUSE, (2003,), ARMED),
    ("Critical battery", CAUSE, (2004,), ARMED),
    ("Emergency battery level", CAUSE, (2004,), ARMED),
    ("Dangerously low battery! Shutting system down", CAUSE, (2004,), ARMED),
    ("Battery 1 disconnected", CAUSE, (2004,), ARMED),
    ("Battery 1: Over temperature. Land now!", CAUSE, (2004,), ARMED),
    ("ESC1: over current. Land now!", CAUSE, (4003,), ARMED),
    ("ESC 1 offline. Land now!", CAUSE, (4003,), ARMED),
    ("Compass needs calibration - Land now!", CAUSE, (6002,), ARMED),
    ("GPS jamming detected", CAUSE, (6002,), ARMED),
    ("Maximum flight time reached", CAUSE, (6002,), ARMED),
    ("Parachute system lost", CAUSE, (6002,), ARMED),
]

NEVER = [
    "Initialising APM",
    "GROUND START",
    "Calibrating barometer",
    "Calibration successful",
    "command received: 400",
    "Place vehicle level and press any key.",
    "ODOMETRY: estimator_type 0 unsupported",
    "Not enough bandwidth to enable log streaming",
    "System does not support shutdown",
    "something cleared",
    "Something Cleared",
    "thing disengaged",
    "thing regained",
    "request denied",
    "mode not available",
    "Unsupported request",
    "self test OK",
    "calibration complete",
]


@pytest.mark.parametrize(("text", "effect", "codes"), ARDUPILOT, ids=[row[0] for row in ARDUPILOT])
def test_an_ardupilot_text_has_the_specified_effect(text: str, effect: Effect, codes: tuple[int, ...]) -> None:
    rule = classify(text, ardupilot.TEXTS)
    assert rule is not None
    assert (rule.effect, rule.codes, rule.when) == (effect, codes, When.ALWAYS)


@pytest.mark.parametrize(("text", "effect", "codes", "when"), PX4, ids=[row[0] for row in PX4])
def test_a_px4_text_has_the_specified_effect(text: str, effect: Effect, codes: tuple[int, ...], when: When) -> None:
    rule = classify(text, px4.TEXTS)
    assert rule is not None
    assert (rule.effect, rule.codes, rule.when) == (effect, codes, when)


@pytest.mark.parametrize(
    ("rules", "examples"),
    [
        (ardupilot.TEXTS, [row[0] for row in ARDUPILOT]),
        (px4.TEXTS, [row[0] for row in PX4]),
        (texts.COMMON, NEVER),
    ],
    ids=["ardupilot", "px4", "common"],
)
def test_every_row_has_an_example_that_no_earlier_row_matches(rules: tuple[TextRule, ...], examples: list[str]) -> None:
    reached = {id(classify(text, rules)) for text in examples}
    assert [rule.pattern for rule in rules if id(rule) not in reached] == []


@pytest.mark.parametrize("rules", [ardupilot.TEXTS, px4.TEXTS, texts.COMMON], ids=["ardupilot", "px4", "common"])
def test_every_code_in_a_row_is_a_cause(rules: tuple[TextRule, ...]) -> None:
    assert {code for rule in rules for code in rule.codes} <= causes.CAUSES.keys()
    assert all(rule.codes for rule in rules if rule.effect in (CAUSE, CLEAR))


@pytest.mark.parametrize("text", NEVER)
@pytest.mark.parametrize("vehicle", [copter, px4_vehicle], ids=["ardupilot", "px4"])
@pytest.mark.parametrize("severity", [0, 1, 2])
def test_some_texts_are_never_an_error_at_any_severity(vehicle: type[Flight], text: str, severity: int) -> None:
    flight = vehicle().hb(armed=True, state=ACTIVE)
    assert flight.text(text, severity).codes == []
    assert flight.text(f"Bad {severity}", severity).codes == [6000 + severity]


@pytest.mark.parametrize(
    ("text", "armed", "state", "codes"),
    [
        ("Low battery", False, ACTIVE, []),
        ("Low battery", True, ACTIVE, [2003]),
        ("Connection to ground station lost", True, ACTIVE, []),
        ("Connection to ground station lost", True, CRITICAL, [2002]),
        ("Preflight Fail: Motor failure detected", False, ACTIVE, []),
        ("Preflight Fail: Motor failure detected", True, ACTIVE, [4003]),
        ("Preflight Fail: Motor failure detected", False, TERMINATED, [1001, 4003]),
    ],
)
def test_a_px4_text_counts_only_if_the_vehicle_state_confirms_it(
    text: str, armed: bool, state: int, codes: list[int]
) -> None:
    assert px4_vehicle().hb(armed=armed, state=state).text(text, 2).codes == codes


def test_a_pattern_is_matched_from_the_start_and_case_sensitively() -> None:
    assert classify("no Leak Detected", ardupilot.TEXTS) is None
    assert classify("leak detected", ardupilot.TEXTS) is None
