"""Sends frames with our ids. Signs and records them if configured."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, NamedTuple

from ...interface import LinkState, TriState
from ...links.record import TlogWriter
from ...mavlink.component import DEFAULT_SYSTEM, Component
from .send_budget import SendBudget, Waiting
from .signing_policy import SigningPolicy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from ...clock import Instant
    from ...config import Config, SigningConfig
    from ...hardware.mavlink.vehicle import TrackedVehicle
    from ...mavlink.framing import Frame
    from .channel import Channel
    from .endpoint import Endpoint

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

    def send(self, channel: Channel, message: NamedTuple, system: int) -> int:
        """Send one message on one channel, with our ids for this system. Returns its size in bytes."""
        return self._send_frame(channel, self.component.frame(message, system, channel.encoders))

    def send_heartbeat(self, channel: Channel, system: int, in_error: bool = False) -> int:
        """Send our heartbeat for this system on one channel, unless it would pass for a ground station's."""
        if not self.component.may_beat(system):
            return 0
        return self._send_frame(channel, self.component.heartbeat(system, in_error, channel.encoders))

    def send_unasked(self, channel: Channel, message: NamedTuple, system: int) -> None:
        """Send a message within the budget of the link, or later."""
        budget = channel.endpoint.budget
        key = channel, type(message), getattr(message, "subject_component", 0), getattr(message, "name", b""), system
        if channel.interval is not None and budget.has_room_for_asked:  # the peer has asked for it
            budget.forget(key)
            budget.count_asked(self.send(channel, message, system))
            return
        budget.wait(key, Waiting(channel, message, system))
        self._send_waiting(budget)

    def _send_waiting(self, budget: SendBudget) -> None:
        while (waiting := budget.next_waiting()) is not None:
            channel, message, system = waiting
            if channel.endpoint.is_out or system in channel.systems:
                budget.count(self.send(channel, message, system))

    def speak(self, endpoints: Iterable[Endpoint], vehicles: Iterable[TrackedVehicle], beats: bool) -> None:
        """Renew the budgets; send our heartbeats for these vehicles, then what waits. Called once a second.

        A heartbeat for a system goes to the channels on which its vehicles are heard, and to the outs. On a link that
        must send first there is one even without a vehicle, unless it is `quiet`.
        """
        self.component.pass_second()
        in_error: dict[int, bool] = {}
        for tracked in vehicles:
            if tracked.ids is not None:
                system = tracked.ids[0]
                in_error[system] = in_error.get(system, False) or tracked.handle.status.in_error is TriState.TRUE
        for endpoint in endpoints:
            budget = endpoint.budget
            budget.renew(endpoint.speech_limit)
            if endpoint.passive:
                continue
            if beats:
                budget.in_turn(list(self._beats(endpoint, in_error)), lambda beat: self.send_heartbeat(*beat))
            self._send_waiting(budget)

    def _beats(self, endpoint: Endpoint, in_error: Mapping[int, bool]) -> Iterator[tuple[Channel, int, bool]]:
        """The heartbeats that are due on a link: channel, system, and whether a vehicle of the system is in error."""
        for channel in endpoint.peers():
            ours: dict[int, bool] = {}
            for system, faulty in in_error.items():
                if endpoint.is_out or system in channel.systems:
                    own = self.component.system_for(system)
                    ours[own] = ours.get(own, False) or faulty
            if not ours and endpoint.must_speak and not endpoint.is_out and not channel.quiet:
                ours = {DEFAULT_SYSTEM: False}
            yield from ((channel, own, faulty) for own, faulty in ours.items())

    def record(self, frames: Iterable[Frame], now: Instant) -> None:
        """Record received frames, if that is configured."""
        if self.recorder is not None:
            for frame in frames:
                self.recorder.write(now.unix_us, frame.raw)

    def _send_frame(self, channel: Channel, frame: bytes) -> int:
        if self.signing_policy is not None or self.recorder is not None:
            unix_us = self._clock().unix_us
            if self.signing_policy is not None:
                frame = self.signing_policy.sign(frame, unix_us, channel.endpoint.number)
            if self.recorder is not None and not channel.passive:
                self.recorder.write(unix_us, frame)
        channel.send(frame)
        return len(frame)


def speaks_for(tracked: TrackedVehicle) -> bool:
    """Whether we speak for a vehicle: while it is heard, and after a loss if it was there for a while."""
    return tracked.handle.detail.link is LinkState.CONNECTED or tracked.established
