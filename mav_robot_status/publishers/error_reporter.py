"""Log messages for an output whose other end fails: each reason once, and one message when it works again."""

from __future__ import annotations

import logging

log = logging.getLogger(__name__)


class ErrorReporter:
    """Logs each reason once for all connections of an output, until one of them is steady again."""

    def __init__(self, output: str, peer: str) -> None:
        """`output` is the type of the publisher, `peer` the other end in words."""
        self._output, self._peer = output, peer
        self._logged: set[str] = set()
        self._worked = False

    def fails(self, reason: str) -> None:
        """A connection has failed: log the reason once."""
        if reason not in self._logged:
            self._logged.add(reason)
            log.warning("%s: %s: %s; trying again", self._output, self._peer, reason)

    def opens(self) -> None:
        """A connection is open: log the first one, unless an error was logged before."""
        if not (self._logged or self._worked):
            log.info("%s: %s: connected", self._output, self._peer)
        self._worked = True

    def holds(self) -> None:
        """A connection is steady: log it, and log later errors again."""
        if self._logged:
            log.warning("%s: %s: connected again", self._output, self._peer)
            self._logged.clear()
