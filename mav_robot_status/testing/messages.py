"""From what is the case to MAVLink messages, with pymavlink: on purpose not with the gateway's own encoder."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from ..mavlink.pymavlink_dialect import (
    MAVLink_attitude_message,
    MAVLink_available_modes_message,
    MAVLink_current_mode_message,
    MAVLink_ekf_status_report_message,
    MAVLink_extended_sys_state_message,
    MAVLink_global_position_int_message,
    MAVLink_heartbeat_message,
    MAVLink_local_position_ned_message,
    MAVLink_message,
    MAVLink_servo_output_raw_message,
    MAVLink_statustext_message,
    MAVLink_sys_status_message,
    MAVLink_system_time_message,
    MAVLink_vfr_hud_message,
)
from .firmware import ARDUPILOT, PX4, Firmware, base_mode, sensors, system_status
from .scenario import Text, VehicleState

HEARTBEAT, SYS_STATUS = 0, 1
HOME = (-353632610, 1491652300, 584000)
"""1e-7 degrees and mm. The vehicle is always here, however it moves: a status does not depend on it."""
CHUNK = 50
NOT_OF_ARDUPILOT, ONLY_OF_ARDUPILOT = {436}, {193}
ESTIMATED, UNAIDED = 0x33F, 0xA7  # EKF_STATUS_FLAGS: all there is; attitude and height alone, taken to stand


class Snapshot(NamedTuple):
    """All that a message is made of."""

    firmware: Firmware
    state: VehicleState
    prearm_ok: bool
    """What the last run of the pre-arm checks found."""
    boot_ms: int
    unix_us: int


def heartbeat(s: Snapshot) -> MAVLink_message:
    """HEARTBEAT."""
    f, state = s.firmware, s.state
    return MAVLink_heartbeat_message(
        f.type, f.autopilot, base_mode(f, state), state.custom_mode, system_status(f, state), 3
    )


def _sys_status(s: Snapshot) -> MAVLink_message:
    present, enabled, health = sensors(s.firmware, s.state, s.prearm_ok)
    return MAVLink_sys_status_message(
        present, enabled, health, 0, 12600, 0, 100, 0, 0, s.state.errors_count1, 0, 0, 0
    )  # fmt: skip


def _system_time(s: Snapshot) -> MAVLink_message:
    return MAVLink_system_time_message(s.unix_us if s.state.position else 0, s.boot_ms)


def _attitude(s: Snapshot) -> MAVLink_message:
    return MAVLink_attitude_message(s.boot_ms, 0.0, 0.0, 0.0, *s.state.rates)


def _local_position(s: Snapshot) -> MAVLink_message:
    return MAVLink_local_position_ned_message(s.boot_ms, 0.0, 0.0, 0.0, *s.state.velocity)


def _global_position(s: Snapshot) -> MAVLink_message:
    lat, lon, alt = HOME if s.state.position else (0, 0, 0)
    vx, vy, vz = (round(v * 100) for v in s.state.velocity)
    return MAVLink_global_position_int_message(s.boot_ms, lat, lon, alt, 0, vx, vy, vz, 0)


def _servo_outputs(s: Snapshot) -> MAVLink_message:
    outputs = s.firmware.outputs(s.state) if s.state.servos is None else s.state.servos
    return MAVLink_servo_output_raw_message(s.boot_ms * 1000 & 0xFFFFFFFF, 0, *(outputs + (0,) * 16)[:16])


def _vfr_hud(s: Snapshot) -> MAVLink_message:
    north, east, down = s.state.velocity
    speed = math.hypot(north, east)
    return MAVLink_vfr_hud_message(speed, speed, 0, s.state.throttle, HOME[2] / 1000, -down)


def _extended_sys_state(s: Snapshot) -> MAVLink_message:
    vtol_state = s.firmware.vtol_state if s.state.vtol_state is None else s.state.vtol_state
    return MAVLink_extended_sys_state_message(vtol_state, s.state.landed_state)


def _current_mode(s: Snapshot) -> MAVLink_message:
    number = s.state.custom_mode
    standard_mode = next((mode.standard_mode for mode in s.firmware.modes if mode.custom_mode == number), 0)
    return MAVLink_current_mode_message(standard_mode, number, number)


def _ekf_status_report(s: Snapshot) -> MAVLink_message:
    flags = ESTIMATED if s.state.position else UNAIDED
    return MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.0)


BUILDERS: dict[int, Callable[[Snapshot], MAVLink_message]] = {
    HEARTBEAT: heartbeat,
    SYS_STATUS: _sys_status,
    2: _system_time,
    30: _attitude,
    32: _local_position,
    33: _global_position,
    36: _servo_outputs,
    74: _vfr_hud,
    193: _ekf_status_report,
    245: _extended_sys_state,
    436: _current_mode,
}


def can_send(firmware: Firmware, message_id: int) -> bool:
    """True if that firmware has that stream, so that it can be requested."""
    return (
        message_id in BUILDERS
        and message_id != HEARTBEAT
        and message_id not in (NOT_OF_ARDUPILOT if firmware.autopilot == ARDUPILOT else ONLY_OF_ARDUPILOT)
        and (firmware.on_request is None or message_id in firmware.on_request)
    )


def available_modes(firmware: Firmware, index: int) -> list[MAVLink_message]:
    """AVAILABLE_MODES: the mode with this index, which counts from 1, or with 0 all of them."""
    return [
        MAVLink_available_modes_message(
            len(firmware.modes), i, mode.standard_mode, mode.custom_mode, mode.properties, mode.name.encode()
        )
        for i, mode in enumerate(firmware.modes, 1)
        if index in (0, i)
    ]


def statustexts(firmware: Firmware, text: Text, number: int) -> list[MAVLink_message]:
    """One text as it goes out. PX4 numbers every text, others only those that need chunks; a text that ends with a
    full chunk gets an empty one more, for only a short chunk says that it is the last."""
    data = text.text.encode()
    if firmware.autopilot != PX4 and len(data) <= CHUNK:
        return [MAVLink_statustext_message(text.severity, data)]
    chunks = [data[i : i + CHUNK] for i in range(0, len(data) + 1, CHUNK)]
    return [MAVLink_statustext_message(text.severity, chunk, number, i) for i, chunk in enumerate(chunks)]
