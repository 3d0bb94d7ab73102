"""More firmwares of scenarios: the other vehicles of ArduPilot, PX4 on a VTOL, INAV and Betaflight.

Numbers, texts and their order are those of ArduPilot 4.5.6, INAV 9.0.0 and Betaflight 2026.12-alpha, observed in
simulation with the real firmware. Those of the tracker, the blimp and PX4's VTOL are from the source code.
"""

from __future__ import annotations

from typing import Any

from .firmware import ACTIVE, CALIBRATING, CRITICAL, IN_AIR, INITIALISING, ON_GROUND, STANDBY, Mode, px4_mode
from .firmwares import ARDUCOPTER, ARDUROVER, PX4_QUAD
from .scenario import AHRS, GPS, VehicleState, step


def _plane_status(s: VehicleState) -> int:
    if s.failsafe:
        return CRITICAL
    if s.custom_mode == INITIALISING:
        return CALIBRATING
    return ACTIVE if s.landed_state == IN_AIR else STANDBY


def _sub_status(s: VehicleState) -> int:
    if s.failsafe:
        return CRITICAL
    return ACTIVE if s.armed else STANDBY


def _tracker_status(s: VehicleState) -> int:
    return CALIBRATING if s.custom_mode == INITIALISING else ACTIVE


def _other_status(s: VehicleState) -> int:
    """INAV and Betaflight; a failsafe shows only while armed."""
    if not s.armed:
        return STANDBY
    return CRITICAL if s.failsafe else ACTIVE


def _plane_outputs(s: VehicleState) -> tuple[int, ...]:
    driven = s.armed and not s.emergency_stop and not s.safety_switch
    return 1500, 1500, 1000 + (10 * s.throttle if driven else 0), 1500


def _servos_at_rest(s: VehicleState) -> tuple[int, ...]:
    return (1500,) * 4


def _start(ready: VehicleState, initialising: bool = False) -> dict[str, Any]:
    """The boot of an ArduPilot. A real estimator needs about 20 s to find its position."""
    without = ready.sensors_enabled & ~(AHRS | GPS)
    booting = ready._replace(
        custom_mode=INITIALISING if initialising else ready.custom_mode,
        initialised=False,
        position=False,
        prearm="AHRS: waiting for home",
        sensors_enabled=without,
        sensors_health=without,
    )
    texts = (6, "ArduPilot Ready"), (6, "AHRS: DCM active")
    boot = (
        step(0.7, "booted", *texts, custom_mode=ready.custom_mode),
        step(1.0, "SYS_STATUS begins; the pre-arm checks fail without a position", initialised=True),
        step(
            6.0,
            "the position is known: the pre-arm checks pass",
            (6, "AHRS: EKF3 active"),
            prearm="",
            position=True,
            sensors_enabled=ready.sensors_enabled,
            sensors_health=ready.sensors_health,
        ),
    )
    return {"ready": ready, "booting": booting, "boot": boot}


def _with_sensors(mask: int, **fields: Any) -> VehicleState:
    return VehicleState(sensors_present=mask, sensors_enabled=mask, sensors_health=mask, **fields)


_ON_GROUND = {"landed_state": ON_GROUND}

ARDUPLANE = ARDUCOPTER._replace(
    name="ArduPilot Plane",
    type=1,
    base_modes=dict.fromkeys((0, 2, 3, 4, 5, 6, 7, 8, 17, 18, 19, 20, 22, 23), 81)
    | dict.fromkeys((1, 10, 11, 12, 13, 14, 15, 21, 24, 25, 26), 89)
    | {INITIALISING: 17},
    status=_plane_status,
    outputs=_plane_outputs,
    armed_text="Throttle armed",
    disarmed_text="Throttle disarmed",
    parameters={"SERVO1_FUNCTION": 4, "SERVO2_FUNCTION": 19, "SERVO3_FUNCTION": 70, "SERVO4_FUNCTION": 21},
    vtol_state=0,
    **_start(_with_sensors(0x1361FC3F, **_ON_GROUND), initialising=True),
)

# The same firmware and the same MAV_TYPE; only vtol_state differs.
QUADPLANE = ARDUPLANE._replace(name="ArduPilot QuadPlane", vtol_state=4)

ARDUSUB = ARDUCOPTER._replace(
    name="ArduPilot Sub",
    type=12,
    base_modes=dict.fromkeys((0, 1, 2, 9, 19, 20, 21), 81) | dict.fromkeys((3, 4, 7, 16), 89),
    status=_sub_status,
    outputs=_servos_at_rest,
    parameters={f"SERVO{n}_FUNCTION": 32 + n for n in range(1, 7)},
    vtol_state=0,
    **_start(_with_sensors(0x1330FD2F, custom_mode=19)),
)

ARDUBOAT = ARDUROVER._replace(name="ArduPilot Boat", type=11)

TRACKER = ARDUCOPTER._replace(
    name="ArduPilot AntennaTracker",
    type=5,
    base_modes={0: 65, 1: 1, INITIALISING: 1} | dict.fromkeys((2, 3, 4, 10), 25),
    status=_tracker_status,
    outputs=_servos_at_rest,
    armed_text="",
    disarmed_text="",
    parameters={"SERVO1_FUNCTION": 71, "SERVO2_FUNCTION": 72},
    vtol_state=0,
    **_start(_with_sensors(0x1361DC2F), initialising=True),
)

BLIMP = ARDUCOPTER._replace(
    name="ArduPilot Blimp",
    type=7,
    base_modes=dict.fromkeys(range(5), 81),
    outputs=_servos_at_rest,
    parameters={},
    vtol_state=0,
    **_start(_with_sensors(0x1361DC2F, custom_mode=1, **_ON_GROUND)),
)

PX4_VTOL = PX4_QUAD._replace(
    name="PX4 VTOL", type=22, base_modes={**PX4_QUAD.base_modes, px4_mode(4, 10): 29}, vtol_state=3
)

_INAV_SENSORS = 0x0101000F

# INAV identifies as ArduPilot, ignores commands, and reports its speed only in VFR_HUD.
INAV_ROVER = ARDUROVER._replace(
    name="INAV rover",
    base_modes={0: 65} | dict.fromkeys((4, 5, 23), 81) | dict.fromkeys((10, 11, 12), 89),
    status=_other_status,
    outputs=_servos_at_rest,
    streams={0: 2.0, 1: 2.0, 30: 2.0, 74: 2.0},
    prearm_prefix="",
    arming_refused="UNABLE TO ARM".ljust(50),
    armed_text="",
    disarmed_text="",
    parameters={},
    booting=_with_sensors(_INAV_SENSORS, custom_mode=4, prearm="it is calibrating", system_status=CALIBRATING),
    boot=(step(3.7, "calibrated", prearm="", system_status=None),),
    ready=_with_sensors(_INAV_SENSORS, custom_mode=4),
    on_request=frozenset(),
)
INAV_QUAD = INAV_ROVER._replace(
    name="INAV quad",
    type=2,
    base_modes=dict.fromkeys((0, 1, 2, 22), 81) | dict.fromkeys((3, 5, 6, 9), 89),
    booting=INAV_ROVER.booting._replace(custom_mode=1),
    ready=INAV_ROVER.ready._replace(custom_mode=1),
)

# Present and enabled, but never healthy: the control bits 10 to 13, and the motor outputs.
_BETAFLIGHT_SENSORS, _BETAFLIGHT_HEALTH = 0xBC0F, 0x0F

BETAFLIGHT = INAV_QUAD._replace(
    name="Betaflight quad",
    autopilot=0,
    base_modes={0: 64} | dict.fromkeys(range(1, 8), 80),
    streams={0: 2.0, 1: 2.0, 2: 2.0, 30: 2.0, 74: 2.0},
    arming_refused="Arming disabled: {}",
    booting=_with_sensors(_BETAFLIGHT_SENSORS, prearm="BOOTGRACE")._replace(sensors_health=_BETAFLIGHT_HEALTH),
    boot=(step(4.0, "the grace period after the boot ends", prearm=""),),
    ready=_with_sensors(_BETAFLIGHT_SENSORS)._replace(sensors_health=_BETAFLIGHT_HEALTH),
    modes=(
        Mode(0, "Acro"),
        Mode(1, "Angle"),
        Mode(2, "Horizon"),
        Mode(3, "Alt Hold", 4),
        Mode(4, "Pos Hold", 1),
        Mode(5, "Autopilot", 6),
        Mode(6, "RTL", 5),
        Mode(7, "Failsafe", 5),
    ),
    on_request=frozenset({436}),
)
