"""What the records of an ArduPilot mean. Sources: AP_Logger's LogStructure.h and LogEvent of 4.5, and recorded logs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from ...interface import RobotMode, Vehicle
from ...mavlink.definitions import TYPE_NAMES
from ..mavlink.autopilots import ardupilot as tables
from ..mavlink.autopilots import firmware
from ..mavlink.faults import causes
from ..mavlink.identity import FAMILIES, Family
from .ardupilot_motion import ArduPilotMotion
from .ardupilot_outputs import Outputs
from .ardupilot_words import ANY, FRAMES, METHODS, MOTOR_TESTS, PARTS, REASONS, SUBSYSTEMS, SWITCH_SOURCES, TYPES
from .kinematics import Kinematics
from .numbers import Values, number, whole
from .state import FALSE, TRUE, UNKNOWN, LogState, Mode, Told
from .texts import said

if TYPE_CHECKING:
    from ...clock import Instant
    from ..mavlink.options import HardwareOptions
    from .record import Record

AIRBORNE: Final = frozenset({Family.COPTER, Family.PLANE, Family.BLIMP})

AT_BOOT: Final = 30_000_000
"""A log that begins earlier after the start of the autopilot (microseconds) holds every event since."""
STOPS_FROM: Final = (4, 5)
"""The firmware from which every emergency stop writes an event."""
LOST_RECORD: Final = 1.0
"""Seconds after which a periodic record that says armed counts beside the last `ARM`: a motor test, or a lost `ARM`."""
ESTOP_FUNCTIONS: Final = frozenset({31, 165})
"""Functions of a switch: the motor emergency stop, and arm or emergency stop."""
ARM_COMMAND, AUX_COMMAND, ACCEPTED = 400, 218, 0
IDENTITY: Final = frozenset({"FRAME_CLASS", "SYSID_THISMAV", "MAV_SYSID", "LOG_DISARMED", "ARMING_REQUIRE"})
"""Parameters that change the status at once."""
_BEFORE_WHO: Final = re.compile(r"(?= while |, forced| in the air)")
"""Where in a rule the name of the sender stands."""
_OPTION: Final = re.compile(r"RC(\d{1,2})_OPTION")
LANDED_EVENTS: Final = {18: TRUE, 17: UNKNOWN, 28: FALSE}
PARACHUTE_RELEASED: Final = 51


class ArduPilotMeaning:
    """Changes the state by the records of one log. `take` returns True if nothing has changed."""

    name = "ARDUPILOTMEGA"

    def __init__(self, options: HardwareOptions) -> None:
        self.state = LogState(vehicle=Vehicle(autopilot=self.name))
        self._options = options
        self._outputs = Outputs()
        self._moves = Kinematics(self.state, options)
        self._family: Family | None = None
        self._version: firmware.Firmware | None = None
        self._begun_at_boot: bool | None = None
        self._options_of_rc: dict[int, int] = {}
        self._settings: dict[str, float] = {}
        self._frame = 0
        self.motion = ArduPilotMotion(self.state, self._moves)
        self._names: frozenset[str] = frozenset()

    def wanted(self) -> Mapping[str, float]:
        """The records that mean something, with the least seconds between two."""
        return {name: every for name, (every, _) in MEANINGS.items()}

    def announced(self, names: frozenset[str]) -> None:
        """The kinds of records that the log holds."""
        self._names = names
        self.state.shows_errors = "ERR" in names and "MSG" in names

    def take(self, record: Record, now: Instant) -> bool:
        """One record."""
        if self._begun_at_boot is None and record.us:
            self._begun_at_boot = record.us < AT_BOOT
            self._free_of_stop(now)
        meaning = MEANINGS.get(record.name)
        return True if meaning is None else bool(meaning[1](self, record.values, now))

    def doubt(self) -> None:
        """Records are missing here."""
        self._begun_at_boot = False
        self.state.doubt()

    # -- who it is

    def parameter(self, values: Values, now: Instant) -> bool:
        """PARM: the type of the vehicle, its outputs and its switches."""
        name, value = str(values.get("Name")), number(values, "Value")
        if not math.isfinite(value):
            return True
        found = _OPTION.fullmatch(name)
        if found:
            self._options_of_rc[int(found[1])] = int(value)
        elif name in ("SYSID_THISMAV", "MAV_SYSID") and 1 <= value <= 255:
            self.state.system = int(value)
        elif name in ("LOG_DISARMED", "ARMING_REQUIRE"):
            self._settings[name] = value
            self._never_armed(now)
        elif name == "FRAME_CLASS":
            self._frame = int(value)
            self._identify()
        else:
            self._outputs.parameter(name, value)
        return name not in IDENTITY

    def _identify(self) -> None:
        family = self._family
        if family is None:
            return
        vehicle_type = FRAMES[family].get(self._frame, TYPES[family])
        self.state.family, self.state.aircraft = family.value, family in AIRBORNE
        self.state.vehicle = self.state.vehicle._replace(
            type=TYPE_NAMES.get(vehicle_type), firmware=None if self._version is None else str(self._version)
        )
        self._outputs.kind(FAMILIES.get(vehicle_type, family), vehicle_type)

    def text(self, values: Values, now: Instant) -> bool:
        """MSG: the firmware, or a text as in a STATUSTEXT."""
        text = str(values.get("Message", ""))
        banner = firmware.BANNER.match(text.replace("APM:", "Ardu"))
        family = None if banner is None else tables.FIRMWARE.get(banner[1])
        if banner is not None and family is not None:
            self._family = self.motion.family = family
            self._version = firmware.of_text(banner[0], tables.FIRMWARE, family)
            self._identify()
            self._free_of_stop(now)
        elif text in MOTOR_TESTS:
            self.state.testing = MOTOR_TESTS[text]
            rule = "a motor test runs" if self.state.testing else "the motor test is over"
            self.state.driven = Told(TRUE if self.state.testing else FALSE, rule, f"MSG “{text}”", now.mono)
        else:
            said(self.state, text, tables.TEXTS, f"MSG “{text}”", now)
        return False

    def version(self, values: Values, now: Instant) -> bool:
        """VER: the firmware."""
        return self.text({"Message": values.get("FWS", "")}, now)

    # -- armed and stopped

    def _free_of_stop(self, now: Instant) -> None:
        """Without an event the robot is not stopped, if every event since the start is in the log."""
        if self._begun_at_boot and self._version is not None and self.state.stop.at == -math.inf:
            if self._version >= STOPS_FROM:
                self.state.stop = Told(FALSE, "no emergency stop since the autopilot has started", "EV", now.mono)
            if self._family is Family.COPTER and self.state.landed.at == -math.inf:
                self.state.landed = Told(TRUE, "not taken off since the autopilot has started", "EV", now.mono)

    def _never_armed(self, now: Instant) -> None:
        """A log that begins at the start of the autopilot, and not by arming, begins disarmed."""
        if self.state.armed.source not in (None, "PARM"):
            return
        tells = not self._names.isdisjoint(("ARM", "EV"))
        begins = tells and self._begun_at_boot and self._settings.get("LOG_DISARMED", 0) > 0
        value = FALSE if begins and self._settings.get("ARMING_REQUIRE", 1) > 0 else UNKNOWN
        rule = "not armed since the autopilot has started" if value is FALSE else "no record says whether it is armed"
        self.state.armed = Told(value, rule, "PARM", now.mono)

    def arming(self, values: Values, now: Instant) -> bool:
        """ARM."""
        armed, method = bool(values.get("ArmState")), whole(values, "Method")
        forced = whole(values, "Forced") == 1
        source = "ARM" if method < 0 else f"ARM.Method {method}"
        by = "" if method < 0 else f" by {METHODS.get(method, f'method {method}')}"
        rule = f"{'armed' if armed else 'disarmed'}{by}{', forced' if forced else ''}"
        self.state.set_armed(Told(TRUE if armed else FALSE, rule, source, now.mono))
        if armed and not forced and whole(values, "ArmChecks") > 0 and self.state.stop.value is not FALSE:
            self._checked(now)
        return False

    def _checked(self, now: Instant) -> None:
        """The checks before arming refuse a robot that is stopped."""
        first = tables.ARDUPILOT.stops.check
        if first is None or self._family is None or self._version is None:
            return
        if self._version >= first.first[self._family]:
            self.state.stop = Told(FALSE, "armed with its checks, which refuse a stop", "ARM.ArmChecks", now.mono)

    def event(self, values: Values, now: Instant) -> bool:
        """EV."""
        kind, state = whole(values, "Id"), self.state
        source = f"EV {kind}"
        if kind in (10, 11) and "ARM" not in self._names:
            state.set_armed(
                Told(TRUE if kind == 10 else FALSE, "armed" if kind == 10 else "disarmed", source, now.mono)
            )
        elif kind in (54, 55):
            moving = self._moves.words(now.mono)
            rule = f"emergency stop{moving}" if kind == 54 else "emergency stop released"
            state.stop = Told(TRUE if kind == 54 else FALSE, rule, source, now.mono)
        elif kind in LANDED_EVENTS:
            state.landed = Told(LANDED_EVENTS[kind], "landed" if kind == 18 else "not landed", source, now.mono)
        elif kind == PARACHUTE_RELEASED:
            state.raise_error((causes.PARACHUTE,), None, now.unix_us, now.mono, record=True)
        else:
            return True
        return False

    def switch(self, values: Values, now: Instant) -> bool:
        """AUXF: who has engaged or released the stop."""
        function, source = whole(values, "function"), whole(values, "source")
        if function not in ESTOP_FUNCTIONS or self.state.stop.at != now.mono:
            return True
        channels = [f"RC{n}" for n, option in sorted(self._options_of_rc.items()) if option == function]
        by = SWITCH_SOURCES.get(source, f"source {source}")
        where = f" ({', '.join(channels)})" if source == 1 and channels else ""
        self._name_who("stop", f" by {by}{where}", now)
        return False

    def command(self, values: Values, now: Instant) -> bool:
        """MAVC: which ground station has armed, disarmed or stopped it."""
        if whole(values, "Res") != ACCEPTED:
            return True
        command, system, component = whole(values, "Cmd"), whole(values, "SS"), whole(values, "SC")
        who = f" by ground station {system}" if system >= 250 else f" by system {system}.{component}"
        if command == ARM_COMMAND and self.state.armed.at == now.mono:
            self._name_who("armed", who, now)
        elif command == AUX_COMMAND and whole(values, "P1") in ESTOP_FUNCTIONS:
            self._name_who("stop", who, now)
        else:
            return True
        return False

    def _name_who(self, what: str, who: str, now: Instant) -> None:
        told: Told = getattr(self.state, what)
        if told.at == now.mono:
            rule = told.rule.replace(" by a MAVLink command", "")
            head, end = _BEFORE_WHO.split(rule, maxsplit=1) if _BEFORE_WHO.search(rule) else (rule, "")
            setattr(self.state, what, told._replace(rule=f"{head}{who}{end}"))

    def power(self, values: Values, now: Instant) -> bool:
        """POWR: the safety switch."""
        value = whole(values, "Safety", "SafetyArm")
        return self._safety(value, "POWR.Safety", now)

    def _safety(self, value: int, source: str, now: Instant) -> bool:
        """AP_HAL's safety_state: 1 holds the outputs."""
        found = TRUE if value == 1 else FALSE
        if value < 0 or found is self.state.safety.value:
            return True
        rule = "the safety switch holds the outputs" if found is TRUE else "the safety switch is off"
        self.state.safety = Told(found, rule, f"{source} {value}", now.mono)
        return False

    def plane_status(self, values: Values, now: Instant) -> bool:
        """STAT of a plane, several times a second."""
        state, armed, flies = self.state, whole(values, "Armed"), whole(values, "isFlying")
        unchanged = self._safety(whole(values, "Safety"), "STAT.Safety", now)
        if state.armed.value is UNKNOWN and (armed == 1 or (armed == 0 and state.safety.value is not TRUE)):
            state.set_armed(Told(TRUE if armed else FALSE, "armed" if armed else "disarmed", "STAT.Armed", now.mono))
            unchanged = False
        live = armed == 1 and now.mono > state.armed.at + LOST_RECORD
        unchanged, state.live = unchanged and live is state.live, live
        landed = FALSE if flies == 1 else TRUE
        if flies >= 0 and landed is not state.landed.value:
            state.landed = Told(landed, "it flies" if flies else "it does not fly", "STAT.isFlying", now.mono)
            unchanged = False
        if whole(values, "Crash") == 1 and causes.CRASH not in state.active:
            state.raise_error((causes.CRASH,), None, now.unix_us, now.mono, record=True)
            unchanged = False
        return unchanged

    # -- what it does

    def mode(self, values: Values, now: Instant) -> bool:
        """MODE."""
        custom, reason = whole(values, "ModeNum", "Mode"), whole(values, "Rsn")
        key = self._family.value if self._family is not None else ""
        table = {} if self._family is None else tables.MODES[self._family]
        if custom < 0:  # old logs in their text form have the name only
            custom = next((n for n, (name, _) in table.items() if name == values.get("Mode")), custom)
        name, mode = table.get(custom, (f"CMODE({custom})", RobotMode.UNKNOWN))
        mode = self._options.mode_overrides.get(key, {}).get(custom, mode)  # type: ignore[call-overload]
        why = f"mode {name}" + ("" if reason < 0 else f", by {REASONS.get(reason, f'reason {reason}')}")
        self.state.mode = Mode(mode, name, custom, why, "MODE" if reason < 0 else f"MODE.Rsn {reason}", now.mono)
        self.state.initialising = name == "INITIALIZING"
        return False

    def error(self, values: Values, now: Instant) -> bool:
        """ERR."""
        subsystem, code = whole(values, "Subsys"), whole(values, "ECode")
        by_code = SUBSYSTEMS.get(subsystem, {})
        if code == 0:
            every = (c for found in by_code.values() for c in found)
            self.state.clear(c for c in every if causes.CAUSES[c].clears is not causes.Clears.ARMING)
            if subsystem in PARTS:
                self.state.passes_again(PARTS[subsystem])
        else:
            found = by_code.get(code, by_code.get(ANY, ()))
            self.state.raise_error(found, None, now.unix_us, now.mono, record=True)
        return False

    def outputs(self, values: Values, now: Instant) -> bool:
        """RCOU."""
        learns = bool(self._begun_at_boot) and self.state.armed.value is not TRUE
        driven, self.state.outputs_at = self._outputs.heard(values, learns), now.mono
        if driven is UNKNOWN or driven is self.state.driven.value or self.state.testing:
            return True
        rule = "a motor output is driven" if driven is TRUE else "no motor output is driven"
        self.state.driven = Told(driven, rule, "RCOU", now.mono)
        return False


Meaning = Callable[[ArduPilotMeaning, Values, "Instant"], bool]


def _motion(meaning: Callable[[ArduPilotMotion, Values, Instant], bool]) -> Meaning:
    """A record of motion."""
    return lambda log, values, now: meaning(log.motion, values, now)


MEANINGS: Final[dict[str, tuple[float, Meaning]]] = {
    "ARM": (0.0, ArduPilotMeaning.arming),
    "EV": (0.0, ArduPilotMeaning.event),
    "MODE": (0.0, ArduPilotMeaning.mode),
    "ERR": (0.0, ArduPilotMeaning.error),
    "MSG": (0.0, ArduPilotMeaning.text),
    "VER": (0.0, ArduPilotMeaning.version),
    "PARM": (0.0, ArduPilotMeaning.parameter),
    "AUXF": (0.0, ArduPilotMeaning.switch),
    "MAVC": (0.0, ArduPilotMeaning.command),
    "STAT": (0.0, ArduPilotMeaning.plane_status),
    "POWR": (0.1, ArduPilotMeaning.power),
    "RCOU": (0.04, ArduPilotMeaning.outputs),
    "GPS": (0.1, _motion(ArduPilotMotion.gps)),
    "XKF1": (0.1, _motion(ArduPilotMotion.estimate)),
    "NKF1": (0.1, _motion(ArduPilotMotion.estimate)),
    "XKF4": (0.1, _motion(ArduPilotMotion.estimate_status)),
    "NKF4": (0.1, _motion(ArduPilotMotion.estimate_status)),
    "ATT": (0.2, _motion(ArduPilotMotion.attitude)),
    "THR": (0.1, _motion(ArduPilotMotion.throttle)),
    "IMU": (0.1, _motion(ArduPilotMotion.gyroscope)),
}
"""By the name of a record: the least seconds between two that are read, and what one says."""
