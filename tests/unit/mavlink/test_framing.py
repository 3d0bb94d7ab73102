"""Frames out of bytes: whole, cut, damaged, foreign and hostile. Compares with pymavlink."""

from __future__ import annotations

import itertools
import pathlib
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega

from fuzz.work import RANDOM, SHAPES, SIZE, checks, cut
from mav_robot_status.mavlink.counters import MAX_IDS, OTHER_IDS, Counters
from mav_robot_status.mavlink.definitions import CRC_EXTRA, MESSAGES, Attitude, Heartbeat, Statustext
from mav_robot_status.mavlink.encode import Encoder, encode
from mav_robot_status.mavlink.framing import MAX_SOURCES, Frame, Parser
from mav_robot_status.mavlink.wire import MAX_FRAME
from tests import pymavlink_dialect

RECORDINGS = sorted((pathlib.Path(__file__).parents[2] / "recorded" / "logs").glob("*.tlog"))
HEARTBEAT = Heartbeat(custom_mode=4, type=2, autopilot=3, base_mode=209, system_status=4, mavlink_version=3)
ATTITUDE = Attitude(1, 5.0, 6.0, 7.0)
START = 1_700_000_000_000_000
UNKNOWN_ID = 0x7A0001


def heartbeat(sequence: int = 0, system: int = 1, component: int = 1, version: int = 2) -> bytes:
    return encode(HEARTBEAT, system=system, component=component, sequence=sequence, version=version)


def unknown_frame(payload: bytes = b"abc", sequence: int = 0) -> bytes:
    header = bytes([0xFD, len(payload), 0, 0, sequence, 1, 1]) + UNKNOWN_ID.to_bytes(3, "little")
    return header + payload + b"\x01\x02"


def random_stream(seed: int, length: int) -> list[bytes]:
    """Frames of every message we use, in both versions, with random fields."""
    rng = random.Random(seed)
    frames = []
    for sequence in range(length):
        d = rng.choice(list(MESSAGES.values()))
        body = bytes(rng.choice((0, rng.randrange(256))) for _ in range(d.layout.size))
        message = d.type._make(d.layout.unpack(body))
        version = rng.choice((1, 2)) if d.id < 256 else 2
        frames.append(encode(message, system=1, component=1, sequence=sequence % 256, version=version))
    return frames


STREAM = random_stream(1, 60)


def feed(*pieces: bytes) -> tuple[list[Frame], Counters]:
    parser = Parser(CRC_EXTRA)
    return [frame for piece in pieces for frame in parser.feed(piece)], parser.counters


def known_frames(data: bytes) -> list[tuple[Any, ...]]:
    """The same for our parser."""
    frames = [frame for frame in Parser(None).feed(data) if frame.message_id in CRC_EXTRA]
    return [(f.message_id, *f.ids, f.sequence, f.payload) for f in frames]


def pymavlink_frames(data: bytes, dialect: Any = ardupilotmega) -> list[tuple[Any, ...]]:
    """The frames of known ids that pymavlink accepts in these bytes."""
    mav = dialect.MAVLink(None)
    mav.robust_parsing = True
    accepted = []
    for m in mav.parse_buffer(data) or []:
        if m.get_msgId() in dialect.mavlink_map:
            wire = m.get_msgbuf()
            start = 10 if wire[0] == 0xFD else 6
            payload = bytes(wire[start : start + wire[1]])
            accepted.append((m.get_msgId(), m.get_srcSystem(), m.get_srcComponent(), m.get_seq(), payload))
    return accepted


def test_a_frame_is_cut_into_its_parts() -> None:
    data = heartbeat(sequence=7, system=3, component=100)
    (frame,), counters = feed(data)
    assert frame == Frame(0, (3, 100), 7, HEARTBEAT, data)
    assert counters == Counters(frames=1)


def test_mavlink_1_is_understood_and_counted() -> None:
    data = heartbeat(sequence=7, system=3, component=100, version=1)
    (frame,), counters = feed(data)
    assert frame == Frame(0, (3, 100), 7, HEARTBEAT, data)
    assert counters == Counters(frames=1, frames_v1=1)


def test_all_frames_are_returned_and_only_wanted_ones_are_decoded() -> None:
    parser = Parser({0})
    encoder = Encoder(1, 1)
    frames = parser.feed(encoder.frame(ATTITUDE) + encoder.frame(HEARTBEAT) + encoder.frame(ATTITUDE))
    assert [(f.message_id, f.sequence, f.message) for f in frames] == [(30, 0, None), (0, 1, HEARTBEAT), (30, 2, None)]
    assert parser.counters == Counters(frames=3)


@pytest.mark.parametrize("seed", range(20))
def test_pymavlink_reads_the_same_frames(seed: int) -> None:
    data = b"".join(random_stream(seed, 300))
    frames, counters = feed(data)
    assert known_frames(data) == pymavlink_frames(data, pymavlink_dialect)
    assert counters.frames == len(frames) == 300
    assert counters.lost == counters.garbage_bytes == 0


def test_pymavlink_reads_the_same_frames_of_a_full_dialect() -> None:
    rng = random.Random(2)
    mav = ardupilotmega.MAVLink(None, 1, 1)
    data = b""
    for message_id, kind in ardupilotmega.mavlink_map.items():
        message = ardupilotmega.MAVLink_message(message_id, kind.msgname)
        v1 = message_id < 256 and rng.random() < 0.5
        data += message._pack(mav, kind.crc_extra, rng.randbytes(kind.unpacker.size), force_mavlink1=v1)
        mav.seq = (mav.seq + 1) % 256
    _, counters = feed(data)
    assert known_frames(data) == pymavlink_frames(data)
    assert counters.frames == len(ardupilotmega.mavlink_map)
    assert not counters.bad_crc
    assert not counters.unknown


@pytest.mark.parametrize("path", RECORDINGS[::3], ids=lambda p: p.stem)
def test_pymavlink_reads_the_same_frames_of_a_recording(path: pathlib.Path) -> None:
    log = path.read_bytes()[:300_000]
    data, at = b"", 0
    while at < len(log):  # a record is eight bytes of time and one frame
        head = log[at + 8 : at + 11]
        size = head[1] + (8 if head[0] == 0xFE else 25 if head[2] & 1 else 12) if len(head) == 3 else len(log)
        data += log[at + 8 : at + 8 + size]
        at += 8 + size
    theirs = pymavlink_frames(data)
    assert len(theirs) > 50
    for source in (data, log):  # in the second the time stamps are garbage between the frames
        assert [frame for frame in known_frames(source) if frame[0] in ardupilotmega.mavlink_map] == theirs


def missing(expected: list[tuple[Any, ...]], got: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    """The frames that are missing in `got`, in order."""
    rest = iter(got)
    return [frame for frame in expected if frame not in rest]


@given(st.lists(st.integers(0, sum(map(len, STREAM))), max_size=30))
def test_any_cut_of_the_bytes_gives_the_same_frames(cuts: list[int]) -> None:
    data = b"noise" + b"".join(STREAM)
    edges = [0, *sorted(cuts), len(data)]
    frames, counters = feed(*(data[a:b] for a, b in itertools.pairwise(edges)))
    assert (frames, counters) == feed(data)
    assert len(frames) == len(STREAM)


@pytest.mark.parametrize("seed", range(100))
def test_any_cut_of_damaged_bytes_gives_the_same_frames_but_for_one_at_most(seed: int) -> None:
    # The parser drops a damaged frame as soon as the next one starts behind it, so that the next one is not delayed. If
    # the bytes end there, the parser misses a frame that overlaps both.
    data = damaged(random.Random(seed)) + heartbeat() * 2
    whole, _ = feed(data)
    for step in (1, 2, 7, 50):
        cut, _ = feed(*(data[i : i + step] for i in range(0, len(data), step)))
        assert len(set(cut) ^ set(whole)) <= 2


@given(st.lists(st.binary(max_size=40).map(lambda b: b.replace(b"\xfd", b"").replace(b"\xfe", b"")), min_size=61))
def test_garbage_before_between_and_after_is_counted(garbage: list[bytes]) -> None:
    data = garbage[0] + b"".join(frame + noise for frame, noise in zip(STREAM, garbage[1:], strict=False))
    frames, counters = feed(data)
    assert len(frames) == len(STREAM)
    assert counters.garbage_bytes == sum(map(len, garbage[:61]))
    assert counters.bad_crc == counters.unknown == {}


@pytest.mark.parametrize("magic", [b"\xfd", b"\xfe"])
def test_a_stray_magic_byte_delays_frames_but_loses_none(magic: bytes) -> None:
    frames, _ = feed(STREAM[0] + magic, *STREAM[1:])
    assert len(frames) == len(STREAM)


def test_after_noise_a_header_with_a_large_length_delays_no_valid_frame() -> None:
    pieces = b"noise\xfe\xff\0\0\0\0", heartbeat(1), heartbeat(2)
    parser = Parser({0})
    assert [[f.sequence for f in parser.feed(piece)] for piece in pieces] == [[], [1], [2]]


def damaged(rng: random.Random) -> bytes:
    """The stream with flipped, missing and duplicate bytes. Its end is intact, so no bytes wait."""
    data = bytearray(b"".join(STREAM))
    for _ in range(rng.randrange(1, 12)):
        at = rng.randrange(len(data))
        kind = rng.randrange(3)
        if kind == 0:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.randrange(1, 20)]
        else:
            data[at:at] = rng.randbytes(rng.randrange(1, 20))
    return bytes(data) + b"".join(heartbeat(i) for i in range(20))


@pytest.mark.parametrize("seed", range(300))
def test_what_pymavlink_accepts_of_damaged_bytes_is_accepted(seed: int) -> None:
    data = damaged(random.Random(seed))
    ours = known_frames(data)
    assert not missing(pymavlink_frames(data, pymavlink_dialect), ours)


def test_a_wrong_length_byte_hides_no_valid_frames_where_pymavlink_loses_them() -> None:
    broken = bytearray(heartbeat(0))
    broken[1] = 200
    data = bytes(broken) + b"".join(heartbeat(i) for i in range(1, 21))
    frames, counters = feed(data)
    assert [f.sequence for f in frames] == list(range(1, 21))
    assert counters.bad_crc == {0: 1}
    assert len(pymavlink_frames(data)) < 15


@pytest.mark.parametrize("step", [1, 2, 3, 10_000])
@pytest.mark.parametrize("length", [*range(60), 93, 100, 255])
def test_no_length_byte_hides_valid_frames_for_any_read_size(length: int, step: int) -> None:
    broken = bytearray(heartbeat(0))
    broken[1] = length
    data = bytes(broken) + b"".join(heartbeat(i) for i in range(1, 21))
    frames, counters = feed(*(data[i : i + step] for i in range(0, len(data), step)))
    assert [f.sequence for f in frames if f.sequence] == list(range(1, 21))
    assert counters.bad_crc == ({} if length == 9 else {0: 1})


def test_frames_of_another_definition_count_once_each_even_if_they_look_full_of_frames() -> None:
    frame = bytearray(encode(Statustext(6, bytes([0xFE, 0xFD] * 25), 1, 1), system=1, component=1, sequence=0))
    frame[-1] ^= 0x55
    frames, counters = feed(*[bytes(frame)] * 100, heartbeat())
    assert len(frames) == 1
    assert counters.bad_crc == {253: 100}
    assert counters.garbage_bytes == 0


def test_unknown_ids_are_skipped_whole_and_counted() -> None:
    hidden = heartbeat(9)
    frames, counters = feed(unknown_frame(hidden, 0) + heartbeat(1), unknown_frame(b"end of the data", 2))
    assert [(f.sequence, f.message is None) for f in frames] == [(0, True), (1, False), (2, True)]
    assert counters == Counters(frames=1, unknown={UNKNOWN_ID: 2})


def test_an_unknown_id_without_a_following_frame_is_searched() -> None:
    frames, counters = feed(unknown_frame(b"12" + heartbeat(1) + b"34") + b"garbage" + heartbeat(2))
    assert [f.sequence for f in frames] == [1, 2]
    assert counters.unknown == {}


def test_signed_frames_have_their_signature_block() -> None:
    mav = pymavlink_dialect.MAVLink(None, 5, 6)
    mav.signing.secret_key = bytes(range(32))
    mav.signing.sign_outgoing = True
    mav.signing.link_id = 3
    mav.signing.timestamp = 1234567890
    packed = mav.heartbeat_encode(2, 3, 209, 4, 4).pack(mav)
    unsigned = heartbeat()
    (frame, following), counters = feed(packed + unsigned)
    assert frame.raw == packed
    assert frame.raw[-13] == 3
    assert frame.message == following.message
    assert following.raw == unsigned
    assert counters == Counters(frames=2, signed=1)


def test_a_parser_that_keeps_everything_returns_each_frame_unchanged_also_unknown_ones() -> None:
    attitude = encode(ATTITUDE, system=7, component=1, sequence=4, version=1)
    stream = [heartbeat(3), unknown_frame(b"abc", 4), attitude, unknown_frame(bytes(40), 5), heartbeat(6)]
    parser = Parser(None)
    frames = parser.feed(b"".join(stream))
    assert [frame.raw for frame in frames] == stream
    assert [frame.message_id for frame in frames] == [0, UNKNOWN_ID, 30, UNKNOWN_ID, 0]
    assert (*frames[1].ids, frames[1].sequence, frames[1].payload) == (1, 1, 4, b"abc")
    assert parser.counters == Counters(frames=3, frames_v1=1, unknown={UNKNOWN_ID: 2})


def test_an_unknown_frame_of_mavlink_1_is_kept_with_the_ids_of_its_header() -> None:
    unknown = bytes([0xFE, 2, 9, 5, 6, 244, 1, 2, 3, 4])  # 244 is known; 237 is not
    unknown = bytes([0xFE, 2, 9, 5, 6, 10, 1, 2, 3, 4])
    (frame, _) = Parser(None).feed(unknown + heartbeat())
    assert frame == Frame(10, (5, 6), 9, None, unknown)
    assert frame.payload == b"\x01\x02"


def test_unknown_incompatibility_flags_are_counted_and_the_frame_is_not_delivered() -> None:
    mav = pymavlink_dialect.MAVLink(None, 1, 1)
    body = (
        b"\x09\x02\x00\x00\x01\x01\x00\x00\x00" + HEARTBEAT.custom_mode.to_bytes(4, "little") + b"\x02\x03\xd1\x04\x03"
    )
    crc = pymavlink_dialect.x25crc(body + bytes([CRC_EXTRA[0]])).crc
    assert mav.parse_buffer(heartbeat())  # pymavlink accepts the frame before the change
    frames, counters = feed(b"\xfd" + body + crc.to_bytes(2, "little") + heartbeat(1))
    assert [f.sequence for f in frames] == [1]
    assert counters == Counters(frames=1, incompatible=1)


@pytest.mark.parametrize(
    ("sequences", "lost"),
    [
        ([0, 1, 2, 3], 0),
        ([254, 255, 0, 1], 0),
        ([5, 7, 10], 3),
        ([250, 2], 7),
        ([5, 5, 6, 6, 7], 0),
        ([5, 7, 6, 8], 1),
        ([200, 0, 1], 55),
        ([16, 0, 1], 239),
        ([16, 1, 17], 0),
        ([0, 240, 241], 239),
        ([0, 241, 1], 0),
        ([0, 250, 1], 0),
    ],
)
def test_lost_frames_are_counted_from_the_sequence(sequences: list[int], lost: int) -> None:
    _, counters = feed(*(heartbeat(s) for s in sequences))
    assert counters.lost == lost


def test_each_source_has_a_sequence_of_its_own() -> None:
    _, counters = feed(*(heartbeat(s, component=c) for s in range(5) for c in range(1, 4)))
    assert counters.lost == 0


def test_damaged_and_unknown_frames_do_not_count_as_lost() -> None:
    bad = bytearray(heartbeat(1))
    bad[-1] ^= 1
    _, counters = feed(heartbeat(0), bytes(bad), unknown_frame(sequence=2), heartbeat(3))
    assert counters == Counters(frames=2, bad_crc={0: 1}, unknown={UNKNOWN_ID: 1})


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("joined", [True, False])
def test_a_damaged_sequence_number_does_not_count_as_lost_frames(version: int, joined: bool) -> None:
    bad = bytearray(heartbeat(77, version=version))
    bad[-1] ^= 1
    pieces = heartbeat(0), bytes(bad), unknown_frame(sequence=140), heartbeat(1), heartbeat(2)
    _, counters = feed(b"".join(pieces)) if joined else feed(*pieces)
    assert counters == Counters(frames=3, bad_crc={0: 1}, unknown={UNKNOWN_ID: 1})


def test_a_frame_that_fails_its_check_does_not_start_the_count_of_its_source() -> None:
    bad = bytearray(heartbeat(5))
    bad[-1] ^= 1
    _, counters = feed(bytes(bad), unknown_frame(sequence=90), heartbeat(9))
    assert counters.lost == 0


def test_the_number_of_checked_sources_is_bounded() -> None:
    parser = Parser(())
    for sequence in (0, 2):
        for system in range(256):
            for component in range(8):
                parser.feed(heartbeat(sequence, system, component))
    assert parser.counters.frames == 4096
    assert parser.counters.lost == MAX_SOURCES


def test_the_number_of_ids_counted_is_bounded() -> None:
    parser = Parser(())
    for number in range(1000):
        message_id = (900_000 + number).to_bytes(3, "little")
        parser.feed(b"\xfd\x01\0\0\0\x01\x01" + message_id + b"\0\0\0")
    assert len(parser.counters.unknown) == MAX_IDS + 1
    assert parser.counters.unknown[OTHER_IDS] == 1000 - MAX_IDS


def test_a_reset_drops_an_incomplete_frame() -> None:
    parser = Parser({0})
    parser.feed(heartbeat()[:10])
    parser.reset()
    assert [f.sequence for f in parser.feed(heartbeat(1))] == [1]
    assert parser.counters.garbage_bytes == 10


def test_a_reset_starts_in_sync() -> None:
    parser = Parser({0})
    parser.feed(b"noise")
    parser.reset()
    parser.feed(unknown_frame() + heartbeat(1))
    assert parser.counters.unknown == {UNKNOWN_ID: 1}


def test_the_frames_of_a_log_have_their_stamps() -> None:
    data = b"".join((START + n).to_bytes(8, "big") + heartbeat(n) for n in range(5))
    frames = Parser({0}, stamped=True).feed(data)
    assert [frame.stamp for frame in frames] == list(range(START, START + 5))


hostile = st.lists(
    st.one_of(
        st.binary(max_size=300),
        st.sampled_from([b"\xfd", b"\xfe", b"\xfd" * 300, b"\xfe" * 300, b"\xfd\xff\x01", b"\xfe\xff\0\0\0\0"]),
        st.sampled_from(STREAM).flatmap(lambda f: st.integers(0, len(f)).map(lambda n: f[:n])),
    ),
    max_size=20,
)


@settings(max_examples=300)
@given(hostile)
def test_any_bytes_do_not_raise_and_few_are_kept(pieces: list[bytes]) -> None:
    parser = Parser(CRC_EXTRA)
    for piece in pieces:
        parser.feed(piece)
        assert len(parser._tail) <= MAX_FRAME


@given(hostile)
def test_after_any_noise_frames_are_parsed_again(pieces: list[bytes]) -> None:
    parser = Parser({0})
    for piece in pieces:
        parser.feed(piece)
    # the noise may end in a header that claims one frame's length at most, or in one whole skipped frame
    frames = [f for i in range(30) for f in parser.feed(heartbeat(i))]
    assert [f.sequence for f in frames][-1] == 29


@pytest.mark.parametrize("piece", [SIZE, 280, 97, 1])
@pytest.mark.parametrize("name", SHAPES)
def test_bytes_that_look_like_starts_of_frames_cost_few_checks(name: str, piece: int) -> None:
    data = SHAPES[name][: 200 * piece]
    number, total = checks(cut(data, piece))
    assert number <= len(data) / 4 + 100
    assert total <= 32 * len(data) + 280 * 100


def test_a_stream_in_small_pieces_is_not_searched_again_with_each_piece() -> None:
    data = RANDOM[:20_000]
    whole, _ = checks([data])
    for piece in (1, 7, 50):
        number, _ = checks(cut(data, piece))
        assert number <= 3 * whole + 10


def test_a_valid_frame_behind_any_flood_is_found() -> None:
    for name, data in SHAPES.items():
        for size in (300, 5000, SIZE):
            # the flood may end in a header that claims one frame's length at most
            frames, _ = feed(data[:size], *(heartbeat(i) for i in range(30)))
            assert [frame.sequence for frame in frames][-10:] == list(range(20, 30)), name


def test_a_damaged_frame_full_of_magic_bytes_hides_no_frame() -> None:
    for magic in (b"\xfe", b"\xfd", b"\xfe\xfd", b"\xfd\0"):
        broken = bytearray(encode(Statustext(6, (magic * 50)[:50], 1, 1), system=1, component=1, sequence=0))
        broken[-1] ^= 0x55
        frames, _ = feed(*STREAM, bytes(broken) + heartbeat(1), bytes(broken[3:]) + heartbeat(2), heartbeat(3))
        assert [frame.sequence for frame in frames[-3:]] == [1, 2, 3]
