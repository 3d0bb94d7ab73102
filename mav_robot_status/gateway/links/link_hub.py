"""All live links of a gateway: its members, what is received on them, and what is sent under our identity."""

from __future__ import annotations

import logging
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...config import Config
from ...mavlink.commands import HEARTBEAT
from .membership import Membership, close
from .receiving import Receiver
from .sending import Sender, speaks_for

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ...clock import Instant
    from ...hardware.mavlink.requests.scheduler import Ask
    from ...hardware.mavlink.vehicle import TrackedVehicle
    from ...interface import Audience
    from ..observer import Observer
    from .channel import Channel
    from .endpoint import Endpoint

log = logging.getLogger(__name__)

REQUEST_SIZE: Final = 45  # bytes of a COMMAND_LONG


class LinkHub:
    """The links of one gateway. It is the `MavlinkPort` of the publishers."""

    def __init__(self, config: Config, clock: Callable[[], Instant], observers: Sequence[Observer] = ()) -> None:
        """Open everything. Raises LinkError, UsageError."""
        self.config = Config()
        self.sender = Sender(clock)
        self.members = Membership()
        self.receiver = Receiver(self.members, self.sender, observers)
        self.open(config)

    @property
    def endpoints(self) -> list[Endpoint]:
        """The open links: first those to vehicles, then the outs."""
        return self.members.endpoints

    def open(self, config: Config) -> None:
        """Open everything of this configuration. Raises LinkError, UsageError. After an error nothing stays open."""
        try:
            self.change(config)
        except BaseException:
            for endpoint in self.endpoints:
                endpoint.link.close()
            self.endpoints.clear()
            self.sender.close()
            raise

    def change(self, config: Config) -> None:
        """Open the new links of this configuration, close those that it lacks, keep the others with their peers.

        Raises LinkError, UsageError. After an error some links are closed: change back.
        """
        before, self.config = self.config, config
        self.receiver.commands.offered = frozenset({HEARTBEAT} if config.identity.heartbeat else ())
        self.receiver.change(config, self.members.close_others(config))
        self.sender.change(config, before)
        self.members.open(config)

    def close(self) -> None:
        """Close the links, and log their counters."""
        with ExitStack() as steps:  # close all, even if one raises
            steps.callback(close, self.endpoints)
            steps.callback(self.sender.close)
        if copied := sum(belief.copied for belief in self.members.beliefs.values()):
            log.info("%d duplicate frames", copied)

    # the port of the publishers

    def audiences(self) -> Sequence[Audience]:
        """`MavlinkPort`: the receivers of statuses."""
        return self.members.audiences()

    def requests(self) -> set[tuple[Channel, int]]:
        """`MavlinkPort`: the requests for one status since the last call, as channel and system."""
        return self.receiver.commands.requests()

    def send(self, message: NamedTuple, system: int, audience: Audience) -> None:
        """`MavlinkPort`: send a message about the vehicle with this system id."""
        channel: Any = audience.key
        self.sender.send_unasked(channel, message, system)

    # sending

    def speak(self, vehicles: Iterable[TrackedVehicle], now: float) -> None:
        """Send our heartbeats, and what waited for its turn. Called once a second."""
        ours = [tracked for tracked in vehicles if tracked.ids is not None and speaks_for(tracked)]
        self.members.place(ours, now)
        self.sender.speak(self.endpoints, ours, self.config.identity.heartbeat)

    def ask(self, request: Ask) -> None:
        """Send a request to a vehicle."""
        path = self.members.channel_of((request.system, request.component))
        if path is not None:
            path.endpoint.budget.count(self.sender.send(path, request.message, request.system))

    def may_ask(self, ids: tuple[int, int], number: int) -> bool:
        """Whether the link of a vehicle has room for this number of requests and one more, in this second."""
        path = self.members.channel_of(ids)
        return path is not None and path.endpoint.budget.has_room_for(number * REQUEST_SIZE)

    # for a person

    @property
    def record_dropped(self) -> int | None:
        """Frames missing in the recording; None if nothing is recorded."""
        return None if self.sender.recorder is None else self.sender.recorder.dropped

    def log_silence(self) -> None:
        """Log that no autopilot is heard, with a line for each vehicle link."""
        for endpoint in self.endpoints:
            if not endpoint.is_out:
                endpoint.log_silence()
        signing_policy = self.sender.signing_policy
        if signing_policy is not None and (found := signing_policy.summary()):
            log.warning("signing: %s", found)
