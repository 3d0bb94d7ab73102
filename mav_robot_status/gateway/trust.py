"""Signing on our links: what we send is signed, what comes in is believed only as the configuration says."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from ..mavlink.signing import WORDS, Signer, Verdict, Verifier
from .keys import StampStore, read_key, stamp_path

if TYPE_CHECKING:
    from ..clock import Instant
    from ..config import SigningConfig
    from ..mavlink.framing import Frame

log = logging.getLogger(__name__)

HEALING_PERIOD: Final = 1.0
"""Seconds between two of our heartbeats to an autopilot whose time stamps are behind."""


class Trust:
    """One key, one stamp and one memory of what was heard for all links: nothing can be replayed on another one."""

    def __init__(self, config: SigningConfig, now: Instant) -> None:
        """Read the key. Raises UsageError if that cannot be had."""
        key = read_key(config.key_file)
        self._store = StampStore(stamp_path(key))
        self._signer = Signer(key, config.link_id, self._store.start(now.unix_us))
        self._verifier = Verifier(self._signer, config.accept_unsigned)
        self._heal_at = -math.inf

    def sign(self, frame: bytes, unix_us: int, link: int) -> bytes:
        """Our frame with a signature; `link` counts our links from 0."""
        return self._signer.sign(frame, unix_us, link)

    def judge(self, frame: Frame, now: Instant) -> Verdict:
        """Whether a frame may be believed; a command only if it is VERIFIED."""
        return self._verifier.judge(frame, now.unix_us)

    def may_heal(self, verdict: Verdict, now: float) -> bool:
        """Whether to answer a heartbeat with one of ours: an autopilot that has lost the time takes it from that.

        ArduPilot's stamps follow GPS time; without it they go on from where they were when it was switched off.
        """
        if verdict is not Verdict.STALE or now - self._heal_at < HEALING_PERIOD:
            return False
        self._heal_at = now
        return True

    def keep(self) -> None:
        """Once a turn: let the stamp be written when it is time."""
        self._store.keep(self._signer.stamp)

    def summary(self) -> str:
        """What came of checking, in words: only what occurred."""
        counters = self._verifier.counters
        return ", ".join(f"{number} {WORDS[verdict]}" for verdict, number in counters.items() if number)

    def close(self) -> None:
        """The last call: write the stamp, say what was counted."""
        self._store.close(self._signer.stamp)
        if found := self.summary():
            log.info("signing: %s", found)
