"""Writers of onboard logs, for tests: DataFlash and ULog, from the specifications."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from typing import Any

from mav_robot_status.hardware.onboard_log.dataflash import CODES

FORMATS = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "ARM": (1, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "EV": (2, "QB", "TimeUS,Id"),
    "MODE": (3, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ERR": (4, "QBB", "TimeUS,Subsys,ECode"),
    "MSG": (5, "QZ", "TimeUS,Message"),
    "PARM": (6, "QNff", "TimeUS,Name,Value,Default"),
    "RCOU": (7, "QHHHH", "TimeUS,C1,C2,C3,C4"),
    "GPS": (8, "QBBIHff", "TimeUS,I,Status,GMS,GWk,Spd,VZ"),
    "ATT": (9, "QccC", "TimeUS,Roll,Pitch,Yaw"),
    "STAT": (10, "QBBBB", "TimeUS,isFlying,Armed,Safety,Crash"),
    "POWR": (11, "QB", "TimeUS,Safety"),
    "MAVC": (12, "QBBHfB", "TimeUS,SS,SC,Cmd,P1,Res"),
    "AUXF": (13, "QHBB", "TimeUS,function,pos,source"),
    "XKF1": (14, "QBfff", "TimeUS,C,VN,VE,VD"),
    "XKF4": (15, "QBH", "TimeUS,C,SS"),
}
"""By name: type, types of values, columns."""
HEAD = b"\xa3\x95"


def record(name: str, *values: Any) -> bytes:
    """One DataFlash record."""
    kind, types, _ = FORMATS[name]
    layout = struct.Struct("<" + "".join(CODES[code] for code in types))
    plain = [value.encode() if isinstance(value, str) else value for value in values]
    return HEAD + bytes([kind]) + layout.pack(*plain)


def formats(names: Iterable[str] = FORMATS) -> bytes:
    """The FMT records of some names."""
    made = b""
    for name in names:
        kind, types, columns = FORMATS[name]
        size = struct.calcsize("<" + "".join(CODES[code] for code in types)) + 3
        made += record("FMT", kind, size, name, types, columns)
    return made


def dataflash(*records: tuple[Any, ...], names: Iterable[str] = FORMATS) -> bytes:
    """A DataFlash log of (seconds since boot, name, values...)."""
    return formats(names) + b"".join(record(str(one[1]), round(one[0] * 1e6), *one[2:]) for one in records)


def message(kind: bytes, body: bytes) -> bytes:
    """One ULog message."""
    return struct.pack("<H", len(body)) + kind + body


TOPICS: Mapping[str, str] = {
    "actuator_armed": "uint64_t timestamp;bool armed;bool lockdown;bool kill;bool termination;uint8_t[4] _padding0;",
    "vehicle_status": (
        "uint64_t timestamp;uint8_t nav_state;uint8_t system_type;uint8_t system_id;uint8_t component_id;"
        "bool failsafe;bool pre_flight_checks_pass;uint8_t hil_state;uint8_t latest_disarming_reason;"
    ),
    "vehicle_land_detected": "uint64_t timestamp;bool landed;bool at_rest;uint8_t[6] _padding0;",
    "vehicle_local_position": "uint64_t timestamp;float vx;float vy;float vz;bool v_xy_valid;bool v_z_valid;",
    "vehicle_command": "uint64_t timestamp;uint32_t command;uint8_t source_system;bool from_external;",
    "actuator_test": "uint64_t timestamp;float value;uint32_t timeout_ms;uint16_t function;uint8_t action;",
    "sensor_gps": "uint64_t timestamp;uint64_t time_utc_usec;",
    "failsafe_flags": "uint64_t timestamp;bool manual_control_signal_lost;bool gcs_connection_lost;",
}
LAYOUTS = {
    "actuator_armed": "<Q????",
    "vehicle_status": "<QBBBB??BB",
    "vehicle_land_detected": "<Q??",
    "vehicle_local_position": "<Qfff??",
    "vehicle_command": "<QIB?",
    "actuator_test": "<QfIHB",
    "sensor_gps": "<QQ",
    "failsafe_flags": "<Q??",
}


def ulog(*records: tuple[Any, ...], names: Iterable[str] = TOPICS, start: float = 0) -> bytes:
    """A ULog file of (seconds since boot, topic, values...); the topic `L` is a text, `O` a dropout."""
    made = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(start * 1e6)) + message(b"B", bytes(40))
    made += message(b"I", b"\x17uint32_t ver_sw_release" + struct.pack("<I", 0x010F00FF))
    numbers = {name: number for number, name in enumerate(names)}
    for name in numbers:
        made += message(b"F", f"{name}:{TOPICS[name]}".encode())
    for name, number in numbers.items():
        made += message(b"A", bytes([0]) + struct.pack("<H", number) + name.encode())
    for at, name, *values in records:
        us = round(float(at) * 1e6)
        if name == "L":
            made += message(b"L", b"\x36" + struct.pack("<Q", us) + str(values[0]).encode())
        elif name == "O":
            made += message(b"O", struct.pack("<H", values[0]))
        else:
            layout = struct.Struct(LAYOUTS[name])
            made += message(b"D", struct.pack("<H", numbers[name]) + layout.pack(us, *values))
    return made
