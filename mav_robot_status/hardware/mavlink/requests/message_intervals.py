"""Requests the messages that a status needs and that do not arrive, with MAV_CMD_SET_MESSAGE_INTERVAL.

An old ArduPilot does not know that command. It gets REQUEST_DATA_STREAM for the stream that contains the message, but
only if no message of that stream arrives, because this sets the rate of the whole stream.

A state machine of values and times, without a socket. It counts messages in windows of 3 s, and requests only those
that arrive at less than half the wanted rate: at most twice, 30 s apart, one command at a time. The first window begins
with the first message of a stream, and not while the autopilot starts. It begins again after a sign of a reboot: a link
loss, a new connection, a text, or a message that has fallen silent while heartbeats arrive.

It never lowers, stops or resets a rate: it asks first for the present interval, and never requests a lower rate than it
has seen. Sources: MAVLink command protocol; `GCS_MAVLINK::set_message_interval` of ArduPilot; PX4
`configure_streams`.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import TYPE_CHECKING, Final

from ....mavlink import definitions as mav
from ....mavlink import enumerations as mavlink
from ....mavlink.enumerations import (
    MAV_CMD_GET_MESSAGE_INTERVAL,
    MAV_CMD_REQUEST_MESSAGE,
    MAV_CMD_SET_MESSAGE_INTERVAL,
)
from ..autopilots.wanted import OUTPUT_WATCH, Once, Wanted

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from ..autopilots import Autopilot
    from ..identity import Family

log = logging.getLogger(__name__)

LOOK: Final = 3.0  # s of listening before a message counts as missing
AGAIN: Final = 30.0  # s until the second and last round
ROUNDS: Final = 2
PATIENCE: Final = 1.0  # s for an acknowledgement
PROGRESS: Final = 5.0  # s more after IN_PROGRESS, or until a retry after TEMPORARILY_REJECTED
RETRIES: Final = 3
ANSWER: Final = 0.3  # s from the acknowledgement of a question to its answer
SILENT: Final = 3
"""After this many windows of LOOK seconds without it, a message that arrived before has fallen silent."""
LONGEST_BOOT: Final = 60.0  # s
NO_STREAMS: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
        mavlink.MAVLINK_MSG_ID_STATUSTEXT,
    }
)
"""Messages that an autopilot sends without a stream."""
BUDGET: Final = 700  # limit of all requested messages together, bytes per second


def wanted_of(profile: Autopilot, family: Family, watch_outputs: bool) -> tuple[Wanted, ...]:
    """The messages that a status of this kind of vehicle needs, together within BUDGET."""
    requests = profile.requests
    return requests.wanted + (OUTPUT_WATCH if watch_outputs and family in requests.watched_families else ())


class _Command:
    """A command that waits for its acknowledgement."""

    __slots__ = ("again", "command", "due", "older", "params", "tries", "what")

    def __init__(
        self, command: int, params: tuple[float, float], what: str, older: int | None = None, again: bool = False
    ) -> None:
        self.command = command
        self.params = params
        self.what = what
        self.older = older
        """The command to send if this one is not supported."""
        self.again = again
        """Whether only the message that it asks for, or a second refusal, ends it. Other acknowledgements do not."""
        self.tries = 0
        self.due = -math.inf

    @property
    def most_tries(self) -> int:
        """A question that only saves a request is asked once."""
        return 1 if self.command == MAV_CMD_GET_MESSAGE_INTERVAL else RETRIES + 1


class Requests:
    """The requests to one autopilot. Call `arrived` for each of its messages, `acknowledged` for its COMMAND_ACKs."""

    def __init__(self, system: int, component: int, started: float) -> None:
        self._ids = (system, component)
        self._counts: dict[int, int] = {}
        """The messages of this window."""
        self._queue: deque[_Command] = deque()
        self._refused: set[int] = set()
        self._silent: set[int] = set()
        """Messages that did not arrive at all in the window before a round."""
        self._heard: set[int] = set()
        """Messages that arrived in that window."""
        self._empty: dict[int, int] = {}
        """How many windows ago each message arrived last, since the rounds began."""
        self._streams: deque[tuple[int, int]] = deque()
        """Message id and rate in Hz of the streams to request."""
        self._rates: dict[int, float] = {}
        """The highest rate of each message so far, Hz: seen, or told by MESSAGE_INTERVAL."""
        self._told: set[int] = set()
        """Messages whose interval the autopilot has told in this round."""
        self._tells = True
        """Whether the autopilot answers MAV_CMD_GET_MESSAGE_INTERVAL, as far as known."""
        self.asked_at: dict[str, float] = {}
        """When each message was requested last, monotonic seconds, by its name."""
        self._asked_once = False
        self.checks_asked = False
        """Whether MAV_CMD_RUN_PREARM_CHECKS was sent, on this connection and since this boot."""
        self._begin(started)
        self._began = started

    def _begin(self, now: float) -> None:
        """Begin the first window before the first round."""
        if any(command.command == MAV_CMD_REQUEST_MESSAGE for command in self._queue):
            self._asked_once = False
        self._counts.clear()
        self._empty.clear()
        self._queue.clear()
        self._refused.clear()
        self._told.clear()
        self._streams.clear()
        self._streaming = False
        """Whether a message other than HEARTBEAT has arrived."""
        self._round = 0
        self._began = self._window = self._round_at = now
        self._look_at = now + LOOK

    def restart(self, now: float) -> None:
        """After a reboot of the autopilot all intervals are lost: start again."""
        self._asked_once = self.checks_asked = False
        self._begin(now)

    def reconnected(self, now: float) -> None:
        """The connection is a new one."""
        self.checks_asked = False
        self.look_again(now)

    def look_again(self, now: float) -> None:
        """It may have rebooted: listen, and ask for what is missing then. What still arrives is not asked for."""
        if self._round or now - self._window > LOOK:
            self._begin(now)

    def wait_for_boot(self, now: float) -> None:
        """It is still starting: its streams begin later. Listen afterwards, at the latest after LONGEST_BOOT."""
        if self._round == 0 and now - self._began < LONGEST_BOOT:
            self._counts.clear()
            self._streaming = False
            self._window, self._look_at = now, now + LOOK

    def arrived(self, message_id: int, now: float) -> None:
        """Count one message of this autopilot."""
        try:
            self._counts[message_id] += 1
        except KeyError:
            self._counts[message_id] = 1
            if not self._streaming and message_id not in NO_STREAMS:
                self._streaming = True
                if self._round == 0:  # the others begin now too
                    self._window, self._look_at = now, now + LOOK

    def told(self, message_id: int, interval_us: int) -> None:
        """MESSAGE_INTERVAL: the autopilot sends this message, or will. It is requested only if that is too slow."""
        if interval_us <= 0:
            return
        rate = 1e6 / interval_us
        self._rates[message_id] = max(rate, self._rates.get(message_id, 0.0))
        if message_id not in self._told:
            self._told.add(message_id)
            self._queue = deque(c for c in self._queue if not _is_met(c, message_id, rate))

    def delivered(self, message_id: int) -> None:
        """A message that is requested until it arrives has arrived."""
        self._queue = deque(c for c in self._queue if not (c.again and c.params[0] == message_id))

    def outstanding(self) -> list[str]:
        """What was asked for and was not answered yet, in words."""
        if self._round == 0:
            return ["its messages"]
        return [command.what for command in self._queue]

    def acknowledged(self, ack: mav.CommandAck, own: tuple[int, int], now: float) -> None:
        """Process an acknowledgement. Ignore it if it is not for our outstanding command."""
        command = self._queue[0] if self._queue else None
        if command is None or command.tries == 0 or ack.command != command.command:
            return
        if (ack.target_system or ack.target_component) and (ack.target_system, ack.target_component) != own:
            return
        again = ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED and command.tries <= RETRIES
        # a refusal after the first try may be a late or repeated one, of the request before
        again = again or (command.again and (ack.result == mavlink.MAV_RESULT_ACCEPTED or command.tries == 1))
        if again or ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            command.due = now + PROGRESS
        elif command.command == MAV_CMD_GET_MESSAGE_INTERVAL:
            self._queue.popleft()
            self._tells = ack.result == mavlink.MAV_RESULT_ACCEPTED
            if self._queue:
                self._queue[0].due = now + ANSWER if self._tells else -math.inf
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
        self, now: float, wanted: tuple[Wanted, ...], profile: Autopilot, without: Collection[Once] = ()
    ) -> mav.CommandLong | mav.RequestDataStream | None:
        """The command to send at `now`, if any; one is outstanding at a time. Nothing in `without` is asked for."""
        if now >= self._look_at:
            self._look(now, wanted, tuple(once for once in profile.requests.once if once not in without))
        while self._streams:
            message_id, rate = self._streams.popleft()
            stream = profile.requests.streams.get(message_id)
            if stream is not None and not self._arrives(stream, profile):
                return mav.RequestDataStream(rate, *self._ids, req_stream_id=stream, start_stop=1)
        while self._queue:
            command = self._queue[0]
            if command.command == MAV_CMD_GET_MESSAGE_INTERVAL and not self._tells:
                self._queue.popleft()
                continue
            if now < command.due:
                return None
            if command.tries >= command.most_tries:
                self._queue.popleft()
                self._tells = self._tells and command.command != MAV_CMD_GET_MESSAGE_INTERVAL
                log.debug("%d.%d does not answer: %s", *self._ids, command.what)
                continue
            command.tries += 1
            if command.command == MAV_CMD_SET_MESSAGE_INTERVAL:
                self.asked_at[command.what] = now
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
        """The end of a window: ask for what is missing, if a round is due or a message has fallen silent."""
        self._note_rates(now)
        if self._fell_silent(wanted):
            counts = dict(self._counts)
            self._begin(now)
            self._counts = counts
        if now >= self._round_at and self._round <= ROUNDS:
            self._ask(now, wanted, once)
        self._counts = {}
        self._window, self._look_at = now, now + LOOK

    def _note_rates(self, now: float) -> None:
        seconds = max(LOOK, now - self._window)
        for message_id, count in self._counts.items():
            self._rates[message_id] = max(count / seconds, self._rates.get(message_id, 0.0))

    def _fell_silent(self, wanted: tuple[Wanted, ...]) -> bool:
        """Whether a wanted message that arrived since the rounds began has not arrived for SILENT windows."""
        for w in wanted:
            if self._came(w):
                self._empty[w.id] = 0
            elif w.id in self._empty:
                self._empty[w.id] += 1
        return any(number >= SILENT for number in self._empty.values())

    def _ask(self, now: float, wanted: tuple[Wanted, ...], once: tuple[Once, ...]) -> None:
        """Compare the received messages with the wanted ones, and queue requests for the missing ones."""
        missing = [w for w in self._missing(wanted) if w.id not in self._refused]
        self._round += 1
        self._round_at = now + AGAIN
        if self._round > ROUNDS:
            if missing:
                names = ", ".join(w.name for w in missing)
                log.warning("vehicle %d.%d does not send %s although requested; continuing without", *self._ids, names)
            return
        for w in missing:
            rate = max(w.rate, self._rates.get(w.id, 0.0))
            if self._round == 1 and self._tells:
                self._queue.append(_Command(MAV_CMD_GET_MESSAGE_INTERVAL, (w.id, 0.0), f"the interval of {w.name}"))
            self._queue.append(_Command(MAV_CMD_SET_MESSAGE_INTERVAL, (w.id, round(1e6 / rate)), w.name))
        if not self._asked_once:
            self._asked_once = True
            self._queue.extend(_Command(MAV_CMD_REQUEST_MESSAGE, (o.id, 0.0), o.name, o.older, o.again) for o in once)
        if missing:
            log.info("requesting from vehicle %d.%d: %s", *self._ids, ", ".join(w.name for w in missing))
        self._silent = {w.id for w in wanted if not self._came(w)}
        self._heard = set(self._counts)

    def _missing(self, wanted: tuple[Wanted, ...]) -> Iterator[Wanted]:
        return (w for w in wanted if self._came(w) / LOOK < w.rate / 2)

    def _came(self, what: Wanted) -> int:
        return max(self._counts.get(i, 0) for i in (what.id, what.instead) if i is not None)

    def _fall_back(self, message_id: float, interval_us: float) -> None:
        """SET_MESSAGE_INTERVAL is unknown there: request the whole stream, if this message does not arrive."""
        if message_id in self._silent:
            self._streams.append((int(message_id), math.ceil(1e6 / interval_us)))

    def _arrives(self, stream: int, profile: Autopilot) -> bool:
        """Whether a message of this stream arrives: then a request would change its rate."""
        return any(s == stream and i in self._heard for i, s in profile.requests.streams.items())


def _is_met(command: _Command, message_id: int, rate: float) -> bool:
    """Whether a request that was not sent yet is unnecessary, because its message arrives at half its rate or more."""
    wanted = command.command == MAV_CMD_SET_MESSAGE_INTERVAL and command.params[0] == message_id
    return wanted and command.tries == 0 and rate >= 1e6 / command.params[1] / 2
