"""What the topics of a PX4 mean. They change their names between versions: the first that is there counts.

Sources: msg/*.msg of PX4-Autopilot from 1.9 to 1.17, and recorded logs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from ...interface import RobotMode, Vehicle
from ...mavlink.definitions import TYPE_NAMES
from ..mavlink.autopilots import firmware
from ..mavlink.autopilots import px4 as tables
from ..mavlink.faults import causes
from ..mavlink.identity import AIRCRAFT, family_of
from .kinematics import Kinematics
from .numbers import Values, number, whole
from .px4_motion import Px4Motion
from .state import FALSE, TRUE, UNKNOWN, LogState, Mode, Told
from .texts import said

if TYPE_CHECKING:
    from ...clock import Instant
    from ..mavlink.options import HardwareOptions
    from .record import Record

NAV_STATES: Final = {
    0: (1, 0), 1: (2, 0), 2: (3, 0), 3: (4, 4), 4: (4, 3), 5: (4, 5), 6: (3, 2), 10: (5, 0), 12: (4, 6), 13: (10, 0),
    14: (6, 0), 15: (7, 0), 16: (8, 0), 17: (4, 2), 18: (4, 6), 19: (4, 8), 20: (4, 9), 21: (3, 1), 22: (4, 10),
}  # fmt: skip
"""The main and the sub mode of vehicle_status.nav_state."""
ARMED: Final = 2
"""vehicle_status.arming_state, of all versions."""
EXTERNAL: Final = range(23, 31)
"""The nav_state of modes of other programs."""
STOPS: Final = {
    "kill": "the kill switch",
    "manual_lockdown": "the kill switch",
    "termination": "the flight termination",
    "force_failsafe": "the flight termination",
    "lockdown": "the lockdown",
}
"""The members of actuator_armed that stop the motors."""
TERMINATIONS: Final = frozenset({"termination", "force_failsafe"})
ATTITUDE, MOTOR = 0b111, 1 << 7
"""Bits of vehicle_status.failure_detector_status."""
REASONS: Final = {1: "a stick gesture", 2: "a switch of the radio", 3: "an internal command", 4: "an external command"}
"""vehicle_status.latest_arming_reason and latest_disarming_reason, as far as all versions agree."""
BEFORE: Final = re.compile(r"\[[\w :/]+\] *|\x1b\[[0-9;]*m")
"""The name of the module before a logged text, and colours in it."""
WHO: Final = re.compile(r"(Armed|Disarmed) by (.+)")
TOGETHER: Final = 1.0
"""Seconds between a change and the text that explains it."""
FAILSAFE_TEXT: Final = 5.0
"""Seconds for which a failsafe counts that only a text shows: COM_FAIL_ACT_T."""
FLAGGED: Final = 30.0
"""Seconds for which a new flag explains a failsafe."""
FLAGS: Final = {
    "manual_control_signal_lost": causes.RC_LOST,
    "gcs_connection_lost": causes.GCS_LOST,
    "offboard_control_signal_lost": causes.OFFBOARD_LOST,
    "battery_unhealthy": causes.BATTERY_FAULT,
    "battery_warning": causes.BATTERY_LOW,
    "geofence_breached": causes.GEOFENCE,
    "mission_failure": causes.MISSION,
    "fd_critical_failure": causes.ATTITUDE_FAILURE,
    "fd_motor_failure": causes.THRUST_LOSS,
}
"""The members of failsafe_flags that name a cause."""
FAILSAFES: Final = (causes.FAILSAFE, *FLAGS.values())
ARM_COMMAND: Final = 400
DO_CONTROL: Final = 1
MOTOR_FUNCTIONS: Final = range(101, 113)


class Px4Meaning:
    """Changes the state by the topics of one log. `take` returns True if nothing has changed."""

    name = "PX4"

    def __init__(self, options: HardwareOptions) -> None:
        self.state = LogState(vehicle=Vehicle(autopilot=self.name))
        self._options = options
        self._moves = Kinematics(self.state, options)
        self._names: frozenset[str] = frozenset()
        self._said: tuple[str, float] = ("", -math.inf)
        """The last text of who has armed or disarmed it, and when."""
        self._commander: tuple[int, float] = (0, -math.inf)
        """The system that sent the last command to arm or disarm, and when."""
        self._failsafe: tuple[str | None, float] = (None, -math.inf)
        """The last text of a failsafe, and until when it counts without a record."""
        self._flags: dict[str, bool] = {}
        self._flagged: tuple[int, float] = (causes.FAILSAFE, -math.inf)
        """The cause that the last new flag names, and when."""
        self.motion = Px4Motion(self.state, self._moves)
        self.test_until = -math.inf
        """When a test of an actuator ends by itself."""

    def wanted(self) -> Mapping[str, float]:
        """The topics that mean something, with the least seconds between two records."""
        return {name: every for name, (every, _) in MEANINGS.items()}

    def announced(self, names: frozenset[str]) -> None:
        """The topics that the log holds."""
        self._names = names
        self.motion.has_rates = "vehicle_angular_velocity" in names
        self.state.shows_errors = "vehicle_status" in names

    def take(self, record: Record, now: Instant) -> bool:
        """One record."""
        unchanged = True
        if self.state.driven.value is TRUE and now.mono >= self.test_until:
            self.state.driven, unchanged = Told(FALSE, "the actuator test is over", "actuator_test", now.mono), False
        meaning = MEANINGS.get(record.name)
        if meaning is None or record.values.get("instance", 0) != 0:
            return unchanged
        return bool(meaning[1](self, record.values, now)) and unchanged

    def doubt(self) -> None:
        """Records are missing here."""
        self.state.doubt()

    # -- armed and stopped

    def armed(self, values: Values, now: Instant) -> bool:
        """actuator_armed."""
        state, before = self.state, (self.state.armed, self.state.stop, self.state.terminated)
        self._set_armed(bool(values.get("armed")), "actuator_armed.armed", now)
        engaged = [name for name in STOPS if values.get(name)]
        if not any(name in values for name in STOPS):
            return state.armed is before[0]
        value = TRUE if engaged else FALSE
        if engaged == ["lockdown"] and state.hil and not self._options.treat_hil_as_live:
            value = UNKNOWN
        if value is not state.stop.value:
            moving = self._moves.words(now.mono)
            rule = f"emergency stop by {STOPS[engaged[0]]}{moving}" if engaged else "neither killed nor terminated"
            state.stop = Told(value, rule, f"actuator_armed.{engaged[0]}" if engaged else "actuator_armed", now.mono)
        state.terminated = "flight termination" if TERMINATIONS.intersection(engaged) else None
        if value is TRUE:
            state.raise_error((causes.FLIGHT_TERMINATION,), None, now.unix_us, now.mono, record=True)
            if state.driven.value is TRUE:
                state.driven = Told(FALSE, "an emergency stop ends the actuator test", "actuator_armed", now.mono)
        else:
            state.clear((causes.FLIGHT_TERMINATION,))
        return (state.armed, state.stop, state.terminated) == before

    def _set_armed(self, armed: bool, source: str, now: Instant) -> None:
        value = TRUE if armed else FALSE
        if value is not self.state.armed.value:
            self.state.set_armed(Told(value, "armed" if armed else "disarmed", source, now.mono))
            if now.mono - self._said[1] <= TOGETHER:
                self._explain(self._said[0], now)

    def _explain(self, text: str, now: Instant) -> None:
        """Name who has armed or disarmed it."""
        armed = self.state.armed
        found = WHO.fullmatch(text)
        if found is None or now.mono - armed.at > TOGETHER or (armed.value is TRUE) != (found[1] == "Armed"):
            return
        by = f"the {found[2]}" if found[2].startswith("kill") else found[2]
        system, at = self._commander
        if found[2] == "external command" and now.mono - at <= TOGETHER and system:
            by = f"ground station {system}" if system >= 250 else f"system {system}"
        self.state.armed = armed._replace(rule=f"{found[1].lower()} by {by}", source=f"message “{text}”")

    def status(self, values: Values, now: Instant) -> bool:
        """vehicle_status."""
        state = self.state
        is_armed, is_late = whole(values, "arming_state") == ARMED, now.mono > state.armed.at + TOGETHER
        if "actuator_armed" not in self._names or (is_armed and is_late and state.armed.value is FALSE):
            self._set_armed(is_armed, "vehicle_status.arming_state", now)
        before = (state.mode, state.armed, state.ready, state.safety, state.vehicle, state.hil, set(state.active))
        state.hil = whole(values, "hil_state") == 1
        self._mode(whole(values, "nav_state"), now)
        self._identify(values)
        self._reason(whole(values, "latest_arming_reason"), whole(values, "latest_disarming_reason"))
        self._flag("ready", values, "pre_flight_checks_pass", "vehicle_status.pre_flight_checks_pass", now)
        if values.get("safety_button_available") is not None:
            held = bool(values.get("safety_button_available")) and not values.get("safety_off")
            self._flag("safety", {"held": held}, "held", "vehicle_status.safety_off", now)
        self._failures(whole(values, "failure_detector_status"), bool(values.get("failsafe")), now)
        after = (state.mode, state.armed, state.ready, state.safety, state.vehicle, state.hil, set(state.active))
        return before == after

    def _failures(self, bits: int, failsafe: bool, now: Instant) -> None:
        state = self.state
        found = {causes.ATTITUDE_FAILURE: bits > 0 and bits & ATTITUDE, causes.THRUST_LOSS: bits > 0 and bits & MOTOR}
        for code, active in found.items():
            if active and state.armed.value is TRUE:
                state.raise_error((code,), None, now.unix_us, now.mono, record=True)
            elif code in state.active and state.active[code].record:
                state.clear((code,))
        if (failsafe or now.mono < self._failsafe[1]) and state.armed.value is TRUE:
            if not any(code in state.active for code in FAILSAFES):
                code = self._flagged[0] if now.mono - self._flagged[1] <= FLAGGED else causes.FAILSAFE
                state.raise_error((code,), self._failsafe[0], now.unix_us, now.mono, record=True)
        else:
            state.clear(code for code in FAILSAFES if code in state.active and state.active[code].record)

    def flags(self, values: Values, now: Instant) -> bool:
        """failsafe_flags: what was lost last is why a failsafe acts."""
        for name, code in FLAGS.items():
            value = bool(values.get(name))
            if value and not self._flags.get(name, True):
                self._flagged = code, now.mono
            self._flags[name] = value
        return True

    def _flag(self, what: str, values: Values, member: str, source: str, now: Instant) -> None:
        value = values.get(member)
        found = UNKNOWN if value is None else TRUE if value else FALSE
        if found is not UNKNOWN and found is not getattr(self.state, what).value:
            words = {
                "ready": ("its arming checks fail", "its arming checks pass"),
                "safety": ("the safety switch is off", "the safety switch holds the outputs"),
                "landed": ("not landed", "landed"),
                "rests": ("it does not rest", "it rests"),
            }[what]
            setattr(self.state, what, Told(found, words[found], source, now.mono))

    def _reason(self, arming: int, disarming: int) -> None:
        armed = self.state.armed
        reason = arming if armed.value is TRUE else disarming
        if armed.rule in ("armed", "disarmed") and reason in REASONS:
            member = "latest_arming_reason" if armed.value is TRUE else "latest_disarming_reason"
            rule, source = f"{armed.rule} by {REASONS[reason]}", f"vehicle_status.{member} {reason}"
            self.state.armed = armed._replace(rule=rule, source=source)

    def _identify(self, values: Values) -> None:
        state, kind = self.state, whole(values, "system_type")
        system, component = whole(values, "system_id"), whole(values, "component_id")
        if 1 <= system <= 255 and 1 <= component <= 255:
            state.system, state.component = system, component
        if kind >= 0 and state.vehicle.type is None:
            state.vehicle = state.vehicle._replace(type=TYPE_NAMES.get(kind, str(kind)))
            state.family, state.aircraft = family_of(kind).value, kind in AIRCRAFT

    def _mode(self, nav_state: int, now: Instant) -> None:
        if nav_state == self.state.mode.number or nav_state < 0:
            return
        main, sub = NAV_STATES.get(nav_state, (0, 0))
        name, mode = tables.SUB.get((main, sub)) or tables.MAIN.get(main) or (f"NAV({nav_state})", RobotMode.UNKNOWN)
        if nav_state in EXTERNAL:
            name, mode = f"AUTO.EXTERNAL{nav_state - EXTERNAL[0] + 1}", RobotMode.AUTO
        mode = self._options.mode_overrides.get("px4", {}).get(main << 16 | sub << 24, mode)
        source = f"vehicle_status.nav_state {nav_state}"
        self.state.mode = Mode(mode, name, nav_state, f"mode {name}", source, now.mono)

    def text(self, values: Values, now: Instant) -> bool:
        """A logged text."""
        text = BEFORE.sub("", str(values.get("text", ""))).strip()
        if text.startswith("Failsafe activated"):
            self._failsafe = text, now.mono + FAILSAFE_TEXT
        elif WHO.fullmatch(text):
            self._said = text, now.mono
            self._explain(text, now)
        else:
            said(self.state, text, tables.TEXTS, f"message “{text}”", now, whole(values, "level"))
        return False

    def command(self, values: Values, now: Instant) -> bool:
        """vehicle_command: who wants to arm or to disarm it."""
        if whole(values, "command") == ARM_COMMAND and values.get("from_external"):
            self._commander = whole(values, "source_system"), now.mono
        return True

    def safety(self, values: Values, now: Instant) -> bool:
        """The topic `safety` of 1.12 and before."""
        held = bool(values.get("safety_switch_available")) and not values.get("safety_off")
        self._flag("safety", {"held": held}, "held", "safety.safety_off", now)
        return False

    def test(self, values: Values, now: Instant) -> bool:
        """actuator_test: a motor turns while it is disarmed, unless it is stopped."""
        if whole(values, "function") not in MOTOR_FUNCTIONS or self.state.stop.value is TRUE:
            return True
        value, limit = number(values, "value"), whole(values, "timeout_ms")
        turns = whole(values, "action") == DO_CONTROL and value == value and abs(value) > 0
        self.test_until = now.mono + limit / 1000 if turns and limit > 0 else math.inf if turns else now.mono
        rule = "an actuator test drives a motor" if turns else "the actuator test is over"
        self.state.driven = Told(TRUE if turns else FALSE, rule, "actuator_test", now.mono)
        return False

    def landed(self, values: Values, now: Instant) -> bool:
        """vehicle_land_detected."""
        before = self.state.landed, self.state.rests
        self._flag("landed", values, "landed", "vehicle_land_detected.landed", now)
        self._flag("rests", values, "at_rest", "vehicle_land_detected.at_rest", now)
        return (self.state.landed, self.state.rests) == before

    def information(self, values: Values, now: Instant) -> bool:
        """What the log says of the firmware."""
        value = values.get("value")
        if values.get("name") != "ver_sw_release" or not isinstance(value, int):
            return True
        version = firmware.of_number(value)
        self.state.vehicle = self.state.vehicle._replace(firmware=None if version is None else str(version))
        return False

    def parameter(self, values: Values, now: Instant) -> bool:
        """A parameter."""
        if values.get("name") == "MAV_SYS_ID":
            self.state.system = whole(values, "value")
        return True


Meaning = Callable[[Px4Meaning, Values, "Instant"], bool]


def _motion(meaning: Callable[[Px4Motion, Values, Instant], bool]) -> Meaning:
    """A topic of motion."""
    return lambda log, values, now: meaning(log.motion, values, now)


MEANINGS: Final[dict[str, tuple[float, Meaning]]] = {
    "actuator_armed": (0.0, Px4Meaning.armed),
    "vehicle_status": (0.0, Px4Meaning.status),
    "safety": (0.0, Px4Meaning.safety),
    "failsafe_flags": (0.0, Px4Meaning.flags),
    "vehicle_land_detected": (0.0, Px4Meaning.landed),
    "vehicle_local_position": (0.1, _motion(Px4Motion.position)),
    "vehicle_angular_velocity": (0.1, _motion(Px4Motion.rotation)),
    "vehicle_attitude": (0.2, _motion(Px4Motion.attitude)),
    "vehicle_command": (0.0, Px4Meaning.command),
    "actuator_test": (0.0, Px4Meaning.test),
    "message": (0.0, Px4Meaning.text),
    "information": (0.0, Px4Meaning.information),
    "parameter": (0.0, Px4Meaning.parameter),
}
"""By the name of a topic: the least seconds between two records that are read, and what one says."""
