"""The frames equal those of pymavlink. The golden frames test the encoder, the parser and the decoder."""

from __future__ import annotations

import random
from typing import Any, NamedTuple

import pytest

from mav_robot_status.mavlink.definitions import (
    MESSAGES,
    AvailableModesMonitor,
    CommandLong,
    Definition,
    ExtendedSysState,
    Heartbeat,
    RobotStatus,
    Statustext,
)
from mav_robot_status.mavlink.encode import Encoder, encode
from mav_robot_status.mavlink.framing import Parser
from tests import pymavlink_dialect

GOLDEN = [
    # message, (system, component, sequence, version), frame as packed by pymavlink 2.4.50
    (Heartbeat(4, 2, 3, 209, 4, 3), (1, 1, 0, 2), "fd090000000101000000040000000203d104031583"),
    (Heartbeat(4, 2, 3, 209, 4, 3), (1, 1, 255, 1), "fe09ff010100040000000203d10403b269"),
    (
        Statustext(2, b"PreArm: Check mag field".ljust(50, b"\0"), 0, 0),
        (7, 1, 200, 2),
        "fd180000c80701fd00000250726541726d3a20436865636b206d6167206669656c642c0d",
    ),
    (ExtendedSysState(0, 0), (1, 1, 3, 2), "fd010000030101f50000007caa"),
    (
        RobotStatus(1795200547123456, -3, 0x1001, 1, 1, 2, -1, 1, 0, -1, 1),
        (1, 191, 17, 2),
        "fd1800001101bffce9000071e9b2b9600600fdffffff01100000010102ff0100ff013f5d",
    ),
    (
        CommandLong(400.0, -1.5, 0.0, 0.0, 0.0, 0.0, 1.0, 511, 1, 1, 0),
        (255, 190, 128, 1),
        "fe2180ffbe4c0000c8430000c0bf000000000000000000000000000000000000803fff010101007f0b",
    ),
]
EVERY_MESSAGE = pytest.mark.parametrize("definition", MESSAGES.values(), ids=lambda d: d.name)


@pytest.mark.parametrize(("message", "header", "wire"), GOLDEN, ids=lambda v: type(v).__name__)
def test_golden_frames_are_encoded_and_parsed(message: Any, header: tuple[int, int, int, int], wire: str) -> None:
    system, component, sequence, version = header
    data = bytes.fromhex(wire)
    assert encode(message, system=system, component=component, sequence=sequence, version=version) == data
    (frame,) = Parser(None).feed(data)
    assert (*frame.ids, frame.sequence) == header[:3]
    assert (frame.message, frame.raw) == (message, data)


@EVERY_MESSAGE
def test_pymavlink_writes_the_same_bytes(definition: Definition) -> None:
    rng = random.Random(definition.id)
    for version in (1, 2) if definition.id < 256 else (2,):
        for sequence in range(50):
            body = bytes(rng.choice((0, rng.randrange(256))) for _ in range(definition.layout.size))
            message = definition.type._make(definition.layout.unpack(body))
            frame = encode(message, system=9, component=190, sequence=sequence, version=version)
            mav = pymavlink_dialect.MAVLink(None, 9, 190)
            mav.seq = sequence
            theirs = mav.parse_char(frame)
            assert theirs
            assert theirs.get_type() == definition.name
            assert theirs.pack(mav, force_mavlink1=version == 1) == frame


def test_trailing_zeros_are_removed_but_one_byte_stays() -> None:
    assert encode(AvailableModesMonitor(0), system=1, component=1, sequence=0)[1] == 1
    assert encode(ExtendedSysState(0, 0), system=1, component=1, sequence=0)[1] == 1
    assert encode(ExtendedSysState(5, 0), system=1, component=1, sequence=0)[1] == 1
    assert encode(ExtendedSysState(0, 5), system=1, component=1, sequence=0)[1] == 2


def test_an_encoder_numbers_its_frames() -> None:
    encoder = Encoder(1, 191)
    frames = Parser(MESSAGES).feed(b"".join(encoder.frame(AvailableModesMonitor(1)) for _ in range(258)))
    assert [f.sequence for f in frames] == [*range(256), 0, 1]
    assert {f.ids for f in frames} == {(1, 191)}


class NoMessage(NamedTuple):
    value: int


@pytest.mark.parametrize(
    ("message", "options", "what"),
    [
        (NoMessage(1), {}, "NoMessage is not a message"),
        (ExtendedSysState(256, 0), {}, "vtol_state=256.*does not fit"),
        (ExtendedSysState("1", 0), {}, "does not fit"),  # type: ignore[arg-type]
        (CommandLong(1e300, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), {}, "param1=1e\\+300.*does not fit"),
        (AvailableModesMonitor(1), {"version": 1}, "MAVLink 1"),
        (ExtendedSysState(0, 0), {"system": 256}, "system 256"),
        (ExtendedSysState(0, 0), {"sequence": -1}, "sequence -1"),
    ],
)
def test_an_invalid_argument_is_a_value_error(message: Any, options: dict[str, int], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        encode(message, **{"system": 1, "component": 1, "sequence": 0, **options})


def test_a_failed_encode_uses_no_sequence_number() -> None:
    encoder = Encoder(1, 1)
    with pytest.raises(ValueError):
        encoder.frame(ExtendedSysState(-1, 0))
    assert encoder.sequence == 0
