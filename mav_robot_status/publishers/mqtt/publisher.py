"""The `mqtt` publisher: hands statuses and changes to a thread of its own."""

from __future__ import annotations

import logging
import secrets
from typing import TYPE_CHECKING, Final

from ...clock import now as present
from ...errors import UsageError
from .naming import Naming
from .options import read

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg
    from .courier import Change, Courier

log = logging.getLogger(__name__)

PERIOD: Final = 1.0  # s between two statuses of a robot if nothing changes
SLACK: Final = 0.02  # s: what comes this much early is still periodic


class _Known:
    """What is known of one handle."""

    __slots__ = ("content", "robot", "seq", "told_at")

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.content: tuple[RobotStatus, Detail] | None = None
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

    def __init__(self, context: PublisherContext, clock: Callable[[], Instant] = present) -> None:
        options = read(context.options)
        self._naming = Naming(options.robot)
        try:
            from . import courier
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError("mqtt: this output needs an extra: pip install 'mav-robot-status[mqtt]'") from None
        self._change = courier.Change
        self._known: dict[str, _Known | None] = {}
        self._names: dict[str, str] = {}
        """Handles by the name of their robot."""
        self._statuses: dict[str, RobotStatusMsg] = {}
        self._changes: list[Change] = []
        self._waiting: list[RobotStatusMsg] = []
        self._courier: Courier | None = None
        if not context.patient:
            self._courier = courier.Courier(options, secrets.token_hex(4), clock)
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
        """Hold it until `service`, which is called after every round of updates."""
        if self._courier:
            self._waiting.append(msg)

    def service(self, now: Instant) -> float | None:
        """Hand over changes, and the status of each robot once in a PERIOD."""
        for msg in self._waiting:
            self._sort(msg, now.mono)
        self._waiting.clear()
        if self._courier and (self._statuses or self._changes):
            self._courier.hand_over(self._statuses, self._changes)
            self._statuses, self._changes = {}, []
        return None

    def close(self) -> None:
        """End the thread; what it could not deliver waits on the disk."""
        if self._courier:
            self._courier.close()

    def _sort(self, msg: RobotStatusMsg, now: float) -> None:
        known = self._of(msg)
        if known is None:
            return
        content = (msg.status, msg.detail)
        if content != known.content:
            known.seq += 1
            self._changes.append(self._change(known.robot, known.seq, msg, known.content))
            known.content = content
        elif now - known.told_at < PERIOD - SLACK:
            return
        known.told_at = now
        self._statuses[known.robot] = msg

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
