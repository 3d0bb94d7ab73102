"""Statuses as MAVLink: ROBOT_STATUS (id 59900) to everyone who listens.

It thins itself, whatever the controller's rate: 1 Hz, and changes at most 5 a second with the last state always sent.
An audience may ask for another interval than a second, or for none; it never gets more than the controller publishes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..mavlink.commands import PERIODS, ROBOT_STATUS
from ..mavlink.definitions import RobotStatus as RobotStatusMessage
from .thinning import Schedule, ThinnedPublisher

if TYPE_CHECKING:
    from ..clock import Instant
    from ..interface import Audience, RobotStatusMsg


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


class MavlinkPublisher(ThinnedPublisher[Schedule]):
    """Sends ROBOT_STATUS."""

    name = "mavlink"
    memory = Schedule

    def wants(self, audience: Audience) -> bool:
        """True unless the audience wants none."""
        return audience.interval != math.inf

    def service(self, now: Instant) -> float | None:
        """Send what is its turn, and what was asked for once; when a change that is held back will be due."""
        again = super().service(now)
        requests = self._port.requests()
        if requests:
            audiences = {audience.key: audience for audience in self._port.audiences()}
            for key, system in requests:
                if key in audiences:
                    self._send_once(audiences[key], system)
        return again

    def tell(self, msg: RobotStatusMsg, system: int, audience: Audience, told: Schedule, now: float) -> float:
        """Send the status if it is its turn."""
        interval = PERIODS[ROBOT_STATUS] if audience.interval is None else audience.interval
        due = told.turn(msg, (msg.status, msg.detail), interval, now)
        if due > now:
            return due
        self._port.send(message_of(msg), system, audience)
        return math.inf

    def _send_once(self, audience: Audience, system: int) -> None:
        for msg in self._latest.values():
            if msg.detail.system == system:
                self._port.send(message_of(msg), system, audience)
