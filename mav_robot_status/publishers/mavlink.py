"""Statuses as MAVLink: ROBOT_STATUS (id 59900) to everyone who listens.

It thins itself, whatever the controller's rate: 1 Hz, and changes at most 5 a second with the last state always sent.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Final

from ..interface import LinkState
from ..mavlink.definitions import RobotStatus as RobotStatusMessage

if TYPE_CHECKING:
    from ..clock import Instant
    from ..interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg

INTERVAL: Final = 1.0  # s
MOST_CHANGES: Final = 5
WINDOW: Final = 1.0  # s
SLACK: Final = 1e-3  # s: a message that comes this much early still counts as periodic


def message_of(msg: RobotStatusMsg) -> RobotStatusMessage:
    """ROBOT_STATUS as it goes over the wire; ids that are not known are 0."""
    status, detail = msg.status, msg.detail
    flags = 0
    for inhibit in detail.inhibits:
        flags |= 1 << inhibit.bit
    return RobotStatusMessage(
        time_usec=max(0, msg.unix_us),
        error_code=status.error_code,
        inhibit_flags=flags,
        subject_system=detail.system or 0,
        subject_component=detail.component or 0,
        mode=status.mode,
        e_stopped=status.e_stopped,
        drives_powered=status.drives_powered,
        motion_possible=status.motion_possible,
        in_motion=status.in_motion,
        in_error=status.in_error,
    )


class _Subject:
    """What was sent about one handle."""

    __slots__ = ("changes", "last", "sent", "waiting")

    def __init__(self) -> None:
        self.last = -math.inf
        self.sent: tuple[RobotStatus, Detail] | None = None
        self.changes: deque[float] = deque(maxlen=MOST_CHANGES)
        self.waiting: RobotStatusMsg | None = None


class MavlinkPublisher:
    """Sends ROBOT_STATUS. About a vehicle that was never heard nothing is said."""

    periodic = True

    def __init__(self, context: PublisherContext) -> None:
        self._port = context.mavlink
        self._subjects: dict[str, _Subject] = {}

    def busy(self) -> bool:
        """Never: what is too much is held back, and only its last state is kept."""
        return False

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message; `service`, called after every round of updates, sends it if it is its turn."""
        self._subjects.setdefault(msg.handle, _Subject()).waiting = msg

    def service(self, now: Instant) -> float | None:
        """Send what is its turn; when a change that is held back will be."""
        again = math.inf
        for subject in self._subjects.values():
            msg = subject.waiting
            if msg is None or msg.detail.system is None or msg.detail.link is LinkState.NEVER_SEEN:
                continue
            content = (msg.status, msg.detail)
            periodic = now.mono - subject.last >= INTERVAL - SLACK
            changed = content != subject.sent
            if not periodic and not changed:
                subject.waiting = None
                continue
            full = len(subject.changes) == MOST_CHANGES and now.mono - subject.changes[0] < WINDOW
            if not periodic and full:
                again = min(again, subject.changes[0] + WINDOW, subject.last + INTERVAL)
                continue
            if not periodic:
                subject.changes.append(now.mono)
            else:
                # the phase is kept, or jitter would add up and thin 1 Hz further
                late = now.mono - subject.last >= 2 * INTERVAL
                subject.last = now.mono if late else subject.last + INTERVAL
            subject.sent, subject.waiting = content, None
            self._port.send(message_of(msg), msg.detail.system)
        return None if again == math.inf else again

    def close(self) -> None:
        """Nothing is held."""
