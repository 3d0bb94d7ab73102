"""PX4.

Modes: `px4_custom_mode.h` of 1.17; custom_mode holds the main mode in bits 16-23 and the sub mode in bits 24-31. AUTO
sub modes from 11 up are external (ROS 2) modes whose numbers moved between versions, so they have no name here.

Texts: strings of 1.17-alpha, src/modules/commander; the TAB that ends them is stripped before matching.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode
from ....mavlink import enumerations as mavlink
from ..faults import causes
from . import sensor_weights, wanted
from .modes import FlightMode, ModeHints, other_name
from .profile import (
    Autopilot,
    EmergencyStop,
    HudSpeed,
    Modes,
    Recognition,
    Requests,
    Sensors,
    Speeds,
    States,
    Stops,
    StopText,
    Texts,
    Uninit,
    ZeroSpeed,
)
from .texts import Effect, When, table

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..identity import Family

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
CAUSE, CLEAR, DETAIL, IGNORE, READINESS = Effect.CAUSE, Effect.CLEAR, Effect.DETAIL, Effect.IGNORE, Effect.READINESS

MAIN: Final[dict[int, tuple[str, RobotMode]]] = {
    1: ("MANUAL", MANUAL),
    2: ("ALTCTL", MANUAL),
    3: ("POSCTL", MANUAL),
    4: ("AUTO", AUTO),
    5: ("ACRO", MANUAL),
    6: ("OFFBOARD", AUTO),
    7: ("STABILIZED", MANUAL),
    8: ("RATTITUDE", MANUAL),
    9: ("SIMPLE", MANUAL),  # reserved
    10: ("TERMINATION", UNKNOWN),  # nobody decides
    11: ("ALTITUDE_CRUISE", MANUAL),
}

SUB: Final[dict[tuple[int, int], tuple[str, RobotMode]]] = {
    (3, 1): ("POSCTL.ORBIT", AUTO),  # circles under program control
    (3, 2): ("POSCTL.SLOW", MANUAL),
    (4, 1): ("AUTO.READY", AUTO),
    (4, 2): ("AUTO.TAKEOFF", AUTO),
    (4, 3): ("AUTO.LOITER", AUTO),
    (4, 4): ("AUTO.MISSION", AUTO),
    (4, 5): ("AUTO.RTL", AUTO),
    (4, 6): ("AUTO.LAND", AUTO),
    (4, 7): ("AUTO.RTGS", AUTO),  # reserved
    (4, 8): ("AUTO.FOLLOW_TARGET", AUTO),
    (4, 9): ("AUTO.PRECLAND", AUTO),
    (4, 10): ("AUTO.VTOL_TAKEOFF", AUTO),
}


def mode_name(number: int) -> str | None:
    """The name of a custom_mode; None if it is not in the tables."""
    main, sub = number >> 16 & 0xFF, number >> 24 & 0xFF
    if (main, sub) in SUB:
        return SUB[main, sub][0]
    return MAIN[main][0] if sub == 0 and main in MAIN else None


def flight_mode(heartbeat: Heartbeat, family: Family, hints: ModeHints) -> FlightMode:
    """The mode by custom_mode alone: the flags of base_mode mislead (OFFBOARD sets neither MANUAL nor AUTO)."""
    number = heartbeat.custom_mode
    main, sub = number >> 16 & 0xFF, number >> 24 & 0xFF
    if (main, sub) in SUB:
        name, mode = SUB[main, sub]
    elif main in MAIN:
        main_name, mode = MAIN[main]
        name = main_name if sub == 0 else other_name(number, hints, f"{main_name}.{sub}")
    else:
        return FlightMode(RobotMode.UNKNOWN, other_name(number, hints), f"main mode {main} is not in PX4's table")
    return FlightMode(mode, name, "PX4's table")


TEXTS: Final = table(
    [
        (
            r"GCS connection regained|Connection to (ground station|mission computer) (regained|restored)",
            CLEAR,
            (causes.GCS_LOST,),
        ),
        # up to 1.11 only texts show a kill: no state FLIGHT_TERMINATION
        # later ones word it otherwise, and the text comes before the HEARTBEAT with the state
        (r"(?i)(manual )?kill(-switch)? engaged", Effect.ESTOP),
        (r"(?i)(manual )?kill(-switch)? disengaged", Effect.RELEASE),
        (r"Failsafe activated", DETAIL),
        (r"Connection to mission computer lost", CAUSE, (causes.GCS_LOST,)),
        (r"Connection to ground station lost", CAUSE, (causes.GCS_LOST,), When.CRITICAL),
        (r"Preflight Fail: (Kill switch engaged|Flight termination active)", DETAIL),
        (
            r"Preflight Fail: (Attitude failure \((roll|pitch)\)|.*Altitude failure)",
            CAUSE,
            (causes.ATTITUDE_FAILURE,),
            When.IN_TROUBLE,
        ),
        (r"Preflight Fail: .*(Motor|ESC) failure detected", CAUSE, (causes.THRUST_LOSS,), When.IN_TROUBLE),
        (r"Preflight Fail: .*Imbalanced propeller detected", CAUSE, (causes.YAW_IMBALANCE,), When.IN_TROUBLE),
        (r"Preflight Fail: ", READINESS),
        # answers to an operator, never an error
        (
            r"Arming denied: |Disarming denied: |Switching to .* is currently not available|Unsupported auto mode",
            READINESS,
        ),
        # severity 2 in older versions, but only responses to a request
        (r".* not possible|Using minimum takeoff altitude|Already (higher than takeoff altitude|landed)", IGNORE),
        (r"([Rr]everse )?[Mm]ission finished|offboard mission now running|no valid mission available", IGNORE),
        (r"Low battery", CAUSE, (causes.BATTERY_LOW,), When.ARMED),
        (
            r"Critical battery|Emergency battery level|Dangerously low battery!",
            CAUSE,
            (causes.BATTERY_CRITICAL,),
            When.ARMED,
        ),
        (r"Battery \d+ disconnected|Battery \d+: .*\. ", CAUSE, (causes.BATTERY_CRITICAL,), When.ARMED),
        (r"ESC\d+: .*\. |.*offline\. Land now!", CAUSE, (causes.THRUST_LOSS,), When.ARMED),
        (r"Compass needs calibration - Land now!|GPS jamming detected", CAUSE, (causes.TEXT_CRITICAL,), When.ARMED),
        (r"Maximum flight time reached|Parachute system lost", CAUSE, (causes.TEXT_CRITICAL,), When.ARMED),
    ]
)

WEIGHTS: Final = sensor_weights.without(
    # failed motors show in MOTOR_OUTPUTS; RC is unhealthy during a whole flight without RC
    sensor_weights.COMMON
    | sensor_weights.CONTROL
    | sensor_weights.weights(hard=(mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,)),
    mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
)

PX4: Final = Autopilot(
    name="PX4",
    recognition=Recognition(autopilots=frozenset({mavlink.MAV_AUTOPILOT_PX4}), lacks=None),
    modes=Modes(flight_mode=flight_mode, overrides_key="px4", initialising={}),
    states=States(
        uninit=Uninit.NOT_READY, standby_is_landed=False, hides_armed=frozenset(), emergency_is_crash=frozenset()
    ),
    texts=Texts(
        rules=TEXTS,
        stop_text=StopText.STATE,
        checks=None,
        safety_switch=frozenset({"Preflight Fail: Press safety button first"}),
        sends_events=True,
        failsafe_is_any={},
        firmware={},
    ),
    sensors=Sensors(
        weights=WEIGHTS,
        since={},
        are_monitored=True,
        faulty_needs_present=False,  # a missing required component is enabled, and not present
        readiness_in_health_alone=True,
        has_safety_switch=False,
        counts_internal_errors=False,
        shows_rc_loss=True,
    ),
    stops=Stops(
        shown_by=EmergencyStop.STATE,
        shown_from=(1, 12),  # PX4-Autopilot pull request 17709
        honoured_by=None,
        check=None,
        outputs_show=False,
        command_terminates=frozenset(),
    ),
    speeds=Speeds(
        zero=ZeroSpeed.ALWAYS,
        hud=HudSpeed.MOTION_ONLY,  # no position messages are sent while the estimate is not valid
        needs_healthy_estimator=False,
        denied_by=None,
        hud_shows_thrust=False,
        reports_estimator=False,
    ),
    requests=Requests(
        wanted=wanted.COMMON + wanted.CURRENT_MODE + wanted.OUTPUTS,
        watched_families=frozenset(),
        once=(wanted.VERSION, wanted.MODES, wanted.METADATA),
        prearm_checks=True,
        boot_texts=frozenset(),
        streams={},
    ),
)
