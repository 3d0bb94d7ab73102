"""Signing and verifying. Compares with pymavlink in both directions."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.mavlink.definitions import CRC_EXTRA, MESSAGES, Heartbeat, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.mavlink.signing import (
    EPOCH_US,
    MAX_BEHIND,
    MAX_STAMP,
    MAX_STREAMS,
    UNSIGNED_IDS,
    WORDS,
    Signer,
    Verdict,
    Verifier,
    is_signed,
    stamp_at,
)
from tests import pymavlink_dialect

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
NOW = 1_795_200_547_123_456  # us since 1970: 2026
STAMP = stamp_at(NOW)
HEARTBEAT = Heartbeat(4, 2, 3, 209, 4, 3)
MINUTE = 60_000_000  # us


def unsigned(sequence: int = 0, system: int = 1, component: int = 1, version: int = 2) -> bytes:
    return encode(HEARTBEAT, system=system, component=component, sequence=sequence, version=version)


def radio_status(message_id: int = 109) -> Frame:
    return Frame(message_id, (51, 68), 0, None, b"")


def signed(stamp: int, key: bytes = KEY, link_id: int = 0, system: int = 1, component: int = 1) -> bytes:
    """A peer's frame with this stamp."""
    return Signer(key, link_id, stamp - 1).sign(unsigned(system=system, component=component), 0)


def frame_of(data: bytes) -> Frame:
    (frame,) = Parser(CRC_EXTRA).feed(data)
    return frame


def verifier(stamp: int = 0, accept_unsigned: str = "radio_status") -> Verifier:
    return Verifier(Signer(KEY, 192, stamp), accept_unsigned)


def judged(by: Verifier, data: bytes, at: int = NOW) -> Verdict:
    return by.judge(frame_of(data), at)


def found(by: Verifier) -> dict[Verdict, int]:
    return {verdict: number for verdict, number in by.counters.items() if number}


class Pymavlink:
    """pymavlink as the peer."""

    def __init__(self, key: bytes = KEY, stamp: int = STAMP, link_id: int = 3) -> None:
        self.mav: Any = pymavlink_dialect.MAVLink(None, 1, 1)
        self.mav.signing.secret_key = key
        self.mav.signing.sign_outgoing = True
        self.mav.signing.timestamp = stamp
        self.mav.signing.link_id = link_id

    def pack(self, message: Any = None) -> bytes:
        packed: bytes = bytes((message or self.mav.heartbeat_encode(2, 3, 209, 4, 4)).pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256
        return packed

    def accepts(self, data: bytes) -> bool:
        """Whether pymavlink accepts the frame. Raises MAVError with the reason if it has one."""
        return self.mav.parse_char(data) is not None


# signing


def test_a_frame_is_signed_as_pymavlink_signs_it() -> None:
    assert Signer(KEY, 192).sign(unsigned(), NOW) == Pymavlink(link_id=192).pack()


def test_pymavlink_accepts_every_message_that_we_sign() -> None:
    signer, peer = Signer(KEY, 192), Pymavlink()
    for sequence, definition in enumerate(MESSAGES.values()):
        message = definition.type._make(definition.layout.unpack(bytes(range(1, definition.layout.size + 1))))
        frame = encode(message, system=1, component=192, sequence=sequence % 256)
        assert peer.accepts(signer.sign(frame, NOW))


def test_pymavlink_refuses_our_signature_with_another_key() -> None:
    with pytest.raises(pymavlink_dialect.MAVError, match="Invalid signature"):
        Pymavlink().accepts(Signer(OTHER_KEY, 192).sign(unsigned(), NOW))


def test_a_stamp_counts_10_us_from_2015() -> None:
    assert stamp_at(EPOCH_US) == 0
    assert stamp_at(EPOCH_US + 1_000_000) == 100_000
    assert stamp_at(0) == 0
    assert stamp_at(10**18) == MAX_STAMP
    frame = Signer(KEY, 7).sign(unsigned(), NOW)
    assert frame[-13] == 7
    assert int.from_bytes(frame[-12:-6], "little") == (NOW - EPOCH_US) // 10


def test_every_frame_has_a_later_stamp_even_if_the_clock_stops_or_steps_back() -> None:
    signer = Signer(KEY, 192, stamp=5)
    stamps = []
    for at in (NOW, NOW, NOW - 3_600_000_000, 0, -1, NOW + 20):
        stamps.append(int.from_bytes(signer.sign(unsigned(), at)[-12:-6], "little"))
    assert stamps == [STAMP, STAMP + 1, STAMP + 2, STAMP + 3, STAMP + 4, STAMP + 5]
    assert signer.stamp == stamps[-1]


def test_a_frame_that_is_late_on_a_slow_link_is_not_a_replay() -> None:
    signer, peer = Signer(KEY, 255), Pymavlink()
    slow, fast = (signer.sign(unsigned(component=192), NOW, link) for link in (0, 1))
    assert (slow[-13], fast[-13]) == (255, 0)
    assert peer.accepts(fast)
    assert peer.accepts(slow)


def test_a_stored_stamp_is_not_used_again() -> None:
    frame = Signer(KEY, 192, stamp=STAMP + 100).sign(unsigned(), NOW)
    assert int.from_bytes(frame[-12:-6], "little") == STAMP + 101


def test_at_the_last_stamp_signing_continues_with_it() -> None:
    signer = Signer(KEY, 192, stamp=MAX_STAMP)
    assert signer.sign(unsigned(), NOW)[-12:-6] == b"\xff" * 6


@pytest.mark.parametrize(
    "frame",
    [b"", b"\xfd", unsigned(version=1), unsigned()[:-1], unsigned() + b"\0", Signer(KEY, 0).sign(unsigned(), NOW)],
)
def test_only_an_unsigned_mavlink_2_frame_can_be_signed(frame: bytes) -> None:
    with pytest.raises(ValueError, match="only an unsigned MAVLink 2 frame"):
        Signer(KEY, 192).sign(frame, NOW)


def test_a_frame_of_an_unknown_id_cannot_be_signed() -> None:
    with pytest.raises(ValueError, match="CRC_EXTRA"):
        Signer(KEY, 192).sign(bytes([0xFD, 1, 0, 0, 0, 1, 1, 1, 0, 0x7A, 5, 0, 0]), NOW)


def test_a_key_of_another_size_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="32 bytes, not 5"):
        Signer(b"short", 0)


# verifying


def test_frames_of_pymavlink_are_verified() -> None:
    peer, ours = Pymavlink(), verifier()
    for _ in range(300):
        frame = frame_of(peer.pack())
        assert is_signed(frame)
        assert ours.accepts(frame, NOW)
    assert found(ours) == {Verdict.VERIFIED: 300}


def test_our_verifier_accepts_our_signatures() -> None:
    assert judged(verifier(), Signer(KEY, 192).sign(unsigned(), NOW)) is Verdict.VERIFIED


def test_a_signed_frame_of_an_unknown_id_is_verified_too() -> None:
    covered = bytes([0xFD, 0, 1, 0, 0, 1, 1, 1, 0, 0x7A, 0, 0, 3]) + STAMP.to_bytes(6, "little")
    raw = covered + Signer(KEY, 0).signature(covered)
    (frame, _) = Parser(None).feed(raw + unsigned())
    assert verifier().judge(frame, NOW) is Verdict.VERIFIED


def test_a_replayed_frame_is_refused() -> None:
    ours = verifier()
    first, second = signed(STAMP), signed(STAMP + 1)
    assert [judged(ours, data) for data in (first, first, second, first, second)] == [
        Verdict.VERIFIED,
        Verdict.REPLAYED,
        Verdict.VERIFIED,
        Verdict.REPLAYED,
        Verdict.REPLAYED,
    ]
    assert not ours.accepts(frame_of(second), NOW)
    assert found(ours) == {Verdict.VERIFIED: 2, Verdict.REPLAYED: 4}


def test_a_stream_is_a_system_a_component_and_a_link() -> None:
    ours = verifier()
    for link_id, system, component in ((0, 1, 1), (1, 1, 1), (0, 2, 1), (0, 1, 2)):
        data = signed(STAMP, KEY, link_id, system, component)
        assert judged(ours, data) is Verdict.VERIFIED
        assert judged(ours, data) is Verdict.REPLAYED


def test_every_flipped_bit_is_noticed() -> None:
    data = signed(STAMP)
    ours = verifier()
    template = frame_of(data)
    for bit in range(len(data) * 8):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        expected = Verdict.UNSIGNED if bit == 16 else Verdict.FORGED  # the flag of a signed frame
        assert ours.judge(template._replace(raw=bytes(flipped)), NOW) is expected
    assert ours.judge(template, NOW) is Verdict.VERIFIED


@pytest.mark.parametrize("byte", range(-13, 0))
def test_every_byte_of_the_signature_block_counts(byte: int) -> None:
    data = bytearray(signed(STAMP))
    data[byte] ^= 0x01
    assert judged(verifier(), bytes(data)) is Verdict.FORGED


def test_another_key_is_refused() -> None:
    ours = verifier(accept_unsigned="all")
    assert judged(ours, Pymavlink(OTHER_KEY).pack()) is Verdict.FORGED
    assert found(ours) == {Verdict.FORGED: 1}


def test_a_forged_stamp_in_the_far_future_does_not_lock_out_the_real_peer() -> None:
    signer = Signer(KEY, 192)
    ours = Verifier(signer)
    for peer_is_known in (False, True):
        for stamp in (STAMP + 10**9, MAX_STAMP):
            assert judged(ours, signed(stamp, OTHER_KEY)) is Verdict.FORGED
        assert signer.stamp <= STAMP
        assert judged(ours, signed(STAMP + peer_is_known)) is Verdict.VERIFIED
    assert judged(ours, signed(STAMP, system=2)) is Verdict.VERIFIED


def test_a_new_stream_may_be_a_minute_behind_and_no_more() -> None:
    assert judged(verifier(), signed(STAMP - MAX_BEHIND)) is Verdict.VERIFIED
    assert judged(verifier(), signed(STAMP - MAX_BEHIND - 1)) is Verdict.STALE


def test_a_new_stream_is_compared_with_our_stamp_if_that_is_ahead_of_the_clock() -> None:
    assert judged(verifier(STAMP + 1), signed(STAMP - MAX_BEHIND)) is Verdict.STALE


def test_a_known_stream_may_be_far_behind_our_stamp() -> None:
    """An autopilot without the time of day adds one unit for each frame."""
    ours = verifier()
    assert judged(ours, signed(STAMP)) is Verdict.VERIFIED
    assert judged(ours, signed(STAMP + 1), NOW + 60 * MINUTE) is Verdict.VERIFIED


def test_an_autopilot_without_the_time_is_verified_after_it_has_received_our_frame() -> None:
    peer, signer = Pymavlink(stamp=1000), Signer(KEY, 192)
    ours = Verifier(signer)
    assert judged(ours, peer.pack()) is Verdict.STALE
    assert peer.accepts(signer.sign(unsigned(component=192), NOW))
    assert judged(ours, peer.pack()) is Verdict.VERIFIED


def test_a_verified_later_stamp_advances_ours() -> None:
    signer = Signer(KEY, 192)
    assert judged(Verifier(signer), signed(STAMP + 500)) is Verdict.VERIFIED
    assert int.from_bytes(signer.sign(unsigned(), NOW)[-12:-6], "little") == STAMP + 501


def test_an_earlier_stamp_does_not_set_ours_back() -> None:
    signer = Signer(KEY, 192, STAMP + 500)
    assert judged(Verifier(signer), signed(STAMP)) is Verdict.VERIFIED
    assert signer.stamp == STAMP + 500


def test_the_last_stamp_does_not_raise() -> None:
    signer = Signer(KEY, 192)
    ours = Verifier(signer)
    assert judged(ours, signed(MAX_STAMP)) is Verdict.VERIFIED
    assert judged(ours, signed(MAX_STAMP)) is Verdict.REPLAYED
    assert len(signer.sign(unsigned(), NOW)) == len(unsigned()) + 13


def test_streams_beyond_the_limit_are_refused_and_the_known_ones_continue() -> None:
    ours = verifier()
    peers = [(system, component) for system in range(1, 256) for component in range(1, 9)][: MAX_STREAMS + 1]
    verdicts = [judged(ours, signed(STAMP, system=s, component=c)) for s, c in peers]
    assert verdicts == [Verdict.VERIFIED] * MAX_STREAMS + [Verdict.TOO_MANY_STREAMS]
    assert judged(ours, signed(STAMP + 1)) is Verdict.VERIFIED
    assert judged(ours, signed(STAMP, OTHER_KEY, system=254)) is Verdict.FORGED


def test_a_forged_frame_creates_no_stream() -> None:
    ours = verifier()
    for system in range(1, 256):
        for link_id in range(6):
            judged(ours, signed(STAMP, OTHER_KEY, link_id, system))
    assert judged(ours, signed(STAMP)) is Verdict.VERIFIED


# unsigned


@pytest.mark.parametrize(
    ("accept", "heartbeats", "radio"),
    [
        ("none", Verdict.UNSIGNED, Verdict.UNSIGNED),
        ("radio_status", Verdict.UNSIGNED, Verdict.LET_THROUGH),
        ("all", Verdict.LET_THROUGH, Verdict.LET_THROUGH),
    ],
)
def test_unsigned_frames_pass_as_configured(accept: str, heartbeats: Verdict, radio: Verdict) -> None:
    ours = verifier(accept_unsigned=accept)
    assert [judged(ours, unsigned(version=version)) for version in (1, 2)] == [heartbeats] * 2
    (kept,) = Parser(None).feed(unsigned())  # keeps the bytes, signed or not
    assert ours.judge(kept, NOW) is heartbeats
    assert [ours.judge(radio_status(message_id), NOW) for message_id in (109, 166)] == [radio] * 2
    assert ours.accepts(radio_status(), NOW) is (radio is Verdict.LET_THROUGH)
    assert ours.accepts(frame_of(unsigned()), NOW) is (heartbeats is Verdict.LET_THROUGH)


def test_a_radio_status_with_a_bad_signature_is_not_an_unsigned_one() -> None:
    frame = frame_of(signed(STAMP, OTHER_KEY))._replace(message_id=109)
    assert verifier().judge(frame, NOW) is Verdict.FORGED


def test_every_verdict_has_a_text_and_a_counter() -> None:
    assert set(WORDS) == set(Verdict) == set(verifier().counters)
    assert len(set(WORDS.values())) == len(Verdict)


# any input

PIECES = st.one_of(
    st.binary(max_size=40),
    st.builds(signed, st.integers(1, MAX_STAMP), st.sampled_from([KEY, OTHER_KEY]), st.integers(0, 255)),
    st.builds(unsigned, st.integers(0, 255), version=st.sampled_from([1, 2])),
    st.builds(lambda frame, at, byte: frame[:at] + bytes([byte]) + frame[at + 1 :], st.just(signed(STAMP)),
              st.integers(0, 33), st.integers(0, 255)),
)  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(st.lists(PIECES, max_size=8), st.integers(-(2**63), 2**63), st.sampled_from(list(UNSIGNED_IDS)))
def test_no_bytes_raise(pieces: list[bytes], at: int, accept: str) -> None:
    ours = verifier(accept_unsigned=accept)
    for parser in (Parser(None), Parser(CRC_EXTRA)):
        for frame in parser.feed(b"".join(pieces)):
            ours.judge(frame, at)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=300), st.integers(0, 2**24 - 1))
def test_no_frame_raises_or_is_verified_by_chance(raw: bytes, message_id: int) -> None:
    assert verifier().judge(Frame(message_id, (1, 1), 0, None, raw), NOW) is not Verdict.VERIFIED


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(-(2**63), 2**63), st.integers(1, STAMP * 2)), max_size=20))
def test_stamps_rise_for_any_clock_and_any_peer(moments: list[tuple[int, int]]) -> None:
    signer = Signer(KEY, 192)
    ours = Verifier(signer)
    last = 0
    for at, stamp in moments:
        at = min(at, NOW * 2)
        ours.judge(frame_of(signed(stamp)), at)
        stamp = int.from_bytes(signer.sign(unsigned(), at)[-12:-6], "little")
        assert stamp > last
        last = stamp


def test_the_text_of_a_frame_is_covered() -> None:
    text = encode(Statustext(2, b"PreArm: Check mag".ljust(50, b"\0"), 0, 0), system=1, component=1, sequence=0)
    data = Signer(KEY, 0).sign(text, NOW)
    template = frame_of(data)
    changed = data.replace(b"mag", b"gyr")
    assert verifier().judge(template._replace(raw=changed), NOW) is Verdict.FORGED


# after a restart


def restarted(by: Verifier, stamp: int = 0) -> Verifier:
    """The verifier of the next run."""
    return Verifier(Signer(KEY, 192, stamp), before=by.newest)


def test_what_was_recorded_before_a_restart_is_stale_after_it() -> None:
    first = verifier()
    recorded = [signed(STAMP + number, link_id=number % 2) for number in range(6)]
    assert [judged(first, data) for data in recorded] == [Verdict.VERIFIED] * 6
    again = restarted(first)
    assert [judged(again, data) for data in recorded] == [Verdict.STALE] * 6
    assert judged(again, signed(STAMP + 6, link_id=0)) is Verdict.VERIFIED
    assert [judged(again, data) for data in recorded[1::2]] == [Verdict.STALE] * 3  # on the other link id


def test_a_frame_that_was_kept_back_before_a_restart_is_stale_if_its_vehicle_said_more_since() -> None:
    first = verifier()
    kept_back = signed(STAMP + 1, link_id=1)
    judged(first, signed(STAMP + 2, link_id=0))
    assert judged(restarted(first), kept_back) is Verdict.STALE


def test_other_senders_are_not_held_against_the_stamps_of_one() -> None:
    first = verifier()
    judged(first, signed(STAMP + 10))
    again = restarted(first)
    assert judged(again, signed(STAMP + 1, component=2)) is Verdict.VERIFIED
    assert judged(again, signed(STAMP + 1, system=2)) is Verdict.VERIFIED


def test_an_autopilot_that_is_behind_its_last_stamp_is_verified_after_our_frame() -> None:
    first = verifier()
    judged(first, signed(STAMP + MAX_BEHIND))
    ours = Signer(KEY, 192)  # our own file is lost, and the clock stands still
    again = Verifier(ours, before=first.newest)
    assert judged(again, signed(STAMP)) is Verdict.STALE
    ours.sign(unsigned(), NOW)
    assert judged(again, signed(ours.stamp + 1)) is Verdict.VERIFIED


def test_the_newest_stamp_survives_a_run_in_which_its_vehicle_is_silent() -> None:
    first = verifier()
    judged(first, signed(STAMP + 5))
    assert judged(restarted(restarted(first)), signed(STAMP + 5)) is Verdict.STALE


# how late a frame is


def test_a_frame_is_as_late_as_the_newest_one_of_its_sender_on_any_link() -> None:
    by = verifier()
    found = []
    for stamp, link_id in ((1000, 0), (0, 1), (51_000, 0), (50_000, 0), (1001, 1), (51_001, 1)):
        frame = frame_of(signed(STAMP + stamp, link_id=link_id))
        found.append((by.judge(frame, NOW), by.lag(frame)))
    assert found == [
        (Verdict.VERIFIED, 0.0),
        (Verdict.VERIFIED, 0.01),
        (Verdict.VERIFIED, 0.0),
        (Verdict.REPLAYED, 0.01),
        (Verdict.VERIFIED, 0.49999),
        (Verdict.VERIFIED, 0.0),
    ]


def test_each_sender_has_a_clock_of_its_own() -> None:
    by = verifier()
    judged(by, signed(STAMP + 500_000, system=2))
    judged(by, signed(STAMP + 500_000, component=2))
    frame = frame_of(signed(STAMP))
    assert (by.judge(frame, NOW), by.lag(frame)) == (Verdict.VERIFIED, 0.0)


def test_a_forged_frame_makes_no_other_late() -> None:
    by = verifier()
    honest = frame_of(signed(STAMP))
    by.judge(honest, NOW)
    assert judged(by, signed(MAX_STAMP, key=OTHER_KEY, link_id=1)) is Verdict.FORGED
    assert by.lag(honest) == 0.0


def test_a_frame_without_a_signature_has_no_lag() -> None:
    by = verifier(accept_unsigned="all")
    judged(by, signed(STAMP))
    assert by.lag(frame_of(unsigned())) == by.lag(radio_status()) == 0.0


def test_who_signs_is_known_from_the_first_verified_frame_of_this_run_on() -> None:
    first = verifier()
    assert not first.signs((1, 1))
    judged(first, signed(STAMP))
    assert (first.signs((1, 1)), first.signs((1, 2))) == (True, False)
    again = restarted(first)
    judged(again, signed(STAMP))
    assert not again.signs((1, 1))
    judged(again, signed(STAMP + 1))
    assert again.signs((1, 1))
