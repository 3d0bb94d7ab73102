"""A MAVLink port that records sent messages, and statuses for publishers."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from typing import Any, NamedTuple

from mav_robot_status.clock import Instant
from mav_robot_status.interface import Audience, Detail, Publisher, RobotStatus, RobotStatusMsg

SEEN = Detail(1, 1)
QUIET = RobotStatus()


class Sent(NamedTuple):
    message: Any
    system: int
    key: Hashable


class Port:
    def __init__(self, *audiences: Audience) -> None:
        self.present = list(audiences)
        self.asked: list[tuple[Hashable, int]] = []
        self.sent: list[Sent] = []

    def audiences(self) -> list[Audience]:
        return list(self.present)

    def requests(self) -> Collection[tuple[Hashable, int]]:
        asked, self.asked = self.asked, []
        return asked

    def send(self, message: Any, system: int, audience: Audience) -> None:
        self.sent.append(Sent(message, system, audience.key))

    def taken(self) -> list[Sent]:
        """The messages sent since the last call."""
        sent, self.sent = self.sent, []
        return sent


def msg(status: RobotStatus = QUIET, detail: Detail = SEEN, handle: str = "robot") -> RobotStatusMsg:
    return RobotStatusMsg(handle, 1_000_000, status, detail, 0.1)


def publish(publisher: Publisher, at: float, *messages: RobotStatusMsg) -> float | None:
    """Publish at a time in seconds; return when the publisher must be called again."""
    for message in messages:
        publisher.publish(message)
    return publisher.service(Instant(at, 0))


def run(publisher: Publisher, seconds: float, period: float = 0.1, status: RobotStatus = QUIET) -> None:
    """Publish periodically like a controller, from time 0 to `seconds` inclusive."""
    for tick in range(round(seconds / period) + 1):
        publish(publisher, tick * period, msg(status))
