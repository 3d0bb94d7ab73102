"""The traffic of the benchmarks: one vehicle at the stream rates of a ground station, the same bytes in every run.

There are two workloads, each with 80 frames a second of 26 message types, MAVLink 2. In `QUARTER` a status needs 27.5 %
of the frames, in `HALF` it needs 50 %: attitude, speed and position come at 8 to 10 Hz, as a ground station asks for
them. pymavlink encodes the frames, so that our own code does not decide what a valid frame is.
"""

from __future__ import annotations

import random
import struct
import time
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from mav_robot_status.mavlink.definitions import CRC_EXTRA
from mav_robot_status.mavlink.encode import with_crc
from mav_robot_status.mavlink.wire import REVERSED

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

RATE: Final = 80
"""Frames a second of one vehicle."""
PATTERN: Final = 800
"""Frames until the pattern of messages repeats: ten seconds."""
LOOP: Final = 6400
"""Frames of one loop: whole patterns, and a multiple of 256 for the sequence numbers."""
SHORT_LOOP: Final = 1280
"""The same for one of many vehicles, to save memory: whole seconds."""
DISTINCT: Final = 3 * LOOP
"""Frames of the loop without equal frames, with those that are left out of it."""
BOOT_MS: Final = 600_000
STILL_MS: Final = 1500
"""Milliseconds by which the boot clock advances within a loop. A new loop must not look like a reboot."""


class Workload(NamedTuple):
    """A mix of messages."""

    name: str
    """In words, for the tables."""
    sent: dict[str, int]
    """Name of a message -> how often it is sent in ten seconds."""


QUARTER: Final = Workload("a quarter needed", {
    # a status needs these
    "heartbeat": 10, "sys_status": 10, "system_time": 10, "gps_raw_int": 10, "attitude": 10,
    "global_position_int": 10, "vfr_hud": 10, "servo_output_raw": 20, "ekf_status_report": 40, "statustext": 2,
    # a status does not need these, except mission_current, rc_channels and battery_status
    "raw_imu": 50, "scaled_imu2": 50, "scaled_imu3": 50, "scaled_pressure": 50, "scaled_pressure2": 40,
    "power_status": 50, "meminfo": 50, "nav_controller_output": 40, "mission_current": 48, "rc_channels": 20,
    "ahrs": 40, "ahrs2": 40, "vibration": 50, "battery_status": 20, "terrain_report": 20,
    "position_target_global_int": 50,
})  # fmt: skip
HALF: Final = Workload("half needed", {
    # a status needs these
    "heartbeat": 10, "sys_status": 20, "system_time": 10, "gps_raw_int": 20, "attitude": 100,
    "global_position_int": 80, "vfr_hud": 80, "servo_output_raw": 20, "ekf_status_report": 20, "statustext": 2,
    "mission_current": 10, "rc_channels": 20, "battery_status": 8,
    # a status does not need these
    "raw_imu": 40, "scaled_imu2": 40, "scaled_imu3": 20, "scaled_pressure": 40, "scaled_pressure2": 20,
    "power_status": 40, "meminfo": 20, "nav_controller_output": 40, "ahrs": 20, "ahrs2": 20, "vibration": 40,
    "terrain_report": 20, "position_target_global_int": 40,
})  # fmt: skip
WORKLOADS: Final = (QUARTER, HALF)

FIXED: Final[dict[str, dict[str, Any]]] = {
    "heartbeat": {"type": 2, "autopilot": 3, "base_mode": 217, "custom_mode": 3, "system_status": 4,
                  "mavlink_version": 3},
    "sys_status": {"onboard_control_sensors_present": 0x2361FC2F, "onboard_control_sensors_enabled": 0x2361FC2F,
                   "onboard_control_sensors_health": 0x2361FC2F, "battery_remaining": 80, "drop_rate_comm": 0,
                   "errors_comm": 0, "errors_count1": 0, "errors_count2": 0, "errors_count3": 0, "errors_count4": 0,
                   "onboard_control_sensors_present_extended": 0, "onboard_control_sensors_enabled_extended": 0,
                   "onboard_control_sensors_health_extended": 0},
    "gps_raw_int": {"fix_type": 6},
    "global_position_int": {"vx": 500, "vy": 100, "vz": 0},
    "battery_status": {"id": 0, "charge_state": 1, "fault_bitmask": 0},  # healthy
    "ekf_status_report": {"flags": 831},  # all estimates
    "vfr_hud": {"airspeed": 5.0, "groundspeed": 5.0, "throttle": 40},
    "statustext": {"severity": 6, "text": b"EKF3 IMU0 is using GPS", "id": 0, "chunk_seq": 0},
    "servo_output_raw": {"port": 0, "servo1_raw": 1500, "servo2_raw": 1510, "servo3_raw": 1490, "servo4_raw": 1505},
}  # fmt: skip
"""The fields that determine the status: armed, AUTO, driving, healthy. So the status never changes."""
RANGES: Final = {
    "uint8_t": (0, 100), "int8_t": (0, 100), "char": (0, 0), "uint16_t": (0, 2000), "int16_t": (-1000, 1000),
    "uint32_t": (0, 100_000), "int32_t": (-100_000, 100_000), "uint64_t": (1, 1 << 50), "int64_t": (1, 1 << 50),
}  # fmt: skip


def frames(
    count: int = LOOP, step_ms: float = STILL_MS / LOOP, key: bytes | None = None, workload: Workload = QUARTER
) -> list[bytes]:
    """The first `count` frames; each advances the boot clock by `step_ms`. With a `key` (32 bytes) they are signed.

    Signed frames contain the current time. A receiver accepts them only once.
    """
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    if key is not None:
        mav.signing.secret_key, mav.signing.sign_outgoing, mav.signing.link_id = key, True, 1
        mav.signing.timestamp = _signing_time()
    chance = random.Random(80)
    order = _order(workload)
    made = []
    for i in range(count):
        message = _message(order[i % PATTERN], BOOT_MS + round(i * step_ms), chance)
        made.append(bytes(message.pack(mav)))
        mav.seq = (mav.seq + 1) & 255
    return made


def heartbeat(*, armed: bool, sequence: int = 0) -> bytes:
    """A HEARTBEAT of the vehicle."""
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    mav.seq = sequence
    fixed = FIXED["heartbeat"] | {"base_mode": 209 if armed else 81, "system_status": 4 if armed else 3}
    return bytes(dialect.MAVLink_heartbeat_message(**fixed).pack(mav))


def fleet(vehicles: int, workload: Workload = QUARTER, *, in_step: bool = False) -> list[bytes]:
    """A loop of frames of many vehicles in turn; for one vehicle the frames of `frames`.

    Each vehicle is at another place of the loop, so their messages are due at different times, as those of real
    vehicles. `in_step`: all vehicles send the same message at the same time.
    """
    if vehicles == 1:
        return frames(LOOP, workload=workload)
    one = frames(SHORT_LOOP, workload=workload)
    chance = random.Random(vehicles)
    phases = {system: 0 if in_step else chance.randrange(SHORT_LOOP) for system in range(1, vehicles + 1)}
    return [_of_system(one[(i + phase) % SHORT_LOOP], system) for i in range(SHORT_LOOP)
            for system, phase in phases.items()]  # fmt: skip


def distinct() -> list[bytes]:
    """A loop without two equal frames: a router drops a frame that it has just forwarded, as a copy or a loop.

    It is longer than our memory of frames, so that none is remembered from the loop before.
    """
    return list(dict.fromkeys(frames(DISTINCT)))


def chunks(made: list[bytes], size: int = 1400) -> list[bytes]:
    """The frames as a stream, cut into pieces of `size` bytes."""
    stream = b"".join(made)
    return [stream[i : i + size] for i in range(0, len(stream), size)]


def write_log(path: Path, count: int, workload: Workload = QUARTER) -> None:
    """Write a recorded log."""
    with path.open("wb") as log:
        for i, frame in enumerate(frames(count, step_ms=1000 / RATE, workload=workload)):
            log.write(_stamp(i) + frame)


def write_long_log(path: Path, size: int, workload: Workload = HALF) -> None:
    """Write a recorded log of at least `size` bytes, from one loop of frames over and over."""
    loop = frames(workload=workload)
    with path.open("wb") as log:
        first = 0
        while log.tell() < size:
            log.write(b"".join(_stamp(first + i) + frame for i, frame in enumerate(loop)))
            first += len(loop)


def save(path: Path, made: list[bytes]) -> None:
    """Write frames for a child program. The length of each frame, in two bytes, precedes it."""
    path.write_bytes(b"".join(struct.pack("<H", len(frame)) + frame for frame in made))


def load(path: Path) -> Iterator[bytes]:
    """Read the frames that `save` has written."""
    data = path.read_bytes()
    at = 0
    while at < len(data):
        end = at + 2 + int.from_bytes(data[at : at + 2], "little")
        yield data[at + 2 : end]
        at = end


def _stamp(number: int) -> bytes:
    """The time of a frame in a recorded log."""
    return (1_800_000_000_000_000 + number * 1_000_000 // RATE).to_bytes(8, "big")


def _order(workload: Workload) -> list[str]:
    """The names of the messages of ten seconds. Each type is evenly spread."""
    slots = [((i + 0.5) / number, kind) for kind, number in workload.sent.items() for i in range(number)]
    return [kind for _, kind in sorted(slots)]


def _message(kind: str, boot_ms: int, chance: random.Random) -> Any:
    made = getattr(dialect, f"MAVLink_{kind}_message")
    fixed = FIXED.get(kind, {})
    values = []
    lengths = [made.array_lengths[order] for order in made.orders]  # in wire order, unlike names and types
    for name, type_, length in zip(made.fieldnames, made.fieldtypes, lengths, strict=True):
        if name in fixed:
            values.append(fixed[name])
        elif name == "time_boot_ms":
            values.append(boot_ms)
        elif length:
            values.append([_value(type_, chance) for _ in range(length)])
        else:
            values.append(_value(type_, chance))
    return made(*values)


def _value(type_: str, chance: random.Random) -> float:
    return chance.uniform(-1, 1) if type_ in ("float", "double") else chance.randint(*RANGES[type_])


def numbered(frame: bytes, sequence: int) -> bytes:
    """The frame with another sequence number (0 to 255) and a new CRC."""
    extra = CRC_EXTRA[int.from_bytes(frame[7:10], "little")]
    return with_crc(frame[:4] + bytes([sequence]) + frame[5:-2], REVERSED[extra : extra + 1])


def _of_system(frame: bytes, system: int) -> bytes:
    """The frame with another system id and a new CRC."""
    extra = CRC_EXTRA[int.from_bytes(frame[7:10], "little")]
    return with_crc(frame[:5] + bytes([system]) + frame[6:-2], REVERSED[extra : extra + 1])


def _signing_time() -> int:
    """MAVLink's signing time: units of 10 us since 2015."""
    return int((time.time() - 1_420_070_400) * 100_000)
