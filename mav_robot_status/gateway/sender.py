"""Sends frames with our ids. Signs and records them if configured."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from ..interface import TriState
from ..links.record import TlogWriter
from ..mavlink.component import DEFAULT_SYSTEM, Component
from .signing_policy import SigningPolicy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ..clock import Instant
    from ..config import Config, SigningConfig
    from ..hardware.mavlink.vehicle import TrackedVehicle
    from .endpoint import Channel, Endpoint

log = logging.getLogger(__name__)


class Sender:
    """Our component, its signing key, and the recording of all frames."""

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self.component = Component()
        self.signing_policy: SigningPolicy | None = None
        self.recorder: TlogWriter | None = None

    def change(self, config: Config, before: Config) -> None:
        """Apply the parts of this configuration that have changed. Raises LinkError, UsageError."""
        if config.identity != before.identity:
            self.component = Component(config.identity.component, config.identity.system)
        if config.signing != before.signing:
            self._set_signing(config.signing)
        if config.record != before.record:
            self._set_recording(config.record)

    def close(self) -> None:
        """The last call, after the last frame."""
        try:
            self._set_signing(None)
        finally:
            self._set_recording(None)

    def _set_signing(self, config: SigningConfig | None) -> None:
        former, self.signing_policy = self.signing_policy, None
        if former is not None:
            former.close()
        self.signing_policy = None if config is None else SigningPolicy(config, self._clock())

    def _set_recording(self, path: str | None) -> None:
        former, self.recorder = self.recorder, None
        if former is not None:
            former.close()
        self.recorder = None if path is None else TlogWriter(path)
        if self.recorder is not None:
            log.info("%s", self.recorder.text)

    def send(self, channel: Channel, message: Any, system: int) -> None:
        """Send one message on one channel, with our ids for this system."""
        self._send_frame(channel, self.component.frame(message, system, channel.encoders))

    def send_heartbeat(self, channel: Channel, system: int, in_error: bool = False) -> None:
        """Send our heartbeat for this system on one channel."""
        self._send_frame(channel, self.component.heartbeat(system, in_error, channel.encoders))

    def send_heartbeats(self, endpoints: Iterable[Endpoint], vehicles: Iterable[TrackedVehicle]) -> None:
        """Send a heartbeat for each known system on all links. Without any, only on links that must send first."""
        in_error: dict[int, bool] = {}
        for tracked in vehicles:
            if tracked.ids is not None:
                system = self.component.system_for(tracked.ids[0])
                in_error[system] = in_error.get(system, False) or tracked.handle.status.in_error is TriState.TRUE
        for endpoint in endpoints:
            if endpoint.passive or (not in_error and (endpoint.is_out or not endpoint.must_speak)):
                continue
            for channel in endpoint.peers():
                for system, faulty in (in_error or {DEFAULT_SYSTEM: False}).items():
                    self.send_heartbeat(channel, system, faulty)

    def _send_frame(self, channel: Channel, frame: bytes) -> None:
        if self.signing_policy is not None or self.recorder is not None:
            unix_us = self._clock().unix_us
            if self.signing_policy is not None:
                frame = self.signing_policy.sign(frame, unix_us, channel.endpoint.number)
            if self.recorder is not None and not channel.passive:
                self.recorder.write(unix_us, frame)
        channel.send(frame)
