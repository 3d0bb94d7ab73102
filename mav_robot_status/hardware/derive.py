"""Memory and time in, RobotStatus out: one pure function for each field, and the evidence for its value.

Invariants of every status (checked in `tests/`): I1 e_stopped TRUE => drives_powered FALSE. I2 drives_powered FALSE =>
motion_possible FALSE. I3 error_code != 0 <=> in_error TRUE. I4 link stale => everything UNKNOWN, code 0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import (
    Detail,
    ErrorCause,
    Evidence,
    Inhibit,
    LinkState,
    RobotMode,
    RobotStatus,
    TriState,
    Vehicle,
)
from ..mavlink.definitions import (
    AUTOPILOT_NAMES,
    EXTENDED_SENSOR_NAMES,
    SENSOR_NAMES,
    STATE_NAMES,
    TYPE_NAMES,
)
from . import causes, estop, motion, outputs, sensors
from .boot import GRACE
from .flight_mode import FlightMode, ModeSources, flight_mode, is_initialising
from .hearing.movement import driving_speed, speed_over_ground
from .identity import AIRCRAFT, ARMED, HIL, Stack
from .memory import Memory
from .observation import is_fresh
from .pulse import TERMINATED

if TYPE_CHECKING:
    from ..clock import Instant
    from ..mavlink.definitions import Heartbeat, SysStatus
    from .options import HardwareOptions

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

UNINIT, BOOT, CALIBRATING, STANDBY, CRITICAL, EMERGENCY, POWEROFF = 0, 1, 2, 3, 5, 6, 7  # MAV_STATE
UNDEFINED, ON_GROUND = 0, 1  # MAV_LANDED_STATE
IN_THE_AIR: Final = frozenset({2, 3, 4})
TOGETHER: Final = 5.0  # s between a loss and a failsafe that it explains
NOT_MOVING_STATES: Final = frozenset({BOOT, CALIBRATING, EMERGENCY, POWEROFF, TERMINATED})

INHIBITS: Final = (
    "LINK_STALE DISARMED E_STOPPED SAFETY_SWITCH PREARM_FAILING INITIALISING CALIBRATING POWERING_OFF TERMINATION "
    "EMERGENCY HIL SYS_STATUS_MISSING MODE_MANUAL"
).split()
BITS: Final = {name: bit for bit, name in enumerate(INHIBITS)}

Finding = tuple[TriState, Evidence]


class View(NamedTuple):
    """One vehicle at one moment, as the field functions see it."""

    memory: Memory
    now: float
    options: HardwareOptions
    heartbeat: Heartbeat
    heard_at: float
    status: SysStatus | None
    """The latest SYS_STATUS if it is fresh."""
    status_at: float | None

    @property
    def armed(self) -> bool:
        """The only armed indication that exists."""
        return bool(self.heartbeat.base_mode & ARMED)

    @property
    def hil(self) -> bool:
        """Hardware in the loop: the actuators are blocked."""
        return bool(self.heartbeat.base_mode & HIL) and not self.options.treat_hil_as_live

    @property
    def state(self) -> int:
        """MAV_STATE."""
        return self.heartbeat.system_status


class Derived(NamedTuple):
    """What a handle is given."""

    status: RobotStatus
    detail: Detail
    evidence: Mapping[str, Evidence]


def derive(memory: Memory, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """The status of the vehicle with these (system, component) ids at `now`; `before` is the previous detail."""
    beat = memory.observation.heartbeat
    assert beat is not None  # a memory begins with a heartbeat
    if now.mono > beat.at + options.heartbeat_timeout:
        return _lost(memory, ids, before, now, options)
    sys_status = memory.observation.sys_status
    fresh = sys_status is not None and is_fresh(sys_status, now.mono, options.sys_status_timeout)
    view = View(
        memory,
        now.mono,
        options,
        beat.message,
        beat.at,
        sys_status.message if sys_status is not None and fresh else None,
        sys_status.at if sys_status is not None and fresh else None,
    )
    sources = ModeSources(memory.modes, memory.observation.current_mode, options.mode_overrides)
    mode = flight_mode(view.heartbeat, memory.stack, memory.family, sources, now.mono)
    stopped, why_stopped = e_stopped(view)
    drives, why_drives = drives_powered(view, stopped, why_stopped)
    possible, why_possible = motion_possible(view, mode, drives, why_drives)
    moving, why_moving = in_motion(view)
    errors = active_errors(view)
    wrong, why_wrong = in_error(view, errors)
    status = RobotStatus(mode.mode, stopped, drives, possible, moving, wrong, errors[0].cause.code if errors else 0)
    detail = Detail(
        ids[0],
        ids[1],
        tuple(error.cause for error in errors),
        () if possible is TRUE else inhibits(view, mode, stopped, before, now),
        Vehicle(
            named(AUTOPILOT_NAMES, view.heartbeat.autopilot),
            named(TYPE_NAMES, view.heartbeat.type),
            mode.name,
            view.heartbeat.custom_mode,
            named(STATE_NAMES, view.state),
        ),
        LinkState.CONNECTED,
    )
    evidence = {
        "mode": Evidence(mode.rule, f"HEARTBEAT.custom_mode {view.heartbeat.custom_mode}", beat.at),
        "e_stopped": why_stopped,
        "drives_powered": why_drives,
        "motion_possible": why_possible,
        "in_motion": why_moving,
        "in_error": why_wrong,
    }
    return Derived(status, detail, evidence)


def _lost(memory: Memory, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """I4: without a fresh heartbeat nothing is known."""
    vehicle = Vehicle(named(AUTOPILOT_NAMES, memory.autopilot), named(TYPE_NAMES, memory.vehicle_type))
    inhibit = _inhibit("LINK_STALE", None, before, now)
    beat = memory.observation.heartbeat
    why = Evidence("no heartbeat within heartbeat_timeout", "HEARTBEAT", beat.at if beat else None)
    evidence = dict.fromkeys(RobotStatus._fields[:-1], why)
    status = RobotStatus()
    if options.link_loss_is_error:
        since = next((e.since_us for e in before.errors if e.code == 9001), now.unix_us)
        return Derived(
            status._replace(in_error=TRUE, error_code=9001),
            Detail(ids[0], ids[1], (causes.error(9001, None, since),), (inhibit,), vehicle, LinkState.LOST),
            evidence,
        )
    return Derived(status, Detail(ids[0], ids[1], (), (inhibit,), vehicle, LinkState.LOST), evidence)


def named(names: Mapping[int, str], number: int) -> str:
    """MAVLink's name of a number, or the number as text."""
    return names.get(number, str(number))


# -- e_stopped ---------------------------------------------------------------------------------------------------------


def e_stopped(view: View) -> Finding:
    """Whether an emergency stop is engaged; see `estop` for what each autopilot shows."""
    stack = view.memory.stack
    if stack is Stack.PX4:
        found = _px4_stop(view)
    elif stack is Stack.ARDUPILOT:
        found = _ardupilot_stop(view)
    elif view.state == TERMINATED:
        found = TRUE, _beat(view, "state FLIGHT_TERMINATION")
    else:
        found = UNKNOWN, Evidence("this autopilot does not show emergency stops")
    if found[0] is UNKNOWN and view.options.estop_unknown_as == "false":
        return FALSE, Evidence("estop_unknown_as: false")
    return found


def _px4_stop(view: View) -> Finding:
    if view.state != TERMINATED:
        return FALSE, _beat(view, "PX4 shows every stop as state FLIGHT_TERMINATION")
    if view.heartbeat.base_mode & HIL:
        return UNKNOWN, _beat(view, "in hardware-in-the-loop older PX4 is always in lockdown")
    return TRUE, _beat(view, "state FLIGHT_TERMINATION: kill, lockdown or termination")


def _ardupilot_stop(view: View) -> Finding:
    memory, now = view.memory, view.now
    stop = memory.stop
    told = estop.still_said(stop, now)
    if view.status is not None and sensors.safety_switch_on(view.status):
        return TRUE, Evidence("safety switch engaged", "SYS_STATUS: MOTOR_OUTPUTS present, not enabled", view.status_at)
    if told is TRUE:
        return TRUE, Evidence("the autopilot said so", stop.source, stop.last)
    latches = causes.lasting(memory.latches, memory.pulse, now, view.options.text_hold_s)
    if 1002 in latches:
        return TRUE, Evidence("termination announced", latches[1002].source, latches[1002].last)
    if view.state == TERMINATED:
        return TRUE, _beat(view, "state FLIGHT_TERMINATION")
    watched, why = _watched(view)
    if watched is TRUE:
        return TRUE, why
    if not view.armed and view.status is not None and stop.ready >= estop.READY_MESSAGES:
        return FALSE, Evidence(
            "the pre-arm checks, which include the stop, pass", "SYS_STATUS: PREARM_CHECK", stop.ready_at
        )
    if told is FALSE:
        return FALSE, Evidence("the autopilot said so", stop.source, stop.last)
    if watched is FALSE:
        return FALSE, why
    if view.armed and view.options.estop_assume_visible and memory.assumed_free:
        return FALSE, Evidence("not stopped when armed, and no text since (estop_assume_visible)")
    return UNKNOWN, Evidence("ArduPilot does not show an emergency stop in HEARTBEAT, SYS_STATUS or texts alone")


def _watched(view: View) -> Finding:
    """The output watch and ESC telemetry of an armed vehicle."""
    memory, now = view.memory, view.now
    watch = memory.watch
    if not view.armed or not view.options.watch_outputs:
        return UNKNOWN, Evidence("the outputs are not watched")
    if memory.observation.esc is not None and is_fresh(memory.observation.esc, now, motion.FRESH):
        return FALSE, Evidence("a motor turns", "ESC telemetry: rpm", memory.observation.esc.at)
    if watch.at is None or now > watch.at + motion.FRESH:
        return UNKNOWN, Evidence("no fresh SERVO_OUTPUT_RAW")
    value = outputs.verdict(watch, memory.family, memory.vehicle_type, driving_speed(memory), now)
    motors, assumed = outputs.channels(watch, memory.vehicle_type)
    shown = ", ".join(f"{c}: {watch.values[c - 1]} us" for c in motors if c <= len(watch.values))
    source = f"SERVO_OUTPUT_RAW {shown}{' (assumed motor channels)' if assumed else ''}"
    if value is TRUE:
        return TRUE, Evidence("motor outputs held at their stop value while throttle is demanded", source, watch.at)
    if value is FALSE:
        return FALSE, Evidence("a motor output is off its stop value", source, watch.at)
    return UNKNOWN, Evidence("the outputs neither drive nor are held", source, watch.at)


def _beat(view: View, rule: str) -> Evidence:
    return Evidence(rule, f"HEARTBEAT.system_status {named(STATE_NAMES, view.state)}", view.heard_at)


# -- drives_powered, motion_possible -----------------------------------------------------------------------------------


def drives_powered(view: View, stopped: TriState, why_stopped: Evidence) -> Finding:
    """Armed, and neither blocked by hardware-in-the-loop nor stopped."""
    source = f"HEARTBEAT.base_mode {view.heartbeat.base_mode}"
    if not view.armed:
        return FALSE, Evidence("disarmed", source, view.heard_at)
    if view.hil:
        return FALSE, Evidence("hardware in the loop: actuators blocked", source, view.heard_at)
    if stopped is TRUE:
        return FALSE, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    if view.state == TERMINATED:
        return FALSE, _beat(view, "state FLIGHT_TERMINATION")
    return TRUE, Evidence("armed", source, view.heard_at)


def motion_possible(view: View, mode: FlightMode, drives: TriState, why_drives: Evidence) -> Finding:
    """Whether a motion command would move the vehicle now. Errors and sensors have no say."""
    if drives is FALSE:
        return FALSE, why_drives._replace(rule=f"drives_powered is false: {why_drives.rule}")
    if view.state in NOT_MOVING_STATES:
        return FALSE, _beat(view, "a state in which the vehicle does not move")
    if is_initialising(view.heartbeat, view.memory.stack, view.memory.family):
        return FALSE, Evidence("mode INITIALIZING", "HEARTBEAT.custom_mode", view.heard_at)
    if view.options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Evidence("manual mode (manual_blocks_motion)", "HEARTBEAT.custom_mode", view.heard_at)
    if view.state == UNINIT:
        return UNKNOWN, _beat(view, "state UNINIT")
    return TRUE, _beat(view, "armed, not stopped, in a state that moves")


# -- in_motion ---------------------------------------------------------------------------------------------------------


def in_motion(view: View) -> Finding:
    """Airborne, or moving or turning by measurement."""
    memory, now = view.memory, view.now
    aircraft = memory.vehicle_type in AIRCRAFT
    landed = memory.observation.extended_sys_state
    landed_state = UNDEFINED
    landed_at = None
    if landed is not None and is_fresh(landed, now, motion.FRESH):
        landed_state, landed_at = landed.message.landed_state, landed.at
    if view.armed and aircraft and landed_state in IN_THE_AIR and view.options.hover_is_motion:
        return TRUE, Evidence("airborne", f"EXTENDED_SYS_STATE.landed_state {landed_state}", landed_at)
    source, at = _velocity_source(view)
    if source is not None:
        value = motion.settle(memory.motion, now).value
        why = Evidence("speed and rotation, with hysteresis", source, at)
        if value is TRUE and not view.armed and _gps_contradicts(view):
            # seen after a crash: the estimate ran away at 36 m/s while the vehicle lay on its back
            return UNKNOWN, Evidence("disarmed: the estimate moves, the GPS receiver stands still", source, at)
    elif aircraft and landed_state == ON_GROUND:
        value = FALSE
        why = Evidence("on the ground, no speed known", "EXTENDED_SYS_STATE.landed_state", landed_at)
    elif memory.observation.gps is not None and _gps_stands_still(view):
        value = FALSE
        why = Evidence("no estimate, but the GPS receiver stands still", "GPS_RAW_INT.vel", memory.observation.gps.at)
    else:
        return UNKNOWN, Evidence("no fresh speed")
    if value is FALSE and view.armed and aircraft and landed_state == UNDEFINED and not _on_ground(view):
        return UNKNOWN, Evidence("armed, and nothing tells whether it is airborne", source, at)
    return value, why


def _gps_stands_still(view: View) -> bool:
    """True if the receiver's own speed says rest (and nothing rotates).

    It is believed for nothing else: at rest it may read several m/s.
    """
    memory = view.memory
    fresh = is_fresh(memory.observation.gps, view.now, motion.FRESH)
    return fresh and motion.settle(memory.gps_motion, view.now).value is FALSE


def _gps_contradicts(view: View) -> bool:
    """True if the estimate has a speed over ground and the GPS receiver has none."""
    position = view.memory.observation.global_position
    if position is None or not is_fresh(position, view.now, motion.FRESH) or not _gps_stands_still(view):
        return False
    return speed_over_ground(view.memory) > view.options.v_on_disarmed


def _on_ground(view: View) -> bool:
    """ArduPilot's STANDBY: its own land detector says landed."""
    return view.memory.stack is Stack.ARDUPILOT and view.state == STANDBY


def _velocity_source(view: View) -> tuple[str | None, float | None]:
    """The message that gives the speed now, in the order of preference."""
    observation = view.memory.observation
    speed = view.memory.motion.speed
    if speed is None:
        return None, None  # the latest sample said that there is no estimate
    for name, heard in (
        ("GLOBAL_POSITION_INT", observation.global_position),
        ("LOCAL_POSITION_NED", observation.local_position),
        ("VFR_HUD", observation.vfr_hud),
    ):
        if heard is not None and is_fresh(heard, view.now, motion.FRESH):
            return f"{name}: {speed:.2f} m/s", heard.at
    return None, None


# -- in_error ----------------------------------------------------------------------------------------------------------


class Error(NamedTuple):
    """An active cause with its place in the order, and what showed it."""

    cause: ErrorCause
    priority: int
    source: str
    at: float


def active_errors(view: View) -> list[Error]:
    """Every active cause, the most important first."""
    found = {error.cause.code: error for error in (*_announced(view), *_counted(view), *_faulty(view))}
    for error in _of_state(view, found.keys()):
        found.setdefault(error.cause.code, error)
    return sorted(found.values(), key=lambda error: error.priority)


def _error(code: int, text: str | None, since_us: int, source: str, at: float, later: int = 0) -> Error:
    return Error(causes.error(code, text, since_us), causes.CAUSES[code].priority + later, source, at)


def _announced(view: View) -> Iterator[Error]:
    memory = view.memory
    latches = causes.lasting(memory.latches, memory.pulse, view.now, view.options.text_hold_s)
    for code, latch in latches.items():
        yield _error(code, latch.text, latch.since.unix_us, latch.source, latch.last)


def _counted(view: View) -> Iterator[Error]:
    since = view.memory.internal_errors_since
    if since is not None and view.status is not None and view.status_at is not None:
        count = view.status.errors_count1 | view.status.errors_count2 << 16
        yield _error(5001, None, since.unix_us, f"SYS_STATUS.errors_count 0x{count:x}", view.status_at)


def _faulty(view: View) -> Iterator[Error]:
    memory = view.memory
    if not memory.faults or view.status_at is None or view.now < memory.boot.at + GRACE:
        return
    for bit, weight, fault in sensors.standing(memory.faults, memory.stack, view.armed, view.now):
        name = sensor_name(bit)
        if name not in view.options.ignore_sensors:
            code = 3000 + bit if bit < 32 else 3100 + bit - 32
            later = causes.SOFT_AFTER if weight is sensors.SOFT else 0
            source = f"SYS_STATUS: {name} enabled, unhealthy"
            yield _error(code, None, fault.since.unix_us, source, view.status_at, later)


def _of_state(view: View, found: Collection[int]) -> Iterator[Error]:
    """What HEARTBEAT.system_status says, where nothing else has named it."""
    memory = view.memory
    words = memory.failsafe.text if memory.failsafe is not None else None
    since = memory.pulse.state_since.unix_us
    source = f"HEARTBEAT.system_status {named(STATE_NAMES, view.state)}"
    if view.state == TERMINATED and not view.heartbeat.base_mode & HIL:
        yield _error(1001, words, since, source, view.heard_at)
    if view.state == EMERGENCY and not causes.NAMED_EMERGENCIES.intersection(found):
        yield _error(4000, words, since, source, view.heard_at)
    if view.state == CRITICAL and not causes.NAMED_FAILSAFES.intersection(found):
        rc_lost = memory.rc_lost_since
        if rc_lost is not None and abs(rc_lost.mono - memory.pulse.state_since.mono) <= TOGETHER:
            source = f"{source}, as SYS_STATUS: RC_RECEIVER turned unhealthy"
            yield _error(2001, words, since, source, view.heard_at)
        else:
            yield _error(2000, words, since, source, view.heard_at)


def sensor_name(bit: int) -> str:
    """MAVLink's name of a SYS_STATUS bit; the extended word's bits count from 32."""
    if bit < 32:
        return SENSOR_NAMES.get(bit, str(bit))
    return EXTENDED_SENSOR_NAMES.get(bit - 32, str(bit - 32))


def in_error(view: View, errors: list[Error]) -> Finding:
    """TRUE with any cause; FALSE only while SYS_STATUS is there to show one."""
    if errors:
        first = errors[0]
        return TRUE, Evidence(f"{first.cause.code} {first.cause.name}", first.source, first.at)
    if view.status is None:
        return UNKNOWN, Evidence("no fresh SYS_STATUS")
    return FALSE, Evidence("no cause is active", "SYS_STATUS", view.status_at)


# -- inhibits ----------------------------------------------------------------------------------------------------------


def inhibits(view: View, mode: FlightMode, stopped: TriState, before: Detail, now: Instant) -> tuple[Inhibit, ...]:
    """Every reason why motion is not possible."""
    memory, state = view.memory, view.state
    not_ready = memory.not_ready.text if memory.not_ready is not None else None
    failsafe = memory.failsafe.text if memory.failsafe is not None else None
    initialising = is_initialising(view.heartbeat, memory.stack, memory.family)
    switch = (
        memory.stack is Stack.ARDUPILOT and view.status is not None and sensors.safety_switch_on(view.status)
    ) or (not view.armed and not_ready == "Preflight Fail: Press safety button first")
    termination = memory.latches.get(1002)
    reasons: dict[str, str | None] = {}
    if not view.armed:
        reasons["DISARMED"] = None
    if stopped is TRUE:
        reasons["E_STOPPED"] = memory.stop.text
    if switch:
        reasons["SAFETY_SWITCH"] = None
    if not view.armed and _is_not_ready(view):
        reasons["PREARM_FAILING"] = not_ready
    if initialising or state == BOOT or (state == UNINIT and memory.stack is not Stack.PX4):
        reasons["INITIALISING"] = None
    elif state == CALIBRATING:
        reasons["CALIBRATING"] = None
    if state == POWEROFF:
        reasons["POWERING_OFF"] = None
    if (state == TERMINATED and not view.heartbeat.base_mode & HIL) or termination is not None:
        reasons["TERMINATION"] = termination.text if termination is not None else failsafe
    if state == EMERGENCY:
        reasons["EMERGENCY"] = None
    if view.hil:
        reasons["HIL"] = None
    if view.status is None:
        reasons["SYS_STATUS_MISSING"] = None
    if view.options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        reasons["MODE_MANUAL"] = None
    return tuple(_inhibit(name, text, before, now) for name, text in reasons.items())


def _is_not_ready(view: View) -> bool:
    """The pre-arm checks fail, as far as the vehicle says so."""
    stack = view.memory.stack
    if stack is Stack.PX4 and view.state == UNINIT:
        return True
    if view.status is None or not sensors.tells_readiness(view.status, stack):
        return False
    return not sensors.is_ready(view.status, stack)


def _inhibit(name: str, text: str | None, before: Detail, now: Instant) -> Inhibit:
    """A reason, since when it has been one without interruption."""
    since = next((i.since_us for i in before.inhibits if i.name == name), now.unix_us)
    return Inhibit(BITS[name], name, text, since)
