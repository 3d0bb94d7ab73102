"""The firmwares of the scenarios: ArduPilot Rover and Copter, PX4 on a quadrotor.

Numbers, texts and their order are those of ArduPilot 4.5.6 and PX4 1.17-alpha, observed in simulation with the real
firmware. Only the boot is shorter: a real estimator needs about 20 s to find its position.
"""

from __future__ import annotations

from .firmware import (
    ACTIVE,
    ARDUPILOT,
    CALIBRATING,
    CRITICAL,
    FAILED,
    FLIGHT_TERMINATION,
    INITIALISING,
    ON_GROUND,
    PX4,
    STANDBY,
    TEMPORARILY_REJECTED,
    UNINIT,
    Firmware,
    px4_mode,
)
from .scenario import AHRS, GPS, RC_RECEIVER, VehicleState, step


def _rover_status(s: VehicleState) -> int:
    if s.failsafe:
        return CRITICAL
    return {INITIALISING: CALIBRATING, 4: STANDBY}.get(s.custom_mode, ACTIVE)


def _copter_status(s: VehicleState) -> int:
    if s.failsafe:
        return CRITICAL
    # 4.5.6 has no BOOT: it reports ACTIVE until it is initialised.
    return STANDBY if s.landed_state == ON_GROUND and s.initialised else ACTIVE


def _px4_status(s: VehicleState) -> int:
    if s.emergency_stop:
        return FLIGHT_TERMINATION
    if not s.armed:
        return UNINIT if s.prearm else STANDBY
    return CRITICAL if s.failsafe else ACTIVE


def _moving(s: VehicleState) -> bool:
    return s.armed and not s.emergency_stop and not s.safety_switch


def _rover_outputs(s: VehicleState) -> tuple[int, ...]:
    return 1500, 0, 1500 + (5 * s.throttle if _moving(s) else 0), 0


def _copter_outputs(s: VehicleState) -> tuple[int, ...]:
    return (min(1128 + 136 * s.throttle // 10, 1950) if _moving(s) else 1000,) * 4


def _px4_outputs(s: VehicleState) -> tuple[int, ...]:
    return (1000 + 10 * s.throttle if _moving(s) else 900,) * 4


_ROVER_SENSORS = 0x1361DC2F
_COPTER_SENSORS = 0x5361FC2F
_PX4_SENSORS = 0x0321882F
_NO_ESTIMATE = ~(AHRS | GPS)


def _servo_functions(functions: dict[int, int]) -> dict[str, int]:
    return {f"SERVO{n}_FUNCTION": functions.get(n, 0) for n in range(1, 17)}


_ROVER_READY = VehicleState(
    sensors_present=_ROVER_SENSORS, sensors_enabled=_ROVER_SENSORS, sensors_health=_ROVER_SENSORS
)
_COPTER_READY = VehicleState(
    sensors_present=_COPTER_SENSORS,
    sensors_enabled=_COPTER_SENSORS,
    sensors_health=_COPTER_SENSORS,
    landed_state=ON_GROUND,
)
_PX4_READY = VehicleState(
    custom_mode=px4_mode(3),
    sensors_present=_PX4_SENSORS,
    sensors_enabled=_PX4_SENSORS,
    sensors_health=_PX4_SENSORS,
    landed_state=ON_GROUND,
)

ARDUROVER = Firmware(
    name="ArduPilot Rover",
    version=0x040506FF,
    type=10,
    autopilot=ARDUPILOT,
    base_modes={0: 65, 1: 65, 3: 65, 7: 65, 4: 1, 16: 65} | dict.fromkeys((5, 6, 8, 9, 10, 11, 12, 15), 9),
    status=_rover_status,
    outputs=_rover_outputs,
    streams={},
    refused=FAILED,
    prearm_prefix="PreArm: ",
    arming_refused="Arm: {}",
    armed_text="Throttle armed",
    disarmed_text="Throttle disarmed",
    parameters=_servo_functions({1: 26, 3: 70}),
    vtol_state=0,
    booting=_ROVER_READY._replace(
        custom_mode=INITIALISING,
        initialised=False,
        position=False,
        prearm="GPS 1: Bad fix",
        sensors_enabled=_ROVER_SENSORS & _NO_ESTIMATE,
        sensors_health=_ROVER_SENSORS & _NO_ESTIMATE,
    ),
    boot=(
        step(0.7, "the inertial sensors are calibrated", (6, "Beginning INS calibration. Do not move vehicle")),
        step(1.34, "booted: MANUAL", (6, "ArduPilot Ready"), (6, "AHRS: DCM active"), custom_mode=0),
        step(2.0, "SYS_STATUS begins; the pre-arm checks fail without a GPS fix", initialised=True),
        step(
            6.0,
            "the position is known: the pre-arm checks pass, the rover can be armed",
            (6, "AHRS: EKF3 active"),
            prearm="",
            position=True,
            sensors_enabled=_ROVER_SENSORS,
            sensors_health=_ROVER_SENSORS,
        ),
    ),
    ready=_ROVER_READY,
)

ARDUCOPTER = ARDUROVER._replace(
    name="ArduPilot Copter",
    type=2,
    base_modes=dict.fromkeys((0, 1, 2, 9, 11, 13, 14, 15, 18, 20, 22, 24, 25, 28), 81)
    | dict.fromkeys((3, 4, 5, 6, 7, 16, 17, 19, 21, 23, 27), 89),
    status=_copter_status,
    outputs=_copter_outputs,
    armed_text="Arming motors",
    disarmed_text="Disarming motors",
    parameters=_servo_functions({1: 33, 2: 34, 3: 35, 4: 36}),
    vtol_state=3,
    booting=_COPTER_READY._replace(
        initialised=False,
        position=False,
        prearm="Need Position Estimate",
        sensors_enabled=_COPTER_SENSORS & _NO_ESTIMATE,
        sensors_health=_COPTER_SENSORS & _NO_ESTIMATE,
    ),
    boot=(
        step(1.24, "booted", (6, "ArduPilot Ready"), (6, "AHRS: DCM active")),
        step(2.0, "SYS_STATUS begins; the pre-arm checks fail without a position", initialised=True),
        step(
            6.0,
            "the position is known: the pre-arm checks pass, the copter can be armed",
            (6, "AHRS: EKF3 active"),
            prearm="",
            position=True,
            sensors_enabled=_COPTER_SENSORS,
            sensors_health=_COPTER_SENSORS,
        ),
    ),
    ready=_COPTER_READY,
)

ARDUCOPTER_QUICK = ARDUCOPTER._replace(
    name="ArduPilot Copter that is ready at its first heartbeat",
    booting=_COPTER_READY,
    boot=(step(1.24, "booted", (6, "ArduPilot Ready")),),
)

PX4_QUAD = Firmware(
    name="PX4 quad",
    version=0x01110040,
    type=2,
    autopilot=PX4,
    base_modes=dict.fromkeys((px4_mode(main) for main in (1, 2, 3, 5, 7)), 81)
    | dict.fromkeys((px4_mode(4, sub) for sub in (2, 3, 4, 5, 6, 9)), 29)
    | {px4_mode(6): 17, px4_mode(4, 8): 17, px4_mode(3, 1): 17, px4_mode(10): 1},
    status=_px4_status,
    outputs=_px4_outputs,
    # The mode NORMAL of a MAVLink instance.
    streams={1: 1.0, 245: 1.0, 33: 5.0, 32: 1.0, 30: 15.0, 74: 4.0, 436: 0.5, 36: 1.0},
    refused=TEMPORARILY_REJECTED,
    prearm_prefix="",
    arming_refused="Arming denied: Resolve system health failures first\t",
    armed_text="Armed by external command\t",
    disarmed_text="Disarmed by external command\t",
    parameters={},
    vtol_state=0,
    booting=_PX4_READY._replace(
        custom_mode=px4_mode(4, 3),
        position=False,
        prearm="the system is starting",
        sensors_present=0,
        sensors_enabled=0,
        sensors_health=0x0321C83F,
    ),
    boot=(
        step(
            1.0,
            "the sensors are present; the position is not known yet",
            sensors_present=_PX4_SENSORS & ~RC_RECEIVER & ~GPS,
            sensors_enabled=_PX4_SENSORS & ~GPS,
            sensors_health=_PX4_SENSORS & ~RC_RECEIVER & ~GPS & ~(1 << 14),
        ),
        step(
            6.0,
            "the position is known: the checks pass, the quad can be armed",
            prearm="",
            position=True,
            sensors_present=_PX4_SENSORS & ~RC_RECEIVER,
            sensors_enabled=_PX4_SENSORS,
            sensors_health=_PX4_SENSORS & ~RC_RECEIVER,
        ),
        step(
            8.0,
            "the remote control is on: POSCTL",
            custom_mode=px4_mode(3),
            sensors_present=_PX4_SENSORS,
            sensors_health=_PX4_SENSORS,
        ),
    ),
    ready=_PX4_READY,
)
