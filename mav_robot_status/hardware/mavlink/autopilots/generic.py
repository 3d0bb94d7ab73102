"""Every autopilot without a profile of its own. Betaflight, and INAV as itself, announce themselves as MAV_AUTOPILOT
GENERIC, and no message distinguishes them from others.

Source: Betaflight and INAV, telemetry/mavlink.c.
"""

from __future__ import annotations

from typing import Final

from . import sensor_weights, wanted
from .modes import standard
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

GENERIC: Final = Autopilot(
    name="other",
    recognition=Recognition(autopilots=frozenset(), lacks=None),
    modes=Modes(flight_mode=standard, overrides_key=None, initialising={}),
    states=States(
        uninit=Uninit.STARTING, standby_is_landed=False, hides_armed=frozenset(), emergency_is_crash=frozenset()
    ),
    texts=Texts(
        rules=(),
        stop_text=StopText.STATE,
        checks=None,
        safety_switch=frozenset(),
        sends_events=False,
        failsafe_is_any={},
        firmware={},
    ),
    sensors=Sensors(
        weights=sensor_weights.COMMON,
        since={},
        are_monitored=True,
        faulty_needs_present=True,
        readiness_in_health_alone=False,
        has_safety_switch=False,
        counts_internal_errors=False,
        shows_rc_loss=False,
    ),
    stops=Stops(
        shown_by=EmergencyStop.TERMINATION_ONLY,
        shown_from=None,
        honoured_by=None,
        check=None,
        outputs_show=False,
        command_terminates=frozenset(),
    ),
    speeds=Speeds(
        zero=ZeroSpeed.ALWAYS,
        hud=HudSpeed.REST_WITH_GPS,  # INAV, Betaflight and others send zero for a speed that they do not know
        needs_healthy_estimator=False,
        denied_by=None,
        hud_shows_thrust=False,
        reports_estimator=False,
    ),
    requests=Requests(
        wanted=wanted.COMMON,
        watched_families=frozenset(),
        once=(wanted.VERSION, wanted.MODES),
        boot_texts=frozenset(),
        prearm_checks=False,
        streams={},
    ),
)
