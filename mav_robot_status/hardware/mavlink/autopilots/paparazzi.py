"""Paparazzi UAV with its module `mavlink`.

Source: paparazzi/paparazzi, sw/airborne/modules/datalink/mavlink.c (commit 02d93d9bc9), functions
`mavlink_send_heartbeat`, `mavlink_send_sys_status`, `mavlink_send_extended_sys_state` and
`mavlink_common_message_handler`.

The flags of base_mode give the mode; custom_mode is 15 (ArduPlane's GUIDED) in NAV and GUIDED, else 0. Armed means that
the throttle is not killed and the attitude is valid. While the attitude is not valid the state is CALIBRATING, and the
armed bit is not set even if the throttle is live. SYS_STATUS is a constant with four healthy sensors, so it shows
neither faults nor readiness. A killed throttle is reported as disarmed; an emergency stop looks the same.
MAV_CMD_SET_MESSAGE_INTERVAL is acknowledged and has no effect, so no messages are requested. Before there is an
estimate, the speeds are zero. Paparazzi can be built to announce itself as ArduPilot. Then it is identified as INAV,
whose SYS_STATUS lacks the same sensor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode
from ....mavlink import enumerations as mavlink
from ..identity import Family
from .generic import GENERIC
from .modes import FlightMode, ModeHints
from .profile import Autopilot, HudSpeed, Modes, Recognition, Requests, Speeds, ZeroSpeed

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN

STICKS: Final = mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
STABILIZED: Final = mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
BY_ITSELF: Final = mavlink.MAV_MODE_FLAG_AUTO_ENABLED
GUIDED: Final = mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
FLAGS: Final = STICKS | STABILIZED | BY_ITSELF | GUIDED
NAV: Final = 15  # PLANE_MODE_GUIDED, which it uses as custom_mode

FIXED_WING: Final[dict[int, tuple[str, RobotMode]]] = {
    STICKS: ("MANUAL", MANUAL),
    STICKS | STABILIZED: ("AUTO1", MANUAL),  # stabilised: the sticks set the attitude
    BY_ITSELF: ("AUTO2", AUTO),
    BY_ITSELF | GUIDED: ("HOME", AUTO),
}
ROTORCRAFT: Final[dict[int, tuple[str, RobotMode]]] = {
    STICKS: ("RATE", MANUAL),  # RATE_DIRECT, RATE_RC_CLIMB, RATE_Z_HOLD or RC_DIRECT
    STICKS | STABILIZED: ("ATTITUDE", MANUAL),  # the ATTITUDE, HOVER and CARE_FREE modes
    BY_ITSELF: ("HOME", AUTO),
    GUIDED: ("GUIDED", AUTO),
}


def flight_mode(heartbeat: Heartbeat, family: Family, hints: ModeHints) -> FlightMode:
    """The mode by the flags of base_mode; NAV and HOME of a rotorcraft differ in custom_mode alone."""
    flags = heartbeat.base_mode & FLAGS
    table = FIXED_WING if family is Family.PLANE else ROTORCRAFT
    name, mode = table.get(flags, (f"CMODE({heartbeat.custom_mode})", UNKNOWN))
    if table is ROTORCRAFT and flags == BY_ITSELF and heartbeat.custom_mode == NAV:
        name = "NAV"
    rule = "Paparazzi's flags in base_mode" if flags in table else "base_mode flags that Paparazzi does not send"
    return FlightMode(mode, name, rule)


PAPARAZZI: Final[Autopilot] = GENERIC._replace(
    name="Paparazzi",
    recognition=Recognition(autopilots=frozenset({mavlink.MAV_AUTOPILOT_PPZ}), lacks=None),
    modes=Modes(flight_mode=flight_mode, overrides_key=None, initialising={}),
    states=GENERIC.states._replace(
        hides_armed=frozenset({mavlink.MAV_STATE_CALIBRATING}), emergency_is_crash=frozenset()
    ),
    sensors=GENERIC.sensors._replace(weights={}, are_monitored=False),
    speeds=Speeds(
        zero=ZeroSpeed.GPS_HEALTHY,
        hud=HudSpeed.MOTION_ONLY,
        needs_healthy_estimator=False,
        denied_by=None,
        hud_shows_thrust=False,
        reports_estimator=False,
    ),
    requests=Requests(
        wanted=(),
        watched_families=frozenset(),
        once=(),
        boot_texts=frozenset(),
        prearm_checks=False,
        streams={},
    ),
)
