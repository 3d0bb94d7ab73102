"""Requests the messages that a status needs and that do not arrive, with MAV_CMD_SET_MESSAGE_INTERVAL.

An old ArduPilot does not know that command. It gets REQUEST_DATA_STREAM for the stream that contains the message, but
only if no message of that stream arrives, because this sets the rate of the whole stream.

A state machine of values and times, without a socket. It requests only messages that arrive at less than half the
wanted rate 3 s after the first heartbeat: at most twice, 30 s apart, one command at a time. It never lowers, stops or
resets a rate. Sources: MAVLink command protocol; `GCS_MAVLINK::set_message_interval` of ArduPilot; PX4
`configure_streams`.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import TYPE_CHECKING, Final

from ....mavlink import definitions as mav
from ....mavlink import enumerations as mavlink
from ....mavlink.enumerations import MAV_CMD_REQUEST_MESSAGE, MAV_CMD_SET_MESSAGE_INTERVAL
from ..autopilots.wanted import OUTPUT_WATCH, Once, Wanted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..autopilots import Autopilot
    from ..identity import Family

log = logging.getLogger(__name__)

LOOK: Final = 3.0  # s of listening before a message counts as missing
AGAIN: Final = 30.0  # s until the second and last round
ROUNDS: Final = 2
PATIENCE: Final = 1.0  # s for an acknowledgement
PROGRESS: Final = 5.0  # s more after IN_PROGRESS, or until a retry after TEMPORARILY_REJECTED
RETRIES: Final = 3
BUDGET: Final = 700  # limit of all requested messages together, bytes per second


def wanted_of(profile: Autopilot, family: Family, watch_outputs: bool) -> tuple[Wanted, ...]:
    """The messages that a status of this kind of vehicle needs, together within BUDGET."""
    requests = profile.requests
    return requests.wanted + (OUTPUT_WATCH if watch_outputs and family in requests.watched_families else ())


class _Command:
    """A command that waits for its acknowledgement."""

    __slots__ = ("command", "due", "older", "params", "tries", "what")

    def __init__(self, command: int, params: tuple[float, float], what: str, older: int | None = None) -> None:
        self.command = command
        self.params = params
        self.what = what
        self.older = older
        """The command to send if this one is not supported."""
        self.tries = 0
        self.due = -math.inf


class Requests:
    """The requests to one autopilot. Call `arrived` for each of its messages, `acknowledged` for its COMMAND_ACKs."""

    def __init__(self, system: int, component: int, started: float) -> None:
        self._ids = (system, component)
        self._counts: dict[int, int] = {}
        self._queue: deque[_Command] = deque()
        self._refused: set[int] = set()
        self._silent: set[int] = set()
        """Messages that did not arrive at all during a round."""
        self._streams: deque[tuple[int, int]] = deque()
        """Message id and rate in Hz of the streams to request."""
        self._asked_once = False
        self._round = 0
        self._window = started
        self._look_at = started + LOOK

    def restart(self, now: float) -> None:
        """After a reboot of the autopilot all intervals are lost: start again."""
        self._counts.clear()
        self._queue.clear()
        self._refused.clear()
        self._streams.clear()
        self._asked_once = False
        self._round, self._window, self._look_at = 0, now, now + LOOK

    def resume(self, now: float) -> None:
        """After a link loss: messages of that time do not count as missing. The rounds and their times stay."""
        if self._look_at < math.inf:
            self._counts.clear()
            self._look_at = max(self._look_at, now + LOOK)
            self._window = self._look_at - LOOK

    def arrived(self, message_id: int, now: float) -> None:
        """Count one message of this autopilot, during a round."""
        if self._window <= now < self._look_at < math.inf:
            self._counts[message_id] = self._counts.get(message_id, 0) + 1

    def acknowledged(self, ack: mav.CommandAck, own: tuple[int, int], now: float) -> None:
        """Process an acknowledgement. Ignore it if it is not for our outstanding command."""
        command = self._queue[0] if self._queue else None
        if command is None or command.tries == 0 or ack.command != command.command:
            return
        if (ack.target_system or ack.target_component) and (ack.target_system, ack.target_component) != own:
            return
        again = ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED and command.tries <= RETRIES
        if again or ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            command.due = now + PROGRESS
        else:
            self._queue.popleft()
            if ack.result not in (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED):
                unsupported = ack.result == mavlink.MAV_RESULT_UNSUPPORTED
                if command.command == MAV_CMD_SET_MESSAGE_INTERVAL:
                    self._refused.add(int(command.params[0]))
                    if unsupported:
                        self._fall_back(*command.params)
                elif unsupported and command.older is not None:
                    self._queue.appendleft(_Command(command.older, (1.0, 0.0), command.what))
                log.debug("%d.%d refused %s: MAV_RESULT %d", *self._ids, command.what, ack.result)

    def due(
        self, now: float, wanted: tuple[Wanted, ...], profile: Autopilot
    ) -> mav.CommandLong | mav.RequestDataStream | None:
        """The command to send at `now`, if any; one is outstanding at a time."""
        if now >= self._look_at:
            self._look(now, wanted, profile.requests.once)
        while self._streams:
            message_id, rate = self._streams.popleft()
            stream = profile.requests.streams.get(message_id)
            if stream is not None:
                return mav.RequestDataStream(rate, *self._ids, req_stream_id=stream, start_stop=1)
        while self._queue:
            command = self._queue[0]
            if now < command.due:
                return None
            if command.tries > RETRIES:
                self._queue.popleft()
                log.debug("%d.%d does not answer: %s", *self._ids, command.what)
                continue
            command.tries += 1
            command.due = now + PATIENCE
            return mav.CommandLong(
                *command.params, 0.0, 0.0, 0.0, 0.0, 0.0, command.command, *self._ids, confirmation=command.tries - 1
            )
        return None

    def next_due(self) -> float:
        """When `due` has something to do."""
        if self._streams:
            return -math.inf
        return min(self._look_at, self._queue[0].due if self._queue else math.inf)

    def _look(self, now: float, wanted: tuple[Wanted, ...], once: tuple[Once, ...]) -> None:
        """Compare the received messages with the wanted ones, and queue requests for the missing ones."""
        missing = [w for w in self._missing(wanted) if w.id not in self._refused]
        self._round += 1
        if self._round > ROUNDS:
            self._look_at = math.inf
            if missing:
                names = ", ".join(w.name for w in missing)
                log.warning("vehicle %d.%d does not send %s although requested; continuing without", *self._ids, names)
            return
        for w in missing:
            self._queue.append(_Command(MAV_CMD_SET_MESSAGE_INTERVAL, (w.id, round(1e6 / w.rate)), w.name))
        if not self._asked_once:
            self._asked_once = True
            self._queue.extend(_Command(MAV_CMD_REQUEST_MESSAGE, (o.id, 0.0), o.name, o.older) for o in once)
        if missing:
            log.info("requesting from vehicle %d.%d: %s", *self._ids, ", ".join(w.name for w in missing))
        self._silent = {w.id for w in wanted if not self._came(w)}
        self._counts.clear()
        self._window, self._look_at = now + AGAIN - LOOK, now + AGAIN

    def _missing(self, wanted: tuple[Wanted, ...]) -> Iterator[Wanted]:
        return (w for w in wanted if self._came(w) / LOOK < w.rate / 2)

    def _came(self, what: Wanted) -> int:
        return max(self._counts.get(i, 0) for i in (what.id, what.instead) if i is not None)

    def _fall_back(self, message_id: float, interval_us: float) -> None:
        """SET_MESSAGE_INTERVAL is unknown there: request the whole stream, if none of its messages arrives."""
        if message_id in self._silent:
            self._streams.append((int(message_id), math.ceil(1e6 / interval_us)))
