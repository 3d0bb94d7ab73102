"""Receives on the links: records and forwards frames, checks signatures, passes on what a status needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...hardware.mavlink.identity import is_autopilot
from ...hardware.mavlink.subjects import COMMAND_IDS
from ...mavlink.commands import HEARTBEAT
from ...mavlink.signing import ACCEPTED, Verdict
from .arrival import BATCH, USUAL, Arrivals, Pause
from .commands import CommandServer
from .routing import Router
from .signing_policy import proof

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...clock import Instant
    from ...config import Config
    from ...links.base import Address
    from ...mavlink.framing import Frame
    from ..observer import Observer
    from .channel import Channel
    from .endpoint import Endpoint
    from .membership import Membership
    from .sending import Sender

    Received = list[tuple[Frame, Channel]]
    """The frames that a status needs, each with its channel."""

STREAMED: Final = 40
"""Bytes of a stream that count as one datagram: a usual frame."""
SETUP_SIGNING: Final = 256
"""This message contains a key. It is never recorded or forwarded."""


class Receiver:
    """Receives on all links of a gateway."""

    def __init__(self, members: Membership, sender: Sender, observers: Sequence[Observer]) -> None:
        self._members, self._sender, self._observers = members, sender, observers
        self.commands = CommandServer(members, sender)
        self.needs_turn = False
        """True if something was received that needs a turn at once. The hardware interface resets it."""
        self.late = False
        """Whether `receive_late` has to be used: some input may be old."""
        self._arrivals = Arrivals()
        self._router: Router[Channel] | None = None
        self._keep_all = False

    def change(self, config: Config, closed: Sequence[Endpoint]) -> None:
        """Apply a configuration, for which these links were closed."""
        self._keep_all = config.forward or config.record is not None
        if not config.forward or self._router is None or closed:
            self._router = Router() if config.forward else None
        for endpoint in closed:
            self._arrivals.forget(endpoint)

    def receive(self, endpoint: Endpoint, now: Instant, limit: int = BATCH) -> tuple[Received, int]:
        """Receive on a link. Returns the frames, and the datagrams read: for a stream, its bytes divided by STREAMED.

        Reads at most `limit` datagrams of USUAL bytes, or BATCH pieces of a stream.
        """
        received: Received = []
        link = endpoint.link
        number = 0
        while True:
            pieces = link.receive(min(limit, BATCH))
            number += sum(len(data) for data, _ in pieces) // STREAMED if link.stream else len(pieces)
            for data, source in pieces:
                self._receive_piece(data, source, endpoint, now, received)
            if len(pieces) < BATCH:
                number += not pieces  # the link may have refused some
                break
            limit = 0 if link.stream else limit - max(BATCH, sum(len(data) for data, _ in pieces) // USUAL)
            if limit <= 0:
                self.late = self._arrivals.left(endpoint, pieces, now)
                break
        if link.stream and link.due() <= now.mono:  # the connection has ended
            self.needs_turn = True
        return received, number

    def receive_late(self, endpoint: Endpoint, now: Instant, limit: int) -> list[tuple[Instant, Received]]:
        """As `receive`, for input that may be old: groups of frames, each with the time of its arrival."""
        groups, self.late = self._arrivals.receive(endpoint, now, limit)
        found = []
        for at, (data, source) in groups:
            received: Received = []
            self._receive_piece(data, source, endpoint, at, received)
            found.append((at, received))
        self.needs_turn = True
        return found

    def pause(self, since: Instant, now: Instant, *, stalled: bool) -> None:
        """The look at the links at `now` is late, see `arrival.Pause`."""
        self._arrivals.pause = Pause(since, now, stalled)
        self.late = True

    def lag(self, frame: Frame) -> float:
        """How late a frame is by its signature, seconds."""
        policy = self._sender.signing_policy
        return 0.0 if policy is None else policy.lag(frame)

    def _receive_piece(
        self, data: bytes, source: Address, endpoint: Endpoint, now: Instant, received: Received
    ) -> None:
        """Record and forward the frames of one piece, and add to `received` those that a status needs."""
        for observer in self._observers:
            observer.on_data(data, source, now)
        channel, frames = endpoint.parse(data, source, now.mono)
        if channel is None:
            return
        if self._keep_all:
            frames = [frame for frame in frames if frame.message_id != SETUP_SIGNING]
            self._sender.record(frames, now)
        if self._sender.signing_policy is not None:
            frames = self._accepted(frames, channel, now)
        if self._router is not None and channel.is_peer:
            whole = b"" if endpoint.link.stream else data
            for part, targets in self._router.plan(whole, frames, channel, self._members.peers(), now.mono):
                for target in targets:
                    target.send(part)
        for frame in frames:
            needed = self._needed(frame, channel, now)
            if needed is not None:
                received.append((needed, channel))

    def _accepted(self, frames: list[Frame], channel: Channel, now: Instant) -> list[Frame]:
        """The frames that the signing policy accepts. All others have no effect, and are not forwarded."""
        policy = self._sender.signing_policy
        assert policy is not None
        accepted = []
        for frame in frames:
            verdict = policy.judge(frame, now)
            if verdict in ACCEPTED:
                accepted.append(frame)
            elif frame.message_id == HEARTBEAT and policy.may_heal(verdict, now.mono):
                self._sender.send_heartbeat(channel, frame.ids[0])
        return accepted

    def _needed(self, frame: Frame, channel: Channel, now: Instant) -> Frame | None:
        """What a status needs of a frame: all of it, only its number, or nothing. Handles commands to us."""
        policy = self._sender.signing_policy
        if policy is not None and not policy.may_speak(frame):
            return None
        endpoint = channel.endpoint
        if frame.message_id == HEARTBEAT:
            self._sender.component.observe(frame)
            if endpoint.is_out:
                self._members.note_heartbeat(channel, now.mono)
            elif is_autopilot(frame.message, frame.ids[1]):
                channel.hear(now.mono)
        elif frame.message_id in COMMAND_IDS and frame.message is not None:
            if channel.is_peer and (policy is None or proof(frame) is Verdict.VERIFIED):
                self.needs_turn |= self.commands.handle(frame, channel)
            if self._is_delivered(frame, channel):
                return frame
            frame = frame._replace(message=None)  # its number still counts
        return None if endpoint.is_out else frame

    def _is_delivered(self, frame: Frame, channel: Channel) -> bool:
        """Whether a command reaches the vehicle: it arrived where the vehicle is heard, or is forwarded there."""
        system = frame.message.target_system
        every = self._members.beliefs.items()
        beliefs = [belief for ids, belief in every if ids[0] == system and belief.channel is not None]
        if any(belief.hears(channel) for belief in beliefs):
            return True
        if self._router is None or not channel.is_peer:
            return False
        return not {belief.channel for belief in beliefs}.isdisjoint(self._router.decided(frame, channel))
