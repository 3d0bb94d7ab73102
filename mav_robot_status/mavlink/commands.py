"""Commands to us: a consumer wants ROBOT_STATUS more often, less often, or once.

Only what is addressed to exactly us is answered. A command to all components is the autopilot's to answer: a refusal of
ours beside its acknowledgement would make the sender believe that it was refused. Results are those of MAV_RESULT in
common.xml: DENIED for a message that we do not send, UNSUPPORTED for a command that we do not know.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from .definitions import CommandAck, MessageInterval

if TYPE_CHECKING:
    from collections.abc import Callable, Container

    from .definitions import CommandInt, CommandLong

HEARTBEAT, MESSAGE_INTERVAL, ROBOT_STATUS = 0, 244, 59900
GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 510, 511, 512  # MAV_CMD
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3  # MAV_RESULT
DISABLED, DEFAULT = -1, 0  # microseconds that mean something else

PERIODS: Final = {HEARTBEAT: 1.0, ROBOT_STATUS: 1.0}
"""What we send and can be asked for: message id -> seconds between two, unless asked for otherwise."""
SHORTEST: Final = 0.05
"""Seconds: who asks for less gets this."""
LONGEST_US: Final = 2**31 - 1
"""MESSAGE_INTERVAL cannot tell more microseconds."""
LAST_ID: Final = 2**16 - 1
"""MESSAGE_INTERVAL cannot tell of a message with a higher id."""


class Answer(NamedTuple):
    """What to reply to the sender of a command, and what to do."""

    system: int
    """The system id that was addressed, and that the replies come from."""
    replies: tuple[CommandAck | MessageInterval, ...]
    interval: float | None
    """From now on, seconds between two ROBOT_STATUS to where the command came from; None: the default; inf: none."""
    once: int | None
    """The id of a message to send there once, behind the replies: HEARTBEAT or ROBOT_STATUS."""


class _Outcome(NamedTuple):
    result: int
    interval: float | None
    once: int | None = None
    told: MessageInterval | None = None


def answer(
    message: CommandLong | CommandInt,
    sender: tuple[int, int],
    is_us: Callable[[int, int], bool],
    interval: float | None = None,
    offered: Container[float] = frozenset(PERIODS),
) -> Answer | None:
    """The answer to a command, None if it is not for us. Never raises; a command that is repeated does no more.

    `sender` and `is_us` are in system and component ids, `interval` is that of the last answer to a command that came
    the same way. `offered` are the messages of PERIODS that are sent: a heartbeat may be switched off, for example.
    """
    if not is_us(message.target_system, message.target_component):
        return None
    handle = COMMANDS.get(message.command)
    outcome = _Outcome(UNSUPPORTED, interval) if handle is None else handle(message, interval, offered)
    ack = CommandAck(message.command, outcome.result, 0, 0, *sender)
    replies = (ack,) if outcome.told is None else (ack, outcome.told)
    return Answer(message.target_system, replies, outcome.interval, outcome.once)


# A parameter is a float: 59900.0 is found among ints; NaN and fractions are not, and fail every comparison.


def _request(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    if message.param1 == MESSAGE_INTERVAL:  # the newer way to write GET_MESSAGE_INTERVAL
        return _tell(message.param2, interval, offered)
    if message.param1 not in offered:
        return _Outcome(DENIED, interval)
    return _Outcome(ACCEPTED, interval, once=int(message.param1))


def _get(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    return _tell(message.param1, interval, offered)


def _tell(message_id: float, interval: float | None, offered: Container[float]) -> _Outcome:
    """MESSAGE_INTERVAL: -1 is disabled, 0 is not available."""
    if not 0 <= message_id <= LAST_ID or message_id % 1:
        return _Outcome(DENIED, interval)
    if message_id not in offered:
        us = 0
    elif interval is None or message_id != ROBOT_STATUS:
        us = round(PERIODS[int(message_id)] * 1e6)
    else:
        us = DISABLED if interval == math.inf else round(interval * 1e6)
    return _Outcome(ACCEPTED, interval, told=MessageInterval(us, int(message_id)))


def _set(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    message_id, us = message.param1, message.param2
    if message_id not in offered or not (us in (DISABLED, DEFAULT) or 0 < us <= LONGEST_US):
        return _Outcome(DENIED, interval)
    if message_id != ROBOT_STATUS:  # the heartbeat stays as it is
        return _Outcome(ACCEPTED if us in (DEFAULT, PERIODS[int(message_id)] * 1e6) else DENIED, interval)
    if us in (DISABLED, DEFAULT):
        return _Outcome(ACCEPTED, math.inf if us == DISABLED else None)
    return _Outcome(ACCEPTED, max(us / 1e6, SHORTEST))


COMMANDS: Final[dict[int, Callable[[CommandLong | CommandInt, float | None, Container[float]], _Outcome]]] = {
    GET_MESSAGE_INTERVAL: _get,
    SET_MESSAGE_INTERVAL: _set,
    REQUEST_MESSAGE: _request,
}
