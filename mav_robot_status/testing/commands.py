"""How the vehicle answers received messages."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import all as dialect

from .firmware import (
    ACCEPTED,
    ARDUPILOT,
    DENIED,
    FAILED,
    IN_AIR,
    LANDING,
    PX4,
    TAKEOFF,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    not_armable,
    px4_mode,
)
from .messages import BUILDERS, autopilot_version, available_modes, can_send, component_metadata
from .scenario import Text, step
from .vehicle_model import VehicleModel

CUSTOM_MODE_ENABLED = 1
FORCED = 21196
GCS = 6
GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 510, 511, 512
ARM_DISARM, DO_SET_MODE, SET_MODE, DO_AUX_FUNCTION, RUN_PREARM_CHECKS = 400, 176, 11, 218, 401
MOTOR_ESTOP = 31
"""The auxiliary function of ArduPilot that stops all motors."""
LOW, HIGH = 0, 2
AUTOPILOT_VERSION, AVAILABLE_MODES, COMPONENT_METADATA = 148, 435, 397
STREAM_GROUPS = {2: (1,), 3: (36,), 6: (33, 32), 10: (30,), 11: (74,), 12: (2,)}
"""ArduPilot's stream groups: the message ids that REQUEST_DATA_STREAM starts. Group 0 means all groups."""
INT16 = 4
FILE_TRANSFER_SIZE = 251
"""Bytes of FILE_TRANSFER_PROTOCOL.payload."""


def answer(model: VehicleModel, message: Any) -> None:
    """Process one received message. The next `VehicleModel.run` returns the answers."""
    model.peer_seen = True
    model.gcs_seen |= message.get_type() == "HEARTBEAT" and message.type == GCS
    if message.get_type() in ANSWERS:
        ANSWERS[message.get_type()](model, message)


def _command(model: VehicleModel, m: Any) -> None:
    result = COMMANDS[m.command](model, m) if m.command in COMMANDS else UNSUPPORTED
    _acknowledge(model, m, m.command, result)
    if m.command == DO_SET_MODE and model.firmware.autopilot == PX4:
        _acknowledge(model, m, m.command, result)  # PX4 acknowledges this command twice


def _acknowledge(model: VehicleModel, m: Any, command: int, result: int) -> None:
    model.send(dialect.MAVLink_command_ack_message(command, result, 0, 0, m.get_srcSystem(), m.get_srcComponent()))


def _set_message_interval(model: VehicleModel, m: Any) -> int:
    message_id, microseconds = m.param1, m.param2
    if not can_send(model.firmware, message_id):
        return FAILED
    if microseconds == 0:
        hz = model.default_streams.get(int(message_id))
        model.request(int(message_id), 1 / hz if hz else None)
    elif microseconds == -1:
        model.request(int(message_id), None)
    elif microseconds > 0:
        model.request(int(message_id), min(max(microseconds / 1e6, 0.001), 60.0))
    else:  # negative or NaN
        return DENIED
    return ACCEPTED


def _get_message_interval(model: VehicleModel, m: Any) -> int:
    if not can_send(model.firmware, m.param1):
        return FAILED
    message_id = int(m.param1)
    interval = model.interval(message_id)
    model.send(dialect.MAVLink_message_interval_message(message_id, -1 if interval is None else round(interval * 1e6)))
    return ACCEPTED


def _request_message(model: VehicleModel, m: Any) -> int:
    if m.param1 == AVAILABLE_MODES and model.firmware.modes:
        for mode in available_modes(model.firmware, int(m.param2) if math.isfinite(m.param2) else 0):
            model.send(mode)
        return ACCEPTED
    if m.param1 == AUTOPILOT_VERSION and model.firmware.version:
        model.send(autopilot_version(model.firmware))
        return ACCEPTED
    if m.param1 == COMPONENT_METADATA and model.files is not None:
        model.send(component_metadata(model.snapshot(), model.files))
        return ACCEPTED
    if not can_send(model.firmware, m.param1):
        return UNSUPPORTED
    model.send(BUILDERS[int(m.param1)](model.snapshot()))
    return ACCEPTED


def _arm_disarm(model: VehicleModel, m: Any) -> int:
    arm, forced, state = m.param1 == 1, m.param2 == FORCED, model.state
    if arm and not_armable(state) and not forced:
        refusal = model.firmware.arming_refused
        for text in dict.fromkeys(refusal.format(reason) for reason in not_armable(state)):
            model.say(Text(2, text))
        return model.firmware.refused
    if not arm and state.armed and state.landed_state in (IN_AIR, TAKEOFF, LANDING) and not forced:
        return model.firmware.refused
    model.do(step(0.0, "", armed=arm))
    return ACCEPTED


def _run_prearm_checks(model: VehicleModel, m: Any) -> int:
    """Only ArduPilot announces the reasons in texts. The periodic announcement keeps its period, as in the firmware."""
    if not model.firmware.prearm_prefix:
        return UNSUPPORTED
    if model.state.armed:
        return TEMPORARILY_REJECTED
    model.say_prearm()
    return ACCEPTED


def _do_aux_function(model: VehicleModel, m: Any) -> int:
    if model.firmware.autopilot != ARDUPILOT or m.param1 != MOTOR_ESTOP:
        return UNSUPPORTED
    if m.param2 in (LOW, HIGH):
        model.do(step(0.0, "", emergency_stop=m.param2 == HIGH))
    return ACCEPTED


def _do_set_mode(model: VehicleModel, m: Any) -> int:
    if not all(map(math.isfinite, (m.param1, m.param2, m.param3))):
        return DENIED
    if model.firmware.autopilot == PX4:
        return _change_mode(model, int(m.param1), px4_mode(int(m.param2) & 0xFF, int(m.param3) & 0xFF))
    return _change_mode(model, int(m.param1), int(m.param2))


def _set_mode(model: VehicleModel, m: Any) -> None:
    command = SET_MODE if model.firmware.autopilot == ARDUPILOT else DO_SET_MODE
    _acknowledge(model, m, command, _change_mode(model, m.base_mode, m.custom_mode))


def _change_mode(model: VehicleModel, base_mode: int, custom_mode: int) -> int:
    if not base_mode & CUSTOM_MODE_ENABLED:
        return DENIED
    if custom_mode not in model.firmware.base_modes:
        model.say(Text(4, f"No such mode {custom_mode}"))
        return FAILED
    model.do(step(0.0, "", custom_mode=custom_mode))
    return ACCEPTED


def _request_data_stream(model: VehicleModel, m: Any) -> None:
    if model.firmware.autopilot != ARDUPILOT:
        return
    groups = STREAM_GROUPS if m.req_stream_id == 0 else {m.req_stream_id}
    for message_id in (i for group in groups for i in STREAM_GROUPS.get(group, ())):
        model.request(message_id, 1 / m.req_message_rate if m.start_stop == 1 and m.req_message_rate else None)


def _param_request_read(model: VehicleModel, m: Any) -> None:
    """Like ArduPilot, this sends nothing for an unknown parameter."""
    names = list(model.firmware.parameters)
    name = m.param_id if m.param_index < 0 else names[m.param_index] if m.param_index < len(names) else ""
    if name in model.firmware.parameters:
        value = float(model.firmware.parameters[name])
        model.send(dialect.MAVLink_param_value_message(name.encode(), value, INT16, len(names), m.param_index & 0xFFFF))


def _file_transfer(model: VehicleModel, m: Any) -> None:
    client = m.get_srcSystem(), m.get_srcComponent()
    if model.file_server is not None:
        for payload in model.file_server.answer(bytes(m.payload), model.now):
            model.send(
                dialect.MAVLink_file_transfer_protocol_message(0, *client, payload.ljust(FILE_TRANSFER_SIZE, b"\0"))
            )


COMMANDS: dict[int, Callable[[VehicleModel, Any], int]] = {
    GET_MESSAGE_INTERVAL: _get_message_interval,
    SET_MESSAGE_INTERVAL: _set_message_interval,
    REQUEST_MESSAGE: _request_message,
    ARM_DISARM: _arm_disarm,
    RUN_PREARM_CHECKS: _run_prearm_checks,
    DO_AUX_FUNCTION: _do_aux_function,
    DO_SET_MODE: _do_set_mode,
}
ANSWERS: dict[str, Callable[[VehicleModel, Any], None]] = {
    "COMMAND_LONG": _command,
    "COMMAND_INT": _command,
    "SET_MODE": _set_mode,
    "REQUEST_DATA_STREAM": _request_data_stream,
    "PARAM_REQUEST_READ": _param_request_read,
    "FILE_TRANSFER_PROTOCOL": _file_transfer,
}
