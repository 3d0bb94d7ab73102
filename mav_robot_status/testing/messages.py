"""Builds MAVLink messages from the state of the vehicle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import all as dialect

from ..mavlink.definitions import ComponentMetadata
from .event_table import VehicleFiles
from .firmware import ARDUPILOT, PX4, Firmware, base_mode, sensors, system_status
from .scenario import Text, VehicleState

HEARTBEAT, SYS_STATUS, HIGH_LATENCY2 = 0, 1, 235
HOME = (-353632610, 1491652300, 584000)
"""Latitude and longitude in 1e-7 degrees, altitude in mm. They never change: a status does not depend on them."""
CHUNK = 50
NOT_OF_ARDUPILOT, ONLY_OF_ARDUPILOT = {436}, {193}
ESTIMATED, UNAIDED = 0x33F, 0xA7  # EKF_STATUS_FLAGS: all estimates; only attitude and height, in constant position mode


class Snapshot(NamedTuple):
    """The inputs of a message."""

    firmware: Firmware
    state: VehicleState
    prearm_ok: bool
    """The result of the last run of the pre-arm checks."""
    boot_ms: int
    unix_us: int


def heartbeat(s: Snapshot) -> Any:
    """HEARTBEAT."""
    f, state = s.firmware, s.state
    return dialect.MAVLink_heartbeat_message(
        custom_mode=state.custom_mode,
        type=f.type,
        autopilot=f.autopilot,
        base_mode=base_mode(f, state),
        system_status=system_status(f, state),
        mavlink_version=3,
    )


def _sys_status(s: Snapshot) -> Any:
    present, enabled, health = sensors(s.firmware, s.state, s.prearm_ok)
    return dialect.MAVLink_sys_status_message(
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=enabled,
        onboard_control_sensors_health=health,
        load=0,
        voltage_battery=12600,
        current_battery=0,
        drop_rate_comm=0,
        errors_comm=0,
        errors_count1=s.state.errors_count1,
        errors_count2=0,
        errors_count3=0,
        errors_count4=0,
        battery_remaining=100,
        onboard_control_sensors_present_extended=0,
        onboard_control_sensors_enabled_extended=0,
        onboard_control_sensors_health_extended=0,
    )


def _system_time(s: Snapshot) -> Any:
    return dialect.MAVLink_system_time_message(s.unix_us if s.state.position else 0, s.boot_ms)


def _attitude(s: Snapshot) -> Any:
    return dialect.MAVLink_attitude_message(s.boot_ms, 0.0, 0.0, 0.0, *s.state.rates)


def _local_position(s: Snapshot) -> Any:
    return dialect.MAVLink_local_position_ned_message(s.boot_ms, 0.0, 0.0, 0.0, *s.state.velocity)


def _global_position(s: Snapshot) -> Any:
    lat, lon, alt = HOME if s.state.position else (0, 0, 0)
    vx, vy, vz = (round(v * 100) for v in s.state.velocity)
    return dialect.MAVLink_global_position_int_message(s.boot_ms, lat, lon, alt, 0, vx, vy, vz, 0)


def _servo_outputs(s: Snapshot) -> Any:
    outputs = s.firmware.outputs(s.state) if s.state.servos is None else s.state.servos
    main, auxiliary = (outputs + (0,) * 8)[:8], (outputs[8:] + (0,) * 8)[:8]
    return dialect.MAVLink_servo_output_raw_message(s.boot_ms * 1000 & 0xFFFFFFFF, 0, *main, *auxiliary)


def _vfr_hud(s: Snapshot) -> Any:
    north, east, down = s.state.velocity
    speed = math.hypot(north, east)
    return dialect.MAVLink_vfr_hud_message(
        airspeed=speed, groundspeed=speed, alt=HOME[2] / 1000, climb=-down, heading=0, throttle=s.state.throttle
    )


def _extended_sys_state(s: Snapshot) -> Any:
    vtol_state = s.firmware.vtol_state if s.state.vtol_state is None else s.state.vtol_state
    return dialect.MAVLink_extended_sys_state_message(vtol_state, s.state.landed_state)


def _current_mode(s: Snapshot) -> Any:
    number = s.state.custom_mode
    standard_mode = next((mode.standard_mode for mode in s.firmware.modes if mode.custom_mode == number), 0)
    return dialect.MAVLink_current_mode_message(
        custom_mode=number, intended_custom_mode=number, standard_mode=standard_mode
    )


def _ekf_status_report(s: Snapshot) -> Any:
    flags = ESTIMATED if s.state.position else UNAIDED
    return dialect.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.0)


FAILURE_FLAGS = {5: 1, 4: 2, 3: 4, 1: 8, 0: 16, 2: 32, 22: 64, 25: 128, 16: 256, 20: 2048, 21: 4096}
"""HL_FAILURE_FLAG by the bit of SYS_STATUS that is not healthy."""
UNTOLD = -128


def high_latency2(s: Snapshot) -> Any:
    """HIGH_LATENCY2: ArduPilot sends base_mode, and sets a flag for a sensor that it lacks; PX4 does neither."""
    f, state = s.firmware, s.state
    north, east, down = state.velocity
    lat, lon, alt = HOME if state.position else (0, 0, 0)
    is_px4 = f.autopilot == PX4
    _, enabled, health = sensors(f, state, s.prearm_ok)
    faulty = ~health & (enabled if is_px4 else -1)
    armed = base_mode(f, state)
    return dialect.MAVLink_high_latency2_message(
        timestamp=s.boot_ms,
        latitude=lat,
        longitude=lon,
        custom_mode=state.custom_mode >> 16 if is_px4 else state.custom_mode,
        altitude=alt // 1000,
        target_altitude=alt // 1000,
        target_distance=0,
        wp_num=0xFFFF if is_px4 else 0,
        failure_flags=sum(flag for bit, flag in FAILURE_FLAGS.items() if faulty >> bit & 1),
        type=f.type,
        autopilot=f.autopilot,
        heading=0,
        target_heading=0,
        throttle=state.throttle,
        airspeed=0,
        airspeed_sp=0,
        groundspeed=min(round(math.hypot(north, east) * 5), 255),
        windspeed=0,
        wind_heading=0,
        eph=10 if is_px4 else 0,
        epv=15 if is_px4 else 0,
        temperature_air=UNTOLD,
        climb_rate=min(round(abs(down) * 10), 127) if is_px4 else 0,
        battery=100,
        custom0=UNTOLD if is_px4 else armed - 256 if armed > 127 else armed,
        custom1=UNTOLD if is_px4 else 0,
        custom2=UNTOLD if is_px4 else 0,
    )


def applet_value(state: VehicleState) -> int:
    """The value of RS_STOP: 1 for the emergency stop and 2 for the safety switch."""
    return state.emergency_stop + 2 * state.safety_switch


def applet_report(s: Snapshot) -> Any:
    """NAMED_VALUE_FLOAT RS_STOP, as the applet sends it."""
    return dialect.MAVLink_named_value_float_message(s.boot_ms, b"RS_STOP", applet_value(s.state))


BUILDERS: dict[int, Callable[[Snapshot], Any]] = {
    HEARTBEAT: heartbeat,
    SYS_STATUS: _sys_status,
    2: _system_time,
    30: _attitude,
    32: _local_position,
    33: _global_position,
    36: _servo_outputs,
    74: _vfr_hud,
    193: _ekf_status_report,
    HIGH_LATENCY2: high_latency2,
    245: _extended_sys_state,
    436: _current_mode,
}


def can_send(firmware: Firmware, message_id: int) -> bool:
    """Whether this firmware streams that message on request."""
    return (
        message_id in BUILDERS
        and message_id != HEARTBEAT
        and message_id not in (NOT_OF_ARDUPILOT if firmware.autopilot == ARDUPILOT else ONLY_OF_ARDUPILOT)
        and (firmware.on_request is None or message_id in firmware.on_request)
    )


def available_modes(firmware: Firmware, index: int) -> list[Any]:
    """AVAILABLE_MODES of the mode with this index, which counts from 1; 0: of all modes."""
    return [
        dialect.MAVLink_available_modes_message(
            custom_mode=mode.custom_mode,
            properties=mode.properties,
            number_modes=len(firmware.modes),
            mode_index=i,
            standard_mode=mode.standard_mode,
            mode_name=mode.name.encode(),
        )
        for i, mode in enumerate(firmware.modes, 1)
        if index in (0, i)
    ]


def autopilot_version(firmware: Firmware) -> Any:
    """AUTOPILOT_VERSION."""
    return dialect.MAVLink_autopilot_version_message(0, firmware.version, 0, 0, 0, *(bytes(8),) * 3, 0, 0, 0)


def component_metadata(s: Snapshot, files: VehicleFiles) -> Any:
    """COMPONENT_METADATA."""
    return ComponentMetadata(s.boot_ms, files.crc, files.uri.encode())


def statustexts(firmware: Firmware, text: Text, number: int) -> list[Any]:
    """The STATUSTEXT messages of one text. PX4 numbers every text, others only texts in several chunks. An empty chunk
    follows a full last chunk, because only a short chunk marks the end."""
    data = text.text.encode()
    if firmware.autopilot != PX4 and len(data) <= CHUNK:
        return [dialect.MAVLink_statustext_message(text.severity, data, 0, 0)]
    chunks = [data[i : i + CHUNK] for i in range(0, len(data) + 1, CHUNK)]
    return [dialect.MAVLink_statustext_message(text.severity, chunk, number, i) for i, chunk in enumerate(chunks)]
