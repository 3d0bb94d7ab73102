from __future__ import annotations

import random
from binascii import crc_hqx

from pymavlink.generator.mavcrc import x25crc

from mav_robot_status.mavlink.definitions import CRC_EXTRA
from mav_robot_status.mavlink.wire import FORMATS, REVERSED, UNDO, UNKNOWN, V1, V2, known_ids


def test_the_crc_before_its_last_byte_is_pymavlinks() -> None:
    rng = random.Random(1)
    for magic, length in [(V1, 0), (V2, 0), (V1, 6), (V2, 265)]:
        frame = bytes((magic,)) + rng.randbytes(length)
        for extra in range(256):
            crc = int(f"{x25crc(frame[1:] + bytes((extra,))).crc:016b}"[::-1], 2)  # with reversed bits
            before = crc_hqx(frame.translate(REVERSED), FORMATS[magic].seed)
            assert before ^ REVERSED[extra] << 8 == UNDO[crc & 0xFF] ^ crc >> 8


def test_the_keys_of_known_ids_are_their_bytes_in_a_frame_and_only_wanted_ones_are_read() -> None:
    known = known_ids(frozenset({0, 900_000}))
    for message_id, crc_extra in CRC_EXTRA.items():
        effect, known_id, reader = known[V2][message_id.to_bytes(3, "little")]
        assert (effect, known_id) == (REVERSED[crc_extra] << 8, message_id)
        assert (reader is not None) is (message_id == 0)
        if message_id < 256:
            assert known[V1][message_id] is known[V2][message_id.to_bytes(3, "little")]
    strange = set(range(256)) - CRC_EXTRA.keys()
    assert strange
    assert {known[V1].get(message_id, UNKNOWN) for message_id in strange} == {UNKNOWN}
