"""Signatures of MAVLink 2: ours made, those of others verified. No clock, no file: bytes and times in, values out.

The rules are those of https://mavlink.io/en/guide/message_signing.html. All who hold the key share one notion of time:
a verified stamp that is later than ours moves ours on, however far, and it never goes back. So a key holder with
a wrong clock takes all others along; at the end of the 48 bits (the year 2104) only a new key helps.

Nothing is believed of a frame before its signature is verified: a forged one moves no time and stands in no one's way.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from enum import IntEnum
from hashlib import sha256
from hmac import compare_digest
from typing import TYPE_CHECKING, Final

from .definitions import CRC_EXTRA
from .encode import with_crc
from .wire import MIRROR, SIGNED, V1, V2

if TYPE_CHECKING:
    from .framing import Frame

KEY_SIZE: Final = 32
UNITS_PER_SECOND: Final = 100_000
"""A stamp counts 10 us."""
EPOCH_US: Final = 1_420_070_400_000_000
"""Stamps count from 2015-01-01T00:00:00Z: this, in microseconds since 1970."""
MAX_STAMP: Final = 2**48 - 1
MOST_BEHIND: Final = 60 * UNITS_PER_SECOND
"""A new stream may be so far behind our own time stamp."""
MAX_STREAMS: Final = 1024
"""So many streams are known. Only key holders can make one; further ones are refused, as by MAVLink's C library."""
SHORTEST: Final = 25
"""Bytes of a signed frame without payload: header 10, CRC 2, signature block 13."""

RADIO: Final = frozenset({109, 166})  # RADIO_STATUS, RADIO: of a telemetry radio, which has no key
UNSIGNED_IDS: Final[Mapping[str, Container[int]]] = {"none": (), "radio_status": RADIO, "all": range(1 << 24)}
"""By the words of the configuration: the message ids that are accepted without a signature."""


class Verdict(IntEnum):
    """What a `Verifier` finds."""

    VERIFIED = 0
    LET_THROUGH = 1
    """Unsigned, as it may be."""
    UNSIGNED = 2
    FORGED = 3
    """Or damaged, or signed with another key: that cannot be told apart."""
    REPLAYED = 4
    """Or overtaken by a later frame of its stream, or come twice over two ways."""
    STALE = 5
    """With a good signature, but the first of its stream and more than a minute behind our own time stamp. An autopilot
    without the time of day is, until it hears a signed frame of ours."""
    CROWDED = 6
    """With a good signature, but of one stream more than are kept."""


ACCEPTED: Final = frozenset({Verdict.VERIFIED, Verdict.LET_THROUGH})
WORDS: Final[Mapping[Verdict, str]] = {
    Verdict.VERIFIED: "verified",
    Verdict.LET_THROUGH: "accepted unsigned",
    Verdict.UNSIGNED: "refused unsigned",
    Verdict.FORGED: "forged or signed with another key",
    Verdict.REPLAYED: "replayed or late",
    Verdict.STALE: "first and more than a minute behind our time",
    Verdict.CROWDED: f"beyond {MAX_STREAMS} streams",
}
"""For the log: `12 verified, 3 refused unsigned`."""


def stamp_at(unix_us: int) -> int:
    """The time stamp of a moment, from 0 to MAX_STAMP."""
    return min(max((unix_us - EPOCH_US) // 10, 0), MAX_STAMP)


def is_signed(frame: Frame) -> bool:
    """Whether a frame carries a signature, good or bad. MAVLink 1 has none."""
    return len(frame.raw) >= SHORTEST and frame.raw[0] != V1 and frame.raw[2] & SIGNED != 0


class Signer:
    """The key, and our time stamp: every frame of ours has one of its own, whatever the clock does."""

    __slots__ = ("_key", "link_id", "stamp")

    def __init__(self, key: bytes, link_id: int, stamp: int = 0) -> None:
        """`stamp` is the last one ever used with this key. ValueError if the key is not KEY_SIZE bytes."""
        if len(key) != KEY_SIZE:
            raise ValueError(f"a signing key has {KEY_SIZE} bytes, not {len(key)}")
        self._key = key
        self.link_id = link_id
        """Of our first link."""
        self.stamp = stamp
        """The last one used or heard. To be kept for the next start."""

    def sign(self, frame: bytes, unix_us: int, link: int = 0) -> bytes:
        """An unsigned MAVLink 2 frame with a signature. ValueError for anything else, and for an unknown message id.

        `link` is 0 for our first link, 1 for the next: the link ids count on from `link_id`. Who hears us over two
        links would take what comes over the slower one for a replay if they had the same.
        """
        if len(frame) < 12 or frame[0] != V2 or frame[2] or len(frame) != 12 + frame[1]:
            raise ValueError("only an unsigned MAVLink 2 frame can be signed")
        crc_extra = CRC_EXTRA.get(int.from_bytes(frame[7:10], "little"))
        if crc_extra is None:
            raise ValueError("a frame whose CRC_EXTRA is not known cannot be signed: its CRC changes")
        self.stamp = min(max(stamp_at(unix_us), self.stamp + 1), MAX_STAMP)
        flagged = frame[:2] + bytes((SIGNED,)) + frame[3:-2]
        covered = with_crc(flagged, MIRROR[crc_extra : crc_extra + 1])
        covered += bytes((self.link_id + link & 255,)) + self.stamp.to_bytes(6, "little")
        return covered + self.signature(covered)

    def signature(self, covered: bytes) -> bytes:
        """The six bytes that end a frame of which this is the rest."""
        return sha256(self._key + covered).digest()[:6]


class Verifier:
    """Decides which frames to believe. One serves all links, so that what came on one is not replayed on another."""

    __slots__ = ("_signer", "_streams", "_unsigned", "counters")

    def __init__(self, signer: Signer, accept_unsigned: str = "radio_status") -> None:
        """Shares the signer's key and time stamp. `accept_unsigned` is a key of UNSIGNED_IDS."""
        self._signer = signer
        self._unsigned = UNSIGNED_IDS[accept_unsigned]
        self._streams: dict[bytes, int] = {}  # system, component, link id -> the last stamp
        self.counters: dict[Verdict, int] = dict.fromkeys(Verdict, 0)
        """Frames, by what was found."""

    def accepts(self, frame: Frame, unix_us: int) -> bool:
        """Whether to believe a frame that came at this time; counted. Never raises."""
        return self.judge(frame, unix_us) in ACCEPTED

    def judge(self, frame: Frame, unix_us: int) -> Verdict:
        """The same, with what was found."""
        verdict = self._verify(frame.raw, unix_us) if is_signed(frame) else self._unsigned_verdict(frame.message_id)
        self.counters[verdict] += 1
        return verdict

    def _unsigned_verdict(self, message_id: int) -> Verdict:
        return Verdict.LET_THROUGH if message_id in self._unsigned else Verdict.UNSIGNED

    def _verify(self, raw: bytes, unix_us: int) -> Verdict:
        signer = self._signer
        if not compare_digest(signer.signature(raw[:-6]), raw[-6:]):
            return Verdict.FORGED
        stream = raw[5:7] + raw[-13:-12]
        stamp = int.from_bytes(raw[-12:-6], "little")
        last = self._streams.get(stream)
        if last is None:
            if stamp + MOST_BEHIND < max(signer.stamp, stamp_at(unix_us)):
                return Verdict.STALE
            if len(self._streams) >= MAX_STREAMS:
                return Verdict.CROWDED
        elif stamp <= last:
            return Verdict.REPLAYED
        self._streams[stream] = stamp
        signer.stamp = max(signer.stamp, stamp)
        return Verdict.VERIFIED
