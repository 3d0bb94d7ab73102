"""What we say on the links, under our identity: signed, and recorded, if the configuration says so."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from ..interface import TriState
from ..link.record import TlogWriter
from ..mavlink.component import LONELY_SYSTEM, Component
from .trust import Trust

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ..clock import Instant
    from ..config import Config, SigningConfig
    from ..hardware.tracked import Tracked
    from .station import Channel, Station

log = logging.getLogger(__name__)


class Voice:
    """Our component, the key that it signs with, and the recording of what is said and heard."""

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self.component = Component()
        self.trust: Trust | None = None
        self.recorder: TlogWriter | None = None

    def change(self, config: Config, before: Config) -> None:
        """Speak as this configuration says, where it differs. Raises LinkError, UsageError."""
        if config.identity != before.identity:
            self.component = Component(config.identity.component, config.identity.system)
        if config.signing != before.signing:
            self._secure(config.signing)
        if config.record != before.record:
            self._record(config.record)

    def close(self) -> None:
        """The last call, after everything was said."""
        try:
            self._secure(None)
        finally:
            self._record(None)

    def _secure(self, config: SigningConfig | None) -> None:
        former, self.trust = self.trust, None
        if former is not None:
            former.close()
        self.trust = None if config is None else Trust(config, self._clock())

    def _record(self, path: str | None) -> None:
        former, self.recorder = self.recorder, None
        if former is not None:
            former.close()
        self.recorder = None if path is None else TlogWriter(path)
        if self.recorder is not None:
            log.info("%s", self.recorder.text)

    def tell(self, channel: Channel, message: Any, system: int) -> None:
        """Send one message to one end, under the identity that we have beside this system."""
        self._send(channel, self.component.frame(message, system, channel.encoders))

    def beat(self, channel: Channel, system: int, in_error: bool = False) -> None:
        """Send our heartbeat beside this system to one end."""
        self._send(channel, self.component.heartbeat(system, in_error, channel.encoders))

    def beat_all(self, stations: Iterable[Station], vehicles: Iterable[Tracked]) -> None:
        """Our heartbeat to all: beside each vehicle heard; alone only where we must speak first."""
        in_error: dict[int, bool] = {}
        for tracked in vehicles:
            if tracked.ids is not None:
                system = self.component.system_for(tracked.ids[0])
                in_error[system] = in_error.get(system, False) or tracked.handle.status.in_error is TriState.TRUE
        for station in stations:
            if station.passive or (not in_error and (station.is_out or not station.must_speak)):
                continue
            for channel in station.peers():
                for system, wrong in (in_error or {LONELY_SYSTEM: False}).items():
                    self.beat(channel, system, wrong)

    def _send(self, channel: Channel, frame: bytes) -> None:
        if self.trust is not None or self.recorder is not None:
            unix_us = self._clock().unix_us
            if self.trust is not None:
                frame = self.trust.sign(frame, unix_us, channel.station.number)
            if self.recorder is not None and not channel.passive:
                self.recorder.write(unix_us, frame)
        channel.send(frame)
