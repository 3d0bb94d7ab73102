"""MAVLink 2 signatures: sign our frames, verify received ones. No clock and no file: bytes and times in, values out.

The rules are those of https://mavlink.io/en/guide/message_signing.html. All holders of a key share one time stamp: a
verified stamp later than ours advances ours, however far, and ours never goes back. So a key holder with a wrong clock
advances all others. At the end of the 48 bits (the year 2104) only a new key helps.

A frame has no effect before its signature is verified: a forged frame neither advances the time nor creates a stream.

A signature proves who sent a frame, not when. So after a restart the first frame of each stream must be newer than all
that its sender said before. And the newest stamp of a sender, on any link id, is a clock: it shows how late a frame is.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from enum import IntEnum
from typing import TYPE_CHECKING, Final

from .definitions import CRC_EXTRA
from .encode import with_crc
from .wire import REVERSED, SIGNED, V1, V2

if TYPE_CHECKING:
    from .framing import Frame

KEY_SIZE: Final = 32
UNITS_PER_SECOND: Final = 100_000
"""The unit of a stamp is 10 us."""
EPOCH_US: Final = 1_420_070_400_000_000
"""The epoch of the stamps, 2015-01-01T00:00:00Z, in microseconds since 1970."""
MAX_STAMP: Final = 2**48 - 1
MAX_BEHIND: Final = 60 * UNITS_PER_SECOND
"""How far the first stamp of a stream may be behind ours."""
MAX_STREAMS: Final = 1024
"""The most streams. Only a key holder can create one. Further ones are refused, as by MAVLink's C library."""
SHORTEST: Final = 25
"""Bytes of a signed frame without payload: header 10, CRC 2, signature block 13."""

Stamps = Mapping[tuple[int, int], int]
"""The newest stamp of each sender (system, component)."""
NO_STAMPS: Final[Stamps] = {}

RADIO: Final = frozenset({109, 166})  # RADIO_STATUS, RADIO: sent by a telemetry radio, which has no key
UNSIGNED_IDS: Final[Mapping[str, Container[int]]] = {"none": (), "radio_status": RADIO, "all": range(1 << 24)}
"""The message ids that are accepted without a signature, by the value of the configuration option."""


class Verdict(IntEnum):
    """The result of a `Verifier`."""

    VERIFIED = 0
    LET_THROUGH = 1
    """Unsigned, and its message id is allowed without a signature."""
    UNSIGNED = 2
    FORGED = 3
    """Forged, damaged, or signed with another key: these cannot be distinguished."""
    REPLAYED = 4
    """Replayed, overtaken by a later frame of its stream, or received on two links."""
    STALE = 5
    """A valid signature, but the frame is the first of its stream, and more than a minute behind our stamp, or no newer
    than what its sender said before our start. It is a replay, or of an autopilot that does not know the time, until
    that receives a signed frame of ours."""
    TOO_MANY_STREAMS = 6
    """A valid signature, but MAX_STREAMS streams exist already."""


ACCEPTED: Final = frozenset({Verdict.VERIFIED, Verdict.LET_THROUGH})
WORDS: Final[Mapping[Verdict, str]] = {
    Verdict.VERIFIED: "verified",
    Verdict.LET_THROUGH: "accepted unsigned",
    Verdict.UNSIGNED: "refused unsigned",
    Verdict.FORGED: "forged or signed with another key",
    Verdict.REPLAYED: "replayed or late",
    Verdict.STALE: "first, and behind our time or what was heard before",
    Verdict.TOO_MANY_STREAMS: f"beyond {MAX_STREAMS} streams",
}
"""Texts for the log: `12 verified, 3 refused unsigned`."""


def stamp_at(unix_us: int) -> int:
    """The stamp of a time, from 0 to MAX_STAMP."""
    return min(max((unix_us - EPOCH_US) // 10, 0), MAX_STAMP)


def is_signed(frame: Frame) -> bool:
    """Whether a frame has a signature, valid or not. MAVLink 1 has none."""
    return len(frame.raw) >= SHORTEST and frame.raw[0] != V1 and frame.raw[2] & SIGNED != 0


class Signer:
    """The key and our time stamp. The stamps of the frames that we sign always rise, whatever the clock does."""

    __slots__ = ("_key", "_sha256", "link_id", "stamp")

    def __init__(self, key: bytes, link_id: int, stamp: int = 0) -> None:
        """`stamp` is the last one that was used with this key. Raises ValueError if the key is not KEY_SIZE bytes."""
        if len(key) != KEY_SIZE:
            raise ValueError(f"a signing key has {KEY_SIZE} bytes, not {len(key)}")
        from hashlib import sha256  # three megabytes, which most gateways do not need

        self._key = key
        self._sha256 = sha256
        self.link_id = link_id
        """The link id of our first link."""
        self.stamp = stamp
        """The last stamp that was sent or received. The caller stores it for the next start."""

    def sign(self, frame: bytes, unix_us: int, link: int = 0) -> bytes:
        """The unsigned MAVLink 2 frame `frame` with a signature.

        `link` is 0 for our first link, 1 for the next; the link ids count from `link_id`. If two links had the same id,
        a receiver on both would treat the frames of the slower one as replayed.

        Raises ValueError if the frame is not an unsigned MAVLink 2 frame, and for an unknown message id.
        """
        if len(frame) < 12 or frame[0] != V2 or frame[2] or len(frame) != 12 + frame[1]:
            raise ValueError("only an unsigned MAVLink 2 frame can be signed")
        crc_extra = CRC_EXTRA.get(int.from_bytes(frame[7:10], "little"))
        if crc_extra is None:
            raise ValueError("a frame whose CRC_EXTRA is not known cannot be signed: its CRC changes")
        self.stamp = min(max(stamp_at(unix_us), self.stamp + 1), MAX_STAMP)
        flagged = frame[:2] + bytes((SIGNED,)) + frame[3:-2]
        covered = with_crc(flagged, REVERSED[crc_extra : crc_extra + 1])
        covered += bytes((self.link_id + link & 255,)) + self.stamp.to_bytes(6, "little")
        return covered + self.signature(covered)

    def signature(self, covered: bytes) -> bytes:
        """The signature, six bytes, of a frame whose other bytes are `covered`."""
        return self._sha256(self._key + covered).digest()[:6]


class Verifier:
    """Decides which frames to accept. One verifier serves all links, so a frame cannot be replayed on another."""

    __slots__ = ("_before", "_is_same", "_signer", "_streams", "_unsigned", "counters", "newest")

    def __init__(self, signer: Signer, accept_unsigned: str = "radio_status", before: Stamps = NO_STAMPS) -> None:
        """Shares the signer's key and time stamp. `accept_unsigned` is a key of UNSIGNED_IDS.

        `before` has the `newest` stamps of the run before. Our own stamp is beyond all of them, so that an autopilot
        that takes over our time is newer than before.
        """
        from hmac import compare_digest

        self._is_same = compare_digest
        self._signer = signer
        self._unsigned = UNSIGNED_IDS[accept_unsigned]
        self._streams: dict[bytes, int] = {}  # system, component, link id -> the last stamp
        self._before = dict(before)
        self.newest = dict(before)
        """The newest verified stamp of each sender (system, component), on any link id, in this run or before it."""
        signer.stamp = max(signer.stamp, *before.values(), 0)
        self.counters: dict[Verdict, int] = dict.fromkeys(Verdict, 0)
        """The number of frames for each verdict."""

    def accepts(self, frame: Frame, unix_us: int) -> bool:
        """Whether to accept a frame received at this time, which is counted. Never raises."""
        return self.judge(frame, unix_us) in ACCEPTED

    def judge(self, frame: Frame, unix_us: int) -> Verdict:
        """The same with the reason."""
        verdict = self._verify(frame.raw, unix_us) if is_signed(frame) else self._unsigned_verdict(frame.message_id)
        self.counters[verdict] += 1
        return verdict

    def lag(self, frame: Frame) -> float:
        """Seconds by which a VERIFIED frame is older than the newest one of its sender on any link id. Never below 0.0.

        Call it after `judge`, before the next frame is judged. 0.0 for a frame without a signature, which has no time.
        """
        raw = frame.raw
        if not is_signed(frame):
            return 0.0
        stamp = int.from_bytes(raw[-12:-6], "little")
        return max(0, self.newest.get((raw[5], raw[6]), stamp) - stamp) / UNITS_PER_SECOND

    def signs(self, ids: tuple[int, int]) -> bool:
        """Whether this sender (system, component) was verified since our start."""
        return self.newest.get(ids, -1) > self._before.get(ids, -1)

    def _unsigned_verdict(self, message_id: int) -> Verdict:
        return Verdict.LET_THROUGH if message_id in self._unsigned else Verdict.UNSIGNED

    def _verify(self, raw: bytes, unix_us: int) -> Verdict:
        signer = self._signer
        if not self._is_same(signer.signature(raw[:-6]), raw[-6:]):
            return Verdict.FORGED
        stream, ids = raw[5:7] + raw[-13:-12], (raw[5], raw[6])
        stamp = int.from_bytes(raw[-12:-6], "little")
        last = self._streams.get(stream)
        if last is None:
            if stamp + MAX_BEHIND < max(signer.stamp, stamp_at(unix_us)) or stamp <= self._before.get(ids, -1):
                return Verdict.STALE
            if len(self._streams) >= MAX_STREAMS:
                return Verdict.TOO_MANY_STREAMS
        elif stamp <= last:
            return Verdict.REPLAYED
        self._streams[stream] = stamp
        self.newest[ids] = max(self.newest.get(ids, 0), stamp)
        signer.stamp = max(signer.stamp, stamp)
        return Verdict.VERIFIED
