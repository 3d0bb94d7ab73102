"""The `mqtt` publisher: puts each change on the disk at once, and hands statuses to a thread of its own."""

from __future__ import annotations

import json
import logging
import secrets
from typing import TYPE_CHECKING, Any, Final

from ...clock import now as present
from ...errors import UsageError
from .lines import event_of, members_of
from .naming import Naming
from .options import read

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg
    from .courier import Courier

log = logging.getLogger(__name__)

PERIOD: Final = 1.0  # s between two statuses of a robot if nothing changes
SLACK: Final = 0.02  # s: what comes this much early is still periodic


class _Known:
    """What is known of one handle."""

    __slots__ = ("content", "members", "robot", "seq", "told_at")

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.content: tuple[RobotStatus, Detail] | None = None
        self.members: dict[str, Any] = {}
        """The same, as its last event told it."""
        self.seq = 0
        """Of its last event."""
        self.told_at = float("-inf")


class MqttPublisher:
    """Statuses, events and connection states of robots on an MQTT broker.

    Options: see docs/mqtt.md. Raises UsageError for what is none and if the extra is not installed, LinkError if events
    cannot wait on the disk. A broker that cannot be reached is no error. On replay it says nothing: what a log tells is
    no robot's status now.
    """

    periodic = True

    check_options = staticmethod(read)

    def __init__(self, context: PublisherContext, clock: Callable[[], Instant] = present) -> None:
        options = self.check_options(context.options)
        self._naming = Naming(options.robot)
        try:
            from . import courier
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError("mqtt: this output needs an extra: pip install 'mav-robot-status[mqtt]'") from None
        self._session = secrets.token_hex(4)
        self._known: dict[str, _Known | None] = {}
        self._names: dict[str, str] = {}
        """Handles by the name of their robot."""
        self._statuses: dict[str, RobotStatusMsg] = {}
        self._waiting: list[tuple[_Known, RobotStatusMsg]] = []
        self._courier: Courier | None = None
        if not context.patient:
            self._courier = courier.Courier(options, clock)
            self._courier.start()

    def busy(self) -> bool:
        """Never: statuses are only ever the latest, and events wait."""
        return False

    @property
    def queued(self) -> int:
        """Events that the broker has not acknowledged."""
        return self._courier.waiting if self._courier else 0

    @property
    def dropped(self) -> int:
        """Events that will never be delivered: too many waited, or for too long."""
        return self._courier.dropped if self._courier else 0

    def publish(self, msg: RobotStatusMsg) -> None:
        """Keep what has changed: from here on it is delivered, or counted as dropped, even if we are killed.

        The rest waits until `service`, which is called after every round of updates.
        """
        known = self._of(msg) if self._courier else None
        if known is None or self._courier is None:
            return
        content = (msg.status, msg.detail)
        if content != known.content:
            before, known.content, known.members = known.members, content, members_of(msg)
            known.seq += 1
            known.told_at = float("-inf")
            event = event_of(msg, before, known.members, known.robot, self._session, known.seq)
            self._courier.keep(known.robot, json.dumps(event), msg.unix_us / 1e6)
        self._waiting.append((known, msg))

    def service(self, now: Instant) -> float | None:
        """Hand over the status of each robot once in a PERIOD, and after a change."""
        for known, msg in self._waiting:
            if known.robot in self._statuses or now.mono - known.told_at >= PERIOD - SLACK:
                known.told_at = now.mono
                self._statuses[known.robot] = msg
        self._waiting.clear()
        if self._courier and self._statuses:
            self._courier.hand_over(self._statuses)
            self._statuses = {}
        return None

    def close(self) -> None:
        """End the thread; what it could not deliver waits on the disk."""
        if self._courier:
            self._courier.close()

    def _of(self, msg: RobotStatusMsg) -> _Known | None:
        """What is known of a message's handle; None if its robot has no name, or one that another has."""
        if msg.handle not in self._known:
            name = self._naming.name(msg)
            if name is None:
                return None
            other = self._names.setdefault(name, msg.handle)
            if other != msg.handle:
                log.warning(
                    "mqtt: '%s' and '%s' would both be the robot '%s': the second is left out; --mqtt-robot tells "
                    "them apart, for example {host}-{system}-{component}",
                    other, msg.handle, name,
                )  # fmt: skip
            self._known[msg.handle] = _Known(name) if other == msg.handle else None
        return self._known[msg.handle]
