"""Statuses as MAVLink: ROBOT_STATUS (id 59900).

The rate does not depend on the controller: 1 Hz, and at most 5 changes a second; the last state is always sent. An
audience may ask for another interval or for none. It never gets more messages than the controller publishes.
"""

from __future__ import annotations

import math
from typing import Final

from ..clock import Instant
from ..interface import FIELDS, Audience, RobotStatusMsg
from ..mavlink.commands import PERIODS, ROBOT_STATUS
from ..mavlink.definitions import RobotStatus as RobotStatusMessage
from .rate_limiter import RateLimitedPublisher, Schedule

INHIBITS: Final = (
    "LINK_STALE DISARMED E_STOPPED SAFETY_SWITCH PREARM_FAILING INITIALISING CALIBRATING POWERING_OFF TERMINATION "
    "EMERGENCY HIL SYS_STATUS_MISSING MODE_MANUAL STOP_UNCERTAIN SENDER_UNCERTAIN HEARTBEAT_LATE"
).split()
"""ROBOT_STATUS_INHIBIT of the dialect: the names of the bits of inhibit_flags, from bit 0."""
FLAGS: Final = {name: 1 << bit for bit, name in enumerate(INHIBITS)}
CARRIED: Final = tuple((field.name, field.row.mavlink) for field in FIELDS if field.row.mavlink is not None)
"""The fields in ROBOT_STATUS: our name and the MAVLink name of each."""


def message_of(msg: RobotStatusMsg) -> RobotStatusMessage:
    """ROBOT_STATUS as it goes over the wire. Unknown ids are 0. An inhibit without a bit is left out."""
    status, detail = msg.status, msg.detail
    return RobotStatusMessage(
        time_usec=max(0, msg.unix_us),
        inhibit_flags=sum(FLAGS.get(name, 0) for name in {inhibit.name for inhibit in detail.inhibits}),
        subject_system=detail.system or 0,
        subject_component=detail.component or 0,
        **{there: getattr(status, here) for here, there in CARRIED},
    )


class MavlinkPublisher(RateLimitedPublisher[Schedule]):
    """Sends ROBOT_STATUS."""

    name = "mavlink"
    state_type = Schedule

    def wants(self, audience: Audience) -> bool:
        """True unless the audience asked for no messages."""
        return audience.interval != math.inf

    def service(self, now: Instant) -> float | None:
        """Send due messages and answer single requests; return when a delayed change will be due."""
        again = super().service(now)
        requests = self._port.requests()
        if requests:
            audiences = {audience.key: audience for audience in self._port.audiences()}
            for key, system in requests:
                if key in audiences:
                    self._send_once(audiences[key], system)
        return again

    def send_due(self, msg: RobotStatusMsg, system: int, audience: Audience, state: Schedule, now: float) -> float:
        """Send the status if it is due."""
        due = state.due(msg, (msg.status, msg.detail), _interval(audience), now)
        if due > now:
            return due
        self._port.send(message_of(msg), system, audience)
        return math.inf

    def next_periodic(self, audience: Audience, state: Schedule) -> float:
        """An interval after the last one."""
        return state.last + _interval(audience)

    def _send_once(self, audience: Audience, system: int) -> None:
        """Send what the controllers published last, with its time."""
        for msg in self._latest.values():
            if msg.detail.system == system:
                self._port.send(message_of(msg), system, audience)


def _interval(audience: Audience) -> float:
    """Seconds between two periodic messages."""
    return PERIODS[ROBOT_STATUS] if audience.interval is None else audience.interval
