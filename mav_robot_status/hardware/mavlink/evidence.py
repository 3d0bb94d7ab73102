"""The evidence for each field as text. It is made on request, from the reasons of the rules and from the state.

A rule reads facts. The underlying numbers and times of arrival are in the state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Final

from ...interface.status import Evidence
from ...mavlink.definitions import STATE_NAMES
from .estop import outputs
from .faults.causes import EXTENDED_SENSOR, SENSOR
from .identity import named, sensor_name
from .reason import Reason, Source
from .satellite.state import speed

if TYPE_CHECKING:
    from .facts import Facts
    from .state import Heard, VehicleState

Shown = tuple[str | None, float | None]
"""The deciding message with its field or text, and when it arrived (monotonic seconds)."""
Show = Callable[["VehicleState", "Facts", Reason], Shown]


class EvidenceOfVehicle(Mapping[str, Evidence]):
    """The evidence for each field of a status, made when it is read, with the numbers of that time."""

    __slots__ = ("_facts", "_reasons", "_state")

    def __init__(self, state: VehicleState, facts: Facts, reasons: Mapping[str, Reason]) -> None:
        self._state, self._facts, self._reasons = state, facts, reasons

    def __getitem__(self, field: str) -> Evidence:
        reason = self._reasons[field]
        seldom = self._facts.seldom is not None and reason.source in OF_HEARTBEAT
        show = _high_latency if seldom else SHOW[reason.source]
        return Evidence(reason.rule, *show(self._state, self._facts, reason))

    def __iter__(self) -> Iterator[str]:
        return iter(self._reasons)

    def __len__(self) -> int:
        return len(self._reasons)


def _at(heard: Heard | None) -> float | None:
    return None if heard is None else heard.at


def _nothing(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return None, None


def _heartbeat(text: str) -> Show:
    """A fixed text on the heartbeat."""
    return lambda state, facts, reason: (text, _at(state.latest.heartbeat))


def _sys_status(text: str) -> Show:
    """A fixed text on SYS_STATUS."""
    return lambda state, facts, reason: (text, _at(state.latest.sys_status))


def _base_mode(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return f"HEARTBEAT.base_mode {facts.heartbeat.base_mode}", _at(state.latest.heartbeat)


def _mode_number(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return f"HEARTBEAT.custom_mode {facts.heartbeat.custom_mode}", _at(state.latest.heartbeat)


def _state(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    name = named(STATE_NAMES, facts.heartbeat.system_status)
    return f"HEARTBEAT.system_status {name}", _at(state.latest.heartbeat)


def _state_and_rc(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    text, at = _state(state, facts, reason)
    return f"{text}, as SYS_STATUS: RC_RECEIVER turned unhealthy", at


def _internal_errors(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    heard = state.latest.sys_status
    count = 0 if heard is None else heard.message.errors_count1 | heard.message.errors_count2 << 16
    return f"SYS_STATUS.errors_count 0x{count:x}", _at(heard)


def _sensor(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    bit = reason.code - SENSOR if reason.code < EXTENDED_SENSOR else reason.code - EXTENDED_SENSOR + 32
    return f"SYS_STATUS: {sensor_name(bit)} enabled, unhealthy", _at(state.latest.sys_status)


def _version(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    told = state.firmware
    return (None, None) if told is None else (told.source, told.at)


def _switches(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "PARAM_VALUE: RCn_OPTION", None


def _rc_channels(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "RC_CHANNELS, PARAM_VALUE: RCn_OPTION", state.stop_switch_at


def _prearm_check(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "SYS_STATUS: PREARM_CHECK", state.stop.ready_at


def _stop(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return state.stop.source, state.stop.last


def _applet(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    word = state.applet
    return (None, None) if word is None else (f"NAMED_VALUE_FLOAT RS_STOP {word.value}", word.at)


def _applet_and_outputs(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    (word, _), (values, at) = _applet(state, facts, reason), _outputs(state, facts, reason)
    return f"{word}; {values}", at


def _latch(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    latch = state.latches.get(reason.code)
    return (None, None) if latch is None else (latch.source, latch.last)


def _parts(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    faults = [fault for (_, code), fault in state.faulty_parts.items() if code == reason.code]
    latest = max(faults, key=lambda fault: fault.last, default=None)
    return (None, None) if latest is None else (latest.source, latest.last)


def _claims(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "the HEARTBEATs of several senders", None


def _esc(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "ESC telemetry: rpm", _at(state.latest.esc)


def _outputs(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    watch = state.watch
    motors, assumed = outputs.channels(watch, state.vehicle_type)
    shown = ", ".join(f"{c}: {watch.values[c - 1]} us" for c in motors if c <= len(watch.values))
    return f"SERVO_OUTPUT_RAW {shown}{' (assumed motor channels)' if assumed else ''}", watch.at


def _landed_state(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "EXTENDED_SYS_STATE.landed_state", _at(state.latest.extended_sys_state)


def _landed_number(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return f"EXTENDED_SYS_STATE.landed_state {facts.landed_state}", _at(state.latest.extended_sys_state)


def _velocity(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    latest, name = state.latest, facts.fresh.velocity
    heard = {"GLOBAL_POSITION_INT": latest.global_position, "LOCAL_POSITION_NED": latest.local_position}
    return f"{name}: {state.motion.speed or 0.0:.2f} m/s", _at(heard.get(name or "", latest.vfr_hud))


def _gps(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return "GPS_RAW_INT.vel", _at(state.latest.gps)


def _attitude(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    return f"ATTITUDE: {state.turning:.2f} rad/s", _at(state.latest.attitude)


def _high_latency(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    known = state.high_latency
    if known is None:
        return None, None
    m = known.message
    text = f"custom_mode {m.custom_mode}, custom0 {m.custom0}, failure_flags 0x{m.failure_flags:x}"
    return f"HIGH_LATENCY2: {text}, groundspeed {speed(m):g} m/s", known.at


OF_HEARTBEAT: Final = frozenset(
    {Source.HEARTBEAT, Source.BASE_MODE, Source.CUSTOM_MODE, Source.MODE_NUMBER, Source.STATE, Source.STATE_AND_RC}
)
"""What HIGH_LATENCY2 says if the vehicle sends no HEARTBEAT."""
SHOW: Final[dict[Source, Show]] = {
    Source.NONE: _nothing,
    Source.HEARTBEAT: _heartbeat("HEARTBEAT"),
    Source.BASE_MODE: _base_mode,
    Source.CUSTOM_MODE: _heartbeat("HEARTBEAT.custom_mode"),
    Source.MODE_NUMBER: _mode_number,
    Source.STATE: _state,
    Source.STATE_AND_RC: _state_and_rc,
    Source.SYS_STATUS: _sys_status("SYS_STATUS"),
    Source.SAFETY_SWITCH: _sys_status("SYS_STATUS: MOTOR_OUTPUTS present, not enabled"),
    Source.PREARM_CHECK: _prearm_check,
    Source.INTERNAL_ERRORS: _internal_errors,
    Source.SENSOR: _sensor,
    Source.VERSION: _version,
    Source.SWITCHES: _switches,
    Source.STOP: _stop,
    Source.APPLET: _applet,
    Source.APPLET_AND_OUTPUTS: _applet_and_outputs,
    Source.RC_CHANNELS: _rc_channels,
    Source.LATCH: _latch,
    Source.PARTS: _parts,
    Source.CLAIMS: _claims,
    Source.ESC: _esc,
    Source.OUTPUTS: _outputs,
    Source.LANDED_STATE: _landed_state,
    Source.LANDED_NUMBER: _landed_number,
    Source.VELOCITY: _velocity,
    Source.GPS: _gps,
    Source.ATTITUDE: _attitude,
    Source.HIGH_LATENCY: _high_latency,
}
assert set(SHOW) == set(Source)
