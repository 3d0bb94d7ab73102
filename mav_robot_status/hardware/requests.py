"""Asking an autopilot for the messages that a status needs and that do not come: MAV_CMD_SET_MESSAGE_INTERVAL.

An old ArduPilot that does not know that command is asked for the stream that holds the message, REQUEST_DATA_STREAM;
only where nothing of that stream comes, since it sets the rate of the whole stream.

A state machine of values and times; it holds no socket. Manners: only what arrives at less than half the wanted rate 3
s after the first heartbeat is asked for, at most twice, 30 s apart, one command at a time; a rate is never lowered,
stopped or reset. Sources: MAVLink command protocol; `GCS_MAVLINK::set_message_interval` of ArduPilot; PX4
`configure_streams`.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from ..mavlink import definitions as mav
from .identity import Family, Stack

if TYPE_CHECKING:
    from collections.abc import Iterator

log = logging.getLogger(__name__)

SET_MESSAGE_INTERVAL: Final = 511
REQUEST_MESSAGE: Final = 512
ACCEPTED, TEMPORARILY_REJECTED, UNSUPPORTED, IN_PROGRESS = 0, 1, 3, 5  # MAV_RESULT; what is not named is final

LOOK: Final = 3.0  # s of listening before something counts as missing
AGAIN: Final = 30.0  # s until the second and last look
ROUNDS: Final = 2
PATIENCE: Final = 1.0  # s for an acknowledgement
PROGRESS: Final = 5.0  # s more after IN_PROGRESS, or until a retry after TEMPORARILY_REJECTED
RETRIES: Final = 3
BUDGET: Final = 700  # bytes per second of all that may be asked for, together


class Wanted(NamedTuple):
    """One message that a status needs."""

    id: int
    name: str
    rate: float
    """Hz."""
    size: int
    """Bytes of a whole MAVLink 2 frame."""
    instead: int | None = None
    """A message that serves as well."""


def _wanted(message_id: int, rate: float, instead: int | None = None) -> Wanted:
    definition = mav.MESSAGES[message_id]
    return Wanted(message_id, definition.name, rate, definition.size + 12, instead)


COMMON: Final = (
    _wanted(1, 1.0),  # SYS_STATUS
    _wanted(245, 2.0),  # EXTENDED_SYS_STATE
    _wanted(33, 4.0, instead=32),  # GLOBAL_POSITION_INT or LOCAL_POSITION_NED
    _wanted(30, 4.0),  # ATTITUDE
    _wanted(2, 1.0),  # SYSTEM_TIME
)
OUTPUT_WATCH: Final = (_wanted(36, 2.0), _wanted(74, 2.0))  # SERVO_OUTPUT_RAW, VFR_HUD
ESTIMATOR: Final = (_wanted(193, 0.5),)  # EKF_STATUS_REPORT: its word counts for ten seconds
WATCHED_FAMILIES: Final = frozenset({Family.COPTER, Family.ROVER, Family.PLANE, Family.SUB})
CURRENT_MODE: Final = (_wanted(436, 1.0),)
AVAILABLE_MODES: Final = 435
STREAMS: Final = {1: 2, 36: 3, 33: 6, 32: 6, 30: 10, 74: 11, 2: 12, 193: 12}
"""The MAV_DATA_STREAM that a message belongs to on ArduPilot (`GCS_MAVLINK_*::data_stream_send` of Copter 3.x)."""


def wanted_of(stack: Stack, family: Family, watch_outputs: bool) -> tuple[Wanted, ...]:
    """What a status needs of this kind of vehicle; all together stay within BUDGET."""
    if stack is Stack.ARDUPILOT:
        return COMMON + ESTIMATOR + (OUTPUT_WATCH if watch_outputs and family in WATCHED_FAMILIES else ())
    return COMMON + CURRENT_MODE if stack is Stack.PX4 else COMMON


class _Command:
    """A command that waits for its acknowledgement."""

    __slots__ = ("command", "due", "params", "tries", "what")

    def __init__(self, command: int, params: tuple[float, float], what: str) -> None:
        self.command = command
        self.params = params
        self.what = what
        self.tries = 0
        self.due = -math.inf


class Requests:
    """The requests to one autopilot. `arrived` for every message of it, `acknowledged` for its COMMAND_ACKs."""

    def __init__(self, system: int, component: int, started: float) -> None:
        self._ids = (system, component)
        self._counts: dict[int, int] = {}
        self._queue: deque[_Command] = deque()
        self._refused: set[int] = set()
        self._silent: set[int] = set()
        """Messages that did not come at all while it was looked for them."""
        self._streams: deque[mav.RequestDataStream] = deque()
        self._asked_modes = False
        self._round = 0
        self._window = started
        self._look_at = started + LOOK

    def restart(self, now: float) -> None:
        """After a reboot of the autopilot all intervals are gone: look anew."""
        self._counts.clear()
        self._queue.clear()
        self._refused.clear()
        self._streams.clear()
        self._asked_modes = False
        self._round, self._window, self._look_at = 0, now, now + LOOK

    def resume(self, now: float) -> None:
        """After a link loss: what did not come meanwhile is not missing. The rounds and their distance stay."""
        if self._look_at < math.inf:
            self._counts.clear()
            self._look_at = max(self._look_at, now + LOOK)
            self._window = self._look_at - LOOK

    def arrived(self, message_id: int, now: float) -> None:
        """Count one message of this autopilot, while one is looking."""
        if self._window <= now < self._look_at < math.inf:
            self._counts[message_id] = self._counts.get(message_id, 0) + 1

    def acknowledged(self, ack: mav.CommandAck, own: tuple[int, int], now: float) -> None:
        """Take an acknowledgement; one that is not for our outstanding command is somebody else's."""
        command = self._queue[0] if self._queue else None
        if command is None or command.tries == 0 or ack.command != command.command:
            return
        if (ack.target_system or ack.target_component) and (ack.target_system, ack.target_component) != own:
            return
        if ack.result == IN_PROGRESS or (ack.result == TEMPORARILY_REJECTED and command.tries <= RETRIES):
            command.due = now + PROGRESS
        else:
            self._queue.popleft()
            if ack.result not in (ACCEPTED, TEMPORARILY_REJECTED):
                self._refused.add(int(command.params[0]))
                if ack.result == UNSUPPORTED and command.command == SET_MESSAGE_INTERVAL:
                    self._fall_back(*command.params)
                log.debug("%d.%d refused %s: MAV_RESULT %d", *self._ids, command.what, ack.result)

    def due(
        self, now: float, wanted: tuple[Wanted, ...], stack: Stack
    ) -> mav.CommandLong | mav.RequestDataStream | None:
        """The command to send at `now`, if any; one is outstanding at a time."""
        if now >= self._look_at:
            self._look(now, wanted, stack is not Stack.ARDUPILOT)
        if self._streams:
            stream = self._streams.popleft()
            return stream if stack is Stack.ARDUPILOT else None
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

    def _look(self, now: float, wanted: tuple[Wanted, ...], ask_modes: bool) -> None:
        """Compare what came with what is wanted, and queue what is missing."""
        missing = [w for w in self._missing(wanted) if w.id not in self._refused]
        self._round += 1
        if self._round > ROUNDS:
            self._look_at = math.inf
            if missing:
                names = ", ".join(w.name for w in missing)
                log.warning(
                    "vehicle %d.%d does not send %s although asked; the status lives without", *self._ids, names
                )
            return
        for w in missing:
            self._queue.append(_Command(SET_MESSAGE_INTERVAL, (w.id, round(1e6 / w.rate)), w.name))
        if ask_modes and not self._asked_modes:
            self._asked_modes = True
            self._queue.append(_Command(REQUEST_MESSAGE, (AVAILABLE_MODES, 0.0), "AVAILABLE_MODES"))
        if missing:
            log.info("asking vehicle %d.%d for %s", *self._ids, ", ".join(w.name for w in missing))
        self._silent = {w.id for w in wanted if not self._came(w)}
        self._counts.clear()
        self._window, self._look_at = now + AGAIN - LOOK, now + AGAIN

    def _missing(self, wanted: tuple[Wanted, ...]) -> Iterator[Wanted]:
        return (w for w in wanted if self._came(w) / LOOK < w.rate / 2)

    def _came(self, what: Wanted) -> int:
        return max(self._counts.get(i, 0) for i in (what.id, what.instead) if i is not None)

    def _fall_back(self, message_id: float, interval_us: float) -> None:
        """SET_MESSAGE_INTERVAL is not known there: queue the request for the whole stream, if nothing of it comes."""
        stream = STREAMS.get(int(message_id))
        if stream is not None and message_id in self._silent:
            rate = math.ceil(1e6 / interval_us)
            self._streams.append(mav.RequestDataStream(rate, *self._ids, req_stream_id=stream, start_stop=1))
