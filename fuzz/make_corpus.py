"""Writes the corpus from our encoder, examples and tables: `python fuzz/make_corpus.py`."""

from __future__ import annotations

import lzma
import random
import struct
from pathlib import Path
from typing import Any

from fuzz.work import SHAPES
from mav_robot_status.links.url import KINDS
from mav_robot_status.mavlink.definitions import MESSAGES, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.signing import Signer
from tests.onboard_logs import dataflash, ulog

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "config"

RARE = b"""links: [{url: "tcp:127.0.0.1:5760", robot_status: true}]
signing: {key_file: key, accept_unsigned: none, link_id: 7}
forward: true
record: flight.tlog
coalesce: 10 ms
requests: none
"""
"""Configuration keys that the examples lack."""


TABLE = b"""{"version": 2, "components": {"1": {"namespace": "px4",
"enums": {"navigation_mode_group_t": {"type": "uint32_t", "is_bitfield": true, "entries": {"8": {"name": "mission"}}},
"cause_t": {"type": "uint8_t", "entries": {"1": {"name": "rc", "description": "Sticks lost"}}}},
"navigation_mode_groups": {"groups": {"3": [67371008]}},
"event_groups": {"arming_check": {"events": {"7": {"name": "no_fix", "message": "GPS {3:.1m} has no fix",
"description": "Wait. <profile name=\\"dev\\">See <param>EKF2_GPS_CHECK</param></profile>",
"arguments": [{"type": "navigation_mode_group_t"}, {"type": "uint8_t"}, {"type": "float"}]}}},
"default": {"events": {"8": {"message": "{1}", "arguments": [{"type": "px4::cause_t"}]}}}}}}}"""
"""A table of PX4's events."""


def write(target: str, entries: list[bytes]) -> None:
    """Write one file for each entry."""
    folder = HERE / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for number, entry in enumerate(entries):
        (folder / f"{number:02}").write_bytes(entry)


def frames(version: int) -> list[bytes]:
    """One frame of every known message, with fields that are not all zero."""
    rng = random.Random(version)
    made = []
    for sequence, definition in enumerate(MESSAGES.values()):
        if version == 2 or definition.id < 256:
            values = definition.layout.unpack(rng.randbytes(definition.layout.size))
            message = definition.type._make(values)
            made.append(encode(message, system=1, component=1, sequence=sequence & 255, version=version))
    return made


def onboard_logs() -> list[bytes]:
    """A DataFlash log, the same as text, and a ULog file."""
    arm: list[tuple[Any, ...]] = [
        (2.0, "MSG", "ArduRover V4.5.6 (3cba3e7f)"),
        (2.0, "PARM", "SERVO3_FUNCTION", 70.0, 70.0),
    ]
    drive = [(3.0 + n / 5, "GPS", 0, 6, 1000 * n, 2446, 4.0, 0.0) for n in range(9)]
    stop = [(3.5, "ARM", 1, 1, 0, 1), (4.0, "EV", 54), (4.0, "MAVC", 255, 190, 218, 31.0, 0), (4.5, "ERR", 12, 1)]
    rest = [(4.6, "RCOU", 1500, 0, 1600, 0), (4.7, "STAT", 1, 1, 2, 0), (5.0, "MODE", 4, 4, 19), (9.0, "EV", 11)]
    binary = dataflash(*sorted([*arm, *drive, *stop, *rest], key=lambda one: one[0]))
    text = b"""FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns
FMT, 1, 17, ARM, QBIBB, TimeUS,ArmState,ArmChecks,Forced,Method
FMT, 5, 75, MSG, QZ, TimeUS,Message
MSG, 2000000, ArduCopter V4.5.6 (3cba3e7f)
ARM, 3000000, 1, 1, 0, 1
ARM, 4000000, 0, 0, 0, 12
"""
    flight: list[tuple[Any, ...]] = [(1 + n / 4, "vehicle_local_position", 1.0, 0.0, 0.0, True, True) for n in range(8)]
    status = [(1 + n / 2, "vehicle_status", 4, 2, 1, 1, False, True, 0, 0) for n in range(5)]
    kill = [(1.2, "actuator_armed", True, False, False, False), (2.0, "actuator_armed", True, False, True, False)]
    texts = [(1.1, "L", "[commander] Armed by external command"), (2.1, "O", 20), (2.2, "L", "Failsafe activated")]
    test = [(2.5, "actuator_test", 0.5, 500, 101, 1), (2.6, "vehicle_land_detected", False, False)]
    px4 = ulog(*sorted([*flight, *status, *kill, *texts, *test], key=lambda one: one[0]), start=1)
    return [binary, text, px4]


def main() -> None:
    """Write everything."""
    signer = Signer(bytes(range(32)), 3)
    signed = [signer.sign(frame, 1_800_000_000_000_000 + 10 * i) for i, frame in enumerate(frames(2))]
    write("framing", [b"".join(frames(1)), b"".join(frames(2)), b"".join(signed[:8]), *frames(2)[:6]])
    write("work", [shape[:1500] for shape in SHAPES.values()])
    write("signing", [b"".join(signed[:8]), *signed[:4], b"".join(frames(2)[:4])])
    heartbeat = struct.pack("<IBBBBB", 4, 2, 3, 209, 4, 3)
    heartbeats = [bytes([8, 16, number % 3, number]) + heartbeat[: 9 - number % 4] for number in range(60)]
    rng = random.Random(7)
    write("messages", [b"".join(heartbeats), rng.randbytes(2000), b"".join(heartbeats[:9]) + rng.randbytes(600)])
    text = encode(Statustext(2, b"PreArm: Compass not calibrated", 7, 1), system=1, component=1, sequence=0)
    write("texts", [b"".join(bytes([20, 3, n % 4, n]) + text[10:30] for n in range(12)), rng.randbytes(500)])
    write("event_table", [TABLE, lzma.compress(TABLE)])
    write("events", [rng.randbytes(2000), rng.randbytes(500)])
    write("onboard_log", onboard_logs())
    opening = bytes([4, 1, 7, 0]) + (100).to_bytes(4, "little")
    write("files", [opening * 3, opening + bytes([59, 1, 7, 0]) + bytes(60), opening + rng.randbytes(400)])
    write("configuration", [*(path.read_bytes() for path in sorted(EXAMPLES.glob("*.yaml"))), RARE])
    forms = [form for kind in KINDS for form in kind.forms.split()]
    write("routing", [b"one", b"two"])
    pings = [struct.pack(f"{order}4i", 12, 1, 2, 0) for order in "<>"]
    write(
        "simple_message", [*pings, struct.pack("<15i", 56, 10, 2, 0, *range(11)), pings[0][:9] + b"\xff" * 9 + pings[0]]
    )
    write("connection", [kind.example.encode() for kind in KINDS] + [form.encode() for form in forms])


if __name__ == "__main__":
    main()
