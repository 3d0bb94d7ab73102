"""Signing on our links: signs what we send, and decides which received frames are accepted."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from ...mavlink.signing import WORDS, Signer, Verdict, Verifier, is_signed

if TYPE_CHECKING:
    from ...clock import Instant
    from ...config import SigningConfig
    from ...mavlink.framing import Frame

log = logging.getLogger(__name__)

HEALING_PERIOD: Final = 1.0
"""Seconds between two of our heartbeats to an autopilot whose time stamps are behind."""


class SigningPolicy:
    """One key, time stamp and list of streams for all links, so that no frame can be replayed on another link."""

    def __init__(self, config: SigningConfig, now: Instant) -> None:
        """Read the key. Raises UsageError if it cannot be read."""
        from .signing_keys import HeardStore, StampStore, read_key, stamp_path

        key = read_key(config.key_file)
        path = stamp_path(key)
        self._store, self._heard = StampStore(path), HeardStore(path.with_suffix(".heard"))
        self._signer = Signer(key, config.link_id, self._store.start(now.unix_us))
        self._verifier = Verifier(self._signer, config.accept_unsigned, self._heard.start())
        self._accepts_all = config.accept_unsigned == "all"
        self._heal_at = -math.inf

    def sign(self, frame: bytes, unix_us: int, link: int) -> bytes:
        """Our frame with a signature. `link` is the number of the link, from 0."""
        return self._signer.sign(frame, unix_us, link)

    def judge(self, frame: Frame, now: Instant) -> Verdict:
        """The verdict on a received frame. A command needs VERIFIED."""
        return self._verifier.judge(frame, now.unix_us)

    def lag(self, frame: Frame) -> float:
        """Seconds by which a VERIFIED frame is late, see `Verifier.lag`. Call it after `judge`, before the next one."""
        return self._verifier.lag(frame)

    def may_speak(self, frame: Frame) -> bool:
        """Whether a frame that was accepted may speak for the vehicle with its ids.

        A verified one may. An unsigned one may if the configuration accepts all, and no frame of these ids was verified
        since the start: what a radio may send unsigned says nothing about a vehicle.
        """
        return is_signed(frame) or (self._accepts_all and not self._verifier.signs(frame.ids))

    def may_heal(self, verdict: Verdict, now: float) -> bool:
        """Whether to answer a heartbeat with ours, from which an autopilot with an old time stamp sets its own.

        ArduPilot's time stamps follow GPS time. Without GPS they continue from the last one before power-off.
        """
        if verdict is not Verdict.STALE or now - self._heal_at < HEALING_PERIOD:
            return False
        self._heal_at = now
        return True

    def keep(self, now: float) -> None:
        """Write the time stamps to disk if they are due. Called in every turn; `now` is monotonic seconds."""
        self._store.keep(self._signer.stamp)
        self._heard.keep(self._verifier.newest, now)

    def summary(self) -> str:
        """The verdicts that occurred, with their counts, as text."""
        counters = self._verifier.counters
        return ", ".join(f"{number} {WORDS[verdict]}" for verdict, number in counters.items() if number)

    def close(self) -> None:
        """The last call: write the time stamps, log the counters."""
        self._store.close(self._signer.stamp)
        self._heard.close(self._verifier.newest)
        if found := self.summary():
            log.info("signing: %s", found)


def proof(accepted: Frame) -> Verdict:
    """The verdict on a frame that was accepted: VERIFIED or LET_THROUGH."""
    return Verdict.VERIFIED if is_signed(accepted) else Verdict.LET_THROUGH
