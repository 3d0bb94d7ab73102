"""Commands that a peer sends to us: it asks for a heartbeat, for a status, or for statuses at an interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mavlink.commands import HEARTBEAT, ROBOT_STATUS, answer

if TYPE_CHECKING:
    from ...mavlink.framing import Frame
    from .channel import Channel
    from .membership import Membership
    from .sending import Sender


class CommandServer:
    """Answers commands, and keeps the requests for a status until the publisher asks for them."""

    def __init__(self, members: Membership, sender: Sender) -> None:
        self._members, self._sender = members, sender
        self.offered: frozenset[int] = frozenset()
        """The messages that a consumer can request from us."""
        self._requests: set[tuple[Channel, int]] = set()

    def handle(self, frame: Frame, channel: Channel) -> bool:
        """Handle a command if it is addressed to us, and acknowledge it. Whether a status is to be sent at once."""
        offered = self.offered if channel.endpoint.gets_statuses else self.offered - {ROBOT_STATUS}
        found = answer(frame.message, frame.ids, self._sender.component.speaks_as, channel.interval, offered)
        if found is None:
            return False
        for reply in found.replies:
            self._sender.send(channel, reply, found.system)
        if found.interval != channel.interval:
            channel.interval = found.interval
            self._members.forget_peers()
        if found.once == HEARTBEAT:
            self._sender.send_heartbeat(channel, found.system)
        if found.once != ROBOT_STATUS:
            return False
        systems = {system for system, _ in self._members.vehicles()}
        self._requests |= {(channel, s) for s in systems if self._sender.component.system_for(s) == found.system}
        return True

    def requests(self) -> set[tuple[Channel, int]]:
        """The requests for one status since the last call, as channel and system. Those of closed links are gone."""
        if not self._requests:  # asked in every turn
            return self._requests
        requests, self._requests = self._requests, set()
        return {(channel, system) for channel, system in requests if channel.endpoint in self._members.endpoints}
