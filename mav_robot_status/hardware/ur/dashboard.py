"""The dashboard server of Universal Robots: lines of text. Only the operational mode is asked for.

Source: Universal Robots, "Dashboard Server, e-Series". Before version 5.6 the question is unknown, and PolyScope X has
no dashboard server: then the operational mode is not known.
"""

from __future__ import annotations

from typing import Final

QUESTION: Final = b"get operational mode\n"
PERIOD: Final = 1.0
"""Seconds between two questions."""
VALID: Final = 3.0
"""Seconds for which an answer is valid."""
MODES: Final = frozenset({"MANUAL", "AUTOMATIC"})
"""The answers with a meaning. NONE: no mode is set up."""
MOST_LINE: Final = 1000


class Dashboard:
    """One connection, as a pure protocol machine. Times are monotonic seconds."""

    def __init__(self) -> None:
        self.ask_at = float("-inf")
        """When the next question is due."""
        self._mode: str | None = None
        self._heard_at = float("-inf")
        self._rest = b""

    def mode(self, now: float) -> str | None:
        """The operational mode; None if it is not known."""
        return self._mode if now - self._heard_at <= VALID else None

    def ask(self, now: float) -> bytes:
        """The question that is due, or nothing."""
        if now < self.ask_at:
            return b""
        self.ask_at = now + PERIOD
        return QUESTION

    def feed(self, data: bytes, now: float) -> None:
        """Process received bytes. Lines that are not an operational mode are ignored."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-MOST_LINE:]
        for line in lines:
            word = line.strip().decode("ascii", "replace").upper()
            if word in MODES or word == "NONE":
                self._mode, self._heard_at = word if word in MODES else None, now
