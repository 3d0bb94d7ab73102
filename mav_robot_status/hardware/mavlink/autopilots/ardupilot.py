"""ArduPilot: Copter, Plane, Rover, Sub, Tracker and Blimp.

Modes: numbers and names are those of ardupilotmega.xml (COPTER_MODE, PLANE_MODE, ...) and of the enumerations in the
vehicles' `mode.h`; Blimp has no enumeration in any XML. AUTO: a program decides, or the vehicle is held and ignores the
sticks. MANUAL: a pilot's sticks set attitude, rate, velocity or climb, even if the autopilot stabilises.

Texts: strings checked in 4.7-dev and 4.5.6, with older wordings that occur in real logs.
"""

from __future__ import annotations

import re
from typing import Final

from ....interface.status import RobotMode
from ....mavlink import enumerations as mavlink
from ..faults import causes
from ..identity import Family
from . import sensor_weights, wanted
from .modes import ModeTable, by_table
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
    StopCheck,
    Stops,
    StopText,
    Texts,
    Uninit,
    ZeroSpeed,
)
from .texts import Effect, table

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
CAUSE, CLEAR, IGNORE, READINESS = Effect.CAUSE, Effect.CLEAR, Effect.IGNORE, Effect.READINESS

COPTER: Final[ModeTable] = {
    0: ("STABILIZE", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("ALT_HOLD", MANUAL),
    3: ("AUTO", AUTO),
    4: ("GUIDED", AUTO),
    5: ("LOITER", MANUAL),  # the sticks command velocity; on Plane and Rover LOITER is a program
    6: ("RTL", AUTO),
    7: ("CIRCLE", AUTO),  # the sticks only trim
    8: ("POSITION", MANUAL),  # removed from the firmware
    9: ("LAND", AUTO),
    10: ("OF_LOITER", MANUAL),  # removed from the firmware
    11: ("DRIFT", MANUAL),
    13: ("SPORT", MANUAL),
    14: ("FLIP", MANUAL),  # seconds long, returns to the pilot's mode
    15: ("AUTOTUNE", MANUAL),  # the pilot positions, no remote motion
    16: ("POSHOLD", MANUAL),
    17: ("BRAKE", AUTO),  # stops and holds, no pilot input
    18: ("THROW", AUTO),  # no pilot input
    19: ("AVOID_ADSB", AUTO),
    20: ("GUIDED_NOGPS", AUTO),
    21: ("SMART_RTL", AUTO),
    22: ("FLOWHOLD", MANUAL),
    23: ("FOLLOW", AUTO),
    24: ("ZIGZAG", MANUAL),  # storing points is piloted, and the stage is not transmitted
    25: ("SYSTEMID", MANUAL),
    26: ("AUTOROTATE", AUTO),
    27: ("AUTO_RTL", AUTO),
    28: ("TURTLE", MANUAL),
    29: ("RATE_ACRO", MANUAL),
}

PLANE: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("CIRCLE", AUTO),
    2: ("STABILIZE", MANUAL),
    3: ("TRAINING", MANUAL),
    4: ("ACRO", MANUAL),
    5: ("FLY_BY_WIRE_A", MANUAL),
    6: ("FLY_BY_WIRE_B", MANUAL),
    7: ("CRUISE", MANUAL),
    8: ("AUTOTUNE", MANUAL),
    10: ("AUTO", AUTO),
    11: ("RTL", AUTO),
    12: ("LOITER", AUTO),
    13: ("TAKEOFF", AUTO),
    14: ("AVOID_ADSB", AUTO),
    15: ("GUIDED", AUTO),
    16: ("INITIALIZING", UNKNOWN),
    17: ("QSTABILIZE", MANUAL),
    18: ("QHOVER", MANUAL),
    19: ("QLOITER", MANUAL),
    20: ("QLAND", AUTO),  # in base_mode's pilot group, but lands by itself
    21: ("QRTL", AUTO),
    22: ("QAUTOTUNE", MANUAL),
    23: ("QACRO", MANUAL),
    24: ("THERMAL", AUTO),
    25: ("LOITER_ALT_QLAND", AUTO),
    26: ("AUTOLAND", AUTO),
}

ROVER: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("LEARNING", MANUAL),  # removed from the firmware
    3: ("STEERING", MANUAL),
    4: ("HOLD", AUTO),  # sticks ignored, held stopped
    5: ("LOITER", AUTO),
    6: ("FOLLOW", AUTO),
    7: ("SIMPLE", MANUAL),
    8: ("DOCK", AUTO),
    9: ("CIRCLE", AUTO),
    10: ("AUTO", AUTO),
    11: ("RTL", AUTO),
    12: ("SMART_RTL", AUTO),
    15: ("GUIDED", AUTO),
    16: ("INITIALIZING", UNKNOWN),
}

SUB: Final[ModeTable] = {
    0: ("STABILIZE", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("ALT_HOLD", MANUAL),
    3: ("AUTO", AUTO),
    4: ("GUIDED", AUTO),
    7: ("CIRCLE", AUTO),
    9: ("SURFACE", AUTO),
    16: ("POSHOLD", MANUAL),  # the joystick flies it although the GUIDED bit is set
    19: ("MANUAL", MANUAL),
    20: ("MOTORDETECT", AUTO),
    21: ("SURFTRAK", MANUAL),
}

TRACKER: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("STOP", AUTO),
    2: ("SCAN", AUTO),
    3: ("SERVO_TEST", MANUAL),
    4: ("GUIDED", AUTO),
    10: ("AUTO", AUTO),
    16: ("INITIALIZING", UNKNOWN),
}

BLIMP: Final[ModeTable] = {
    0: ("LAND", AUTO),
    1: ("MANUAL", MANUAL),
    2: ("VELOCITY", MANUAL),
    3: ("LOITER", MANUAL),
    4: ("RTL", AUTO),
}

INITIALIZING: Final = 16  # Plane, Rover and Tracker; on Copter and Sub 16 is POSHOLD
MODES: Final = {
    Family.COPTER: COPTER,
    Family.PLANE: PLANE,
    Family.ROVER: ROVER,
    Family.SUB: SUB,
    Family.TRACKER: TRACKER,
    Family.BLIMP: BLIMP,
}

TEXTS: Final = table(
    [
        # clearing rows come first: their texts contain those of the rows that they clear
        (r"Radio Failsafe Cleared", CLEAR, (causes.RC_LOST,)),
        (r"GCS Failsafe Cleared", CLEAR, (causes.GCS_LOST,)),
        (r"EKF [Ff]ailsafe [Cc]leared", CLEAR, (causes.ESTIMATOR,)),
        (r"Battery Failsafe Cleared", CLEAR, (causes.BATTERY_LOW, causes.BATTERY_CRITICAL)),
        (r"Terrain Failsafe Cleared", CLEAR, (causes.TERRAIN,)),
        (r".*Failsafe Cleared", CLEAR, (causes.RC_LOST, causes.GCS_LOST)),
        (
            r"Short Failsafe Cleared|RC Long Failsafe Cleared|Throttle failsafe off",
            CLEAR,
            (causes.RC_LOST, causes.GCS_LOST),
        ),
        (r"Failsafe ended", CLEAR, (causes.RC_LOST, causes.GCS_LOST)),  # Rover up to 4.0
        (r"GCS Failsafe Off", CLEAR, (causes.GCS_LOST,)),
        (r"Failsafe\. (Short|Long) event off", CLEAR, (causes.RC_LOST, causes.GCS_LOST)),
        (r"(GPS )?Glitch cleared", CLEAR, (causes.GPS,)),
        (r"Dead Reckoning (stopped|timeout)", CLEAR, (causes.GPS,)),
        (r"Fence breach cleared", CLEAR, (causes.GEOFENCE,)),
        (r"Aborting termination", CLEAR, (causes.TERMINATION_ANNOUNCED,)),
        (r"Vibration compensation (ON|OFF)|EKF primary changed:|EKF\d? lane switch", IGNORE),
        # emergency stop
        (r".*Emergency Stopped", Effect.ESTOP),
        (r"(RC\d+: )?MotorEStop HIGH", Effect.ESTOP),  # 4.1 and 4.2 send it without the prefix
        (r"(RC\d+: )?MotorEStop LOW", Effect.RELEASE),
        # arming checks: "PreArm: Internal errors" is a fault, all others are only reasons not to arm
        (r"PreArm: Internal errors 0x", CAUSE, (causes.INTERNAL_ERROR,)),
        (r"PreArm: |Arm: ", READINESS),
        # crash and damage
        (r"Crash: Disarming|Crash: Going to HOLD|Crash detected", CAUSE, (causes.CRASH,)),
        (r"Hard landing detected", CAUSE, (causes.HARD_LANDING,)),
        (r"Potential Thrust Loss \(", CAUSE, (causes.THRUST_LOSS,)),
        (r"Yaw Imbalance ", CAUSE, (causes.YAW_IMBALANCE,)),
        (r"Parachute: Released again", IGNORE),
        (r"Parachute: Released", CAUSE, (causes.PARACHUTE,)),
        (r"Terminating due to ", CAUSE, (causes.TERMINATION_ANNOUNCED,)),
        # failsafes
        (r".*Radio \+ Battery Failsafe", CAUSE, (causes.RC_LOST,)),
        (r"GCS \+ Battery Failsafe", CAUSE, (causes.GCS_LOST,)),  # Copter 4.0 to 4.2
        (r"Failsafe trigger 0x1\b", CAUSE, (causes.RC_LOST,)),  # Rover up to 4.0: a mask
        (r"Failsafe trigger 0x2\b", CAUSE, (causes.GCS_LOST,)),
        (r"Failsafe trigger 0x3\b", CAUSE, (causes.RC_LOST, causes.GCS_LOST)),
        (r"Failsafe trigger 0x", CAUSE, (causes.FAILSAFE,)),
        (r"Radio Failsafe|RC Failsafe|RC (Short|Long) Failsafe|Throttle failsafe on", CAUSE, (causes.RC_LOST,)),
        (r"Failsafe\. (Short|Long) event on|Lost manual control", CAUSE, (causes.RC_LOST,)),
        (r"GCS Failsafe|MYGCS: .*heartbeat lost", CAUSE, (causes.GCS_LOST,)),
        (r"Battery \d+ is low ", CAUSE, (causes.BATTERY_LOW,)),
        (r"Battery \d+ is critical ", CAUSE, (causes.BATTERY_CRITICAL,)),
        (r"Battery Failsafe|Low Battery!|Low battery", CAUSE, (causes.BATTERY_LOW,)),
        (r"EKF Failsafe|EKF failsafe|EKF variance|EKF bad", CAUSE, (causes.ESTIMATOR,)),
        (r"Failsafe: Terrain data missing|Failsafe terrain triggered", CAUSE, (causes.TERRAIN,)),
        (r".*GPS Glitch|Dead Reckoning started", CAUSE, (causes.GPS,)),
        (r"(?i).*fence(s)? breached", CAUSE, (causes.GEOFENCE,)),
        (r"Leak Detected", CAUSE, (causes.LEAK,)),
        (r"Internal pressure critical!", CAUSE, (causes.PRESSURE,)),
        (r"Internal temperature critical!", CAUSE, (causes.TEMPERATURE,)),
        (r"Depth sensor error!", CAUSE, (causes.DEPTH_SENSOR,)),
        # the autopilot itself
        (r"Internal Errors 0x", CAUSE, (causes.INTERNAL_ERROR,)),
        (r"Config Error: ", CAUSE, (causes.CONFIGURATION,)),
        (r"WDG: T", CAUSE, (causes.WATCHDOG_RESET,)),
        # no information about the status
        (r"(Disa|A)rming motors|Throttle (dis)?armed", IGNORE),
        (r"Flight mode change failed|No such mode|Mode change to ", IGNORE),
    ]
)

FIRMWARE: Final = {
    "ArduCopter": Family.COPTER,
    "ArduPlane": Family.PLANE,
    "ArduRover": Family.ROVER,
    "APMrover2": Family.ROVER,  # to 3.5
    "ArduSub": Family.SUB,
    "AntennaTracker": Family.TRACKER,
    "Blimp": Family.BLIMP,
}

WEIGHTS: Final = sensor_weights.without(
    # ArduPlane reports terrain as unhealthy during every good flight; a relevant loss of terrain data has a text
    sensor_weights.COMMON | sensor_weights.CONTROL,
    mavlink.MAV_SYS_STATUS_TERRAIN,
)

STREAMS: Final = {
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: mavlink.MAV_DATA_STREAM_EXTENDED_STATUS,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: mavlink.MAV_DATA_STREAM_RC_CHANNELS,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: mavlink.MAV_DATA_STREAM_POSITION,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: mavlink.MAV_DATA_STREAM_POSITION,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: mavlink.MAV_DATA_STREAM_EXTRA1,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: mavlink.MAV_DATA_STREAM_EXTRA2,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: mavlink.MAV_DATA_STREAM_EXTRA3,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: mavlink.MAV_DATA_STREAM_EXTRA3,
}
"""`GCS_MAVLINK_*::data_stream_send` of Copter 3.x."""

BOOT_TEXTS: Final = frozenset({"ArduPilot Ready", "Initialising ArduPilot"})
"""AP_Vehicle::setup and init_ardupilot send them, once in a run."""

ARDUPILOT: Final = Autopilot(
    name="ArduPilot",
    recognition=Recognition(autopilots=frozenset({mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA}), lacks=None),
    modes=Modes(
        flight_mode=by_table(MODES, "ArduPilot's {} table"),
        overrides_key=None,
        initialising=dict.fromkeys((Family.PLANE, Family.ROVER, Family.TRACKER), INITIALIZING),
    ),
    states=States(
        uninit=Uninit.STARTING,
        standby_is_landed=True,
        hides_armed=frozenset(),
        emergency_is_crash=frozenset({Family.PLANE}),  # GCS_MAVLINK_Plane::vehicle_system_status
    ),
    texts=Texts(
        rules=TEXTS,
        stop_text=StopText.READINESS,
        checks=re.compile(r"(?:PreArm|Arm): (.+)"),
        safety_switch=frozenset(),
        sends_events=False,
        failsafe_is_any={Family.ROVER: re.compile(r"(Radio|GCS) Failsafe")},
        firmware=FIRMWARE,
    ),
    sensors=Sensors(
        weights=WEIGHTS,
        # up to 4.0 a compass that the estimator does not use is unhealthy: removed in 45daff9f47
        since={sensor_weights.bit_of(mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG): (4, 1)},
        are_monitored=True,
        faulty_needs_present=True,
        readiness_in_health_alone=False,
        has_safety_switch=True,
        counts_internal_errors=True,
        shows_rc_loss=False,
    ),
    stops=Stops(
        # a stop by RC switch or command changes neither HEARTBEAT nor, while armed, SYS_STATUS
        shown_by=EmergencyStop.DEDUCED,
        shown_from=None,
        # recorded: ArduSub 4.5.6 accepts the command and drives on; no recording of the other families
        honoured_by=frozenset({Family.COPTER, Family.PLANE, Family.ROVER}),
        check=StopCheck(
            # Copter, and what became common to all vehicles: ArduPilot pull request 23415
            first=dict.fromkeys(Family, (4, 4)) | {Family.PLANE: (4, 1), Family.ROVER: (4, 0)},
            prearm_check=(4, 1),  # recorded: Copter 4.0.5 lacks the bit, ArduSub 4.1.1 has it
            mission_state=(4, 4),  # ArduPilot pull request 23230
        ),
        outputs_show=True,
        # Copter, Sub and Blimp only disarm, and can be armed again at once
        command_terminates=frozenset({Family.PLANE, Family.ROVER}),
    ),
    speeds=Speeds(
        # without an estimate it sends exactly zero (and its last position), and up to 6 m/s at rest while its
        # estimator is unhealthy
        zero=ZeroSpeed.ESTIMATOR_HEALTHY,
        hud=HudSpeed.MOTION_AND_REST,
        needs_healthy_estimator=True,
        denied_by=re.compile(
            r"(PreArm|Arm): (EKF attitude is bad|AHRS:? not healthy|EKF (position|velocity|height) variance)"
        ),
        hud_shows_thrust=True,  # motors->get_throttle(); of a QuadPlane in its VTOL modes too
        reports_estimator=True,
    ),
    requests=Requests(
        wanted=wanted.COMMON + wanted.ESTIMATOR,
        watched_families=frozenset({Family.COPTER, Family.ROVER, Family.PLANE, Family.SUB}),
        once=(wanted.VERSION,),
        boot_texts=BOOT_TEXTS,
        prearm_checks=True,
        streams=STREAMS,
    ),
)
