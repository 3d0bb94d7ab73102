"""The meaning of the messages of one autopilot: the frozen `Autopilot`. No part has a default, so an incomplete profile
fails at import.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Mapping

    from ....mavlink.definitions import Heartbeat
    from ..identity import Family
    from ..options import VehicleKey
    from .modes import FlightMode, ModeHints
    from .sensor_weights import Weights
    from .texts import TextRule
    from .wanted import Once, Wanted

Version = tuple[int, int]
"""Major, minor of the firmware."""


class Uninit(Enum):
    """The meaning of MAV_STATE_UNINIT."""

    STARTING = "it starts"
    NOT_READY = "its pre-arm checks fail"


class EmergencyStop(Enum):
    """The indications of an emergency stop. `estop/rule.py` has one function for each."""

    STATE = "MAV_STATE_FLIGHT_TERMINATION shows every stop"
    DEDUCED = "texts, pre-arm checks, the safety switch and the motor outputs together"
    TERMINATION_ONLY = "nothing but a flight termination"


class StopText(Enum):
    """What else a text about an emergency stop explains."""

    READINESS = "why the vehicle cannot be armed"
    STATE = "the state in the HEARTBEAT"


class ZeroSpeed(Enum):
    """When a speed of exactly zero is an estimate. Otherwise it means that there is none."""

    ALWAYS = "always"
    ESTIMATOR_HEALTHY = "while SYS_STATUS shows a healthy AHRS, and the position is not 0, 0"
    GPS_HEALTHY = "while SYS_STATUS shows a healthy GPS receiver"


class HudSpeed(Enum):
    """The use of VFR_HUD for motion, while no position message is fresh."""

    MOTION_AND_REST = "its speed, as that of a position message"
    MOTION_ONLY = "motion, never rest"
    REST_WITH_GPS = "its speed; zero counts only with a healthy GPS receiver in SYS_STATUS, unless it is an aircraft"


class Recognition(NamedTuple):
    """How the software of a vehicle is identified."""

    autopilots: frozenset[int]
    """MAV_AUTOPILOT. Empty: all values without another profile."""
    lacks: int | None
    """Bits of MAV_SYS_STATUS_SENSOR. A vehicle that announces another autopilot is identified by a SYS_STATUS in
    which none of them is present. None: the announced autopilot is correct."""


class Modes(NamedTuple):
    """The flight mode."""

    flight_mode: Callable[[Heartbeat, Family, ModeHints], FlightMode]
    overrides_key: VehicleKey | None
    """The key in `mode_overrides`. None: the family."""
    initialising: Mapping[Family, int]
    """The custom_mode of a vehicle that is still starting."""


class States(NamedTuple):
    """The meaning of MAV_STATE beyond its definition."""

    uninit: Uninit
    standby_is_landed: bool
    """Whether STANDBY, while armed, means that the land detector reports landed."""
    hides_armed: frozenset[int]
    """The MAV_STATEs in which a heartbeat lacks the armed bit although the drives may be powered."""
    emergency_is_crash: frozenset[Family]
    """The families that set EMERGENCY after a crash, and only then."""


class Texts(NamedTuple):
    """The meaning of its texts."""

    rules: tuple[TextRule, ...]
    stop_text: StopText
    checks: re.Pattern[str] | None
    """The texts of a burst that names every failing pre-arm check; group 1 is the reason without a prefix. None: each
    text gives one reason why it cannot be armed, and the latest one counts."""
    safety_switch: frozenset[str]
    """The texts that give the safety switch as the reason not to arm."""
    sends_events: bool
    """Whether the levels of an EVENT have the meaning of STATUSTEXT severities."""
    failsafe_is_any: Mapping[Family, re.Pattern[str]]
    """By family, the texts about a lost radio or ground station that may name the wrong one. The text that clears one
    clears both."""
    firmware: Mapping[str, Family]
    """The names of the firmware in the text of its boot, which gives its version, each with its kind of vehicle."""


class Sensors(NamedTuple):
    """The meaning of SYS_STATUS."""

    weights: Weights
    """The meaning of a faulty bit; other bits are ignored."""
    since: Mapping[int, Version]
    """Bits whose health has this meaning only from a version on; older firmware means something else."""
    are_monitored: bool
    """Whether its bits ever change. If not, a SYS_STATUS without faults proves nothing."""
    faulty_needs_present: bool
    """Whether a faulty bit is *present*."""
    readiness_in_health_alone: bool
    """Whether PREARM_CHECK is reported in *health* alone, and always."""
    has_safety_switch: bool
    """Whether MOTOR_OUTPUTS, present and not enabled, is an engaged safety switch."""
    counts_internal_errors: bool
    """Whether errors_count1 and errors_count2 are a mask of internal errors."""
    shows_rc_loss: bool
    """Whether RC_RECEIVER turns unhealthy exactly when its failsafe begins."""


class StopCheck(NamedTuple):
    """The pre-arm check that fails while a stop is engaged. Each version is the first that has what its field names."""

    first: Mapping[Family, Version]
    """The check itself. A family without a row never has it."""
    prearm_check: Version
    """PREARM_CHECK in SYS_STATUS."""
    mission_state: Version
    """A mission_state in MISSION_CURRENT."""


class Stops(NamedTuple):
    """Emergency stops and terminations."""

    shown_by: EmergencyStop
    shown_from: Version | None
    """The first version whose state shows every stop; older ones only send texts. None: all versions do, or none."""
    honoured_by: frozenset[Family] | None
    """The families whose motors are stopped by a switch or by MAV_CMD_DO_AUX_FUNCTION. None: no such stop is known."""
    check: StopCheck | None
    """The pre-arm check of stops. None: there is none."""
    outputs_show: bool
    """Whether SERVO_OUTPUT_RAW, SERVOn_FUNCTION, RCn_OPTION and RS_STOP of the applet show stops as on ArduPilot."""
    command_terminates: frozenset[Family]
    """The families that an accepted MAV_CMD_DO_FLIGHTTERMINATION stops permanently, without a state that shows it."""


class Speeds(NamedTuple):
    """Which speeds are estimates."""

    zero: ZeroSpeed
    hud: HudSpeed
    needs_healthy_estimator: bool
    """Whether a disarmed vehicle with a faulty AHRS has no estimate."""
    denied_by: re.Pattern[str] | None
    """The texts in which a disarmed autopilot says that its own estimate is wrong, repeated while it is."""
    hud_shows_thrust: bool
    """Whether VFR_HUD.throttle is the thrust of a multicopter's motors in every mode."""
    reports_estimator: bool
    """Whether EKF_STATUS_REPORT shows if the position is measured."""


class Requests(NamedTuple):
    """The requests to it."""

    wanted: tuple[Wanted, ...]
    """The messages that a status needs."""
    watched_families: frozenset[Family]
    """The families that also need OUTPUT_WATCH."""
    once: tuple[Once, ...]
    """The messages that are requested once: after the first heartbeat, and after a reboot."""
    boot_texts: frozenset[str]
    """The texts that it sends only while it starts."""
    prearm_checks: bool
    """Whether MAV_CMD_RUN_PREARM_CHECKS makes it report again why it cannot be armed."""
    streams: Mapping[int, int]
    """MAV_DATA_STREAM by message id, for firmware that does not know MAV_CMD_SET_MESSAGE_INTERVAL."""


class Autopilot(NamedTuple):
    """The software on an autopilot, and the meaning of its messages."""

    name: str
    recognition: Recognition
    modes: Modes
    states: States
    texts: Texts
    sensors: Sensors
    stops: Stops
    speeds: Speeds
    requests: Requests
