"""Commands to us: a consumer requests ROBOT_STATUS more often, less often, or once.

We answer only commands with our exact address. The autopilot answers a command to all components: an additional denial
from us would look like a denial by the autopilot. The results are those of MAV_RESULT in common.xml: DENIED for a
message that we do not send, UNSUPPORTED for an unknown command.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from typing import Final, NamedTuple

from . import enumerations
from .definitions import CommandAck, CommandInt, CommandLong, MessageInterval
from .enumerations import MAV_CMD_GET_MESSAGE_INTERVAL as GET_MESSAGE_INTERVAL
from .enumerations import MAV_CMD_REQUEST_MESSAGE as REQUEST_MESSAGE
from .enumerations import MAV_CMD_SET_MESSAGE_INTERVAL as SET_MESSAGE_INTERVAL
from .enumerations import MAV_RESULT_ACCEPTED as ACCEPTED
from .enumerations import MAV_RESULT_DENIED as DENIED
from .enumerations import MAV_RESULT_UNSUPPORTED as UNSUPPORTED

HEARTBEAT, MESSAGE_INTERVAL = enumerations.MAVLINK_MSG_ID_HEARTBEAT, enumerations.MAVLINK_MSG_ID_MESSAGE_INTERVAL
ROBOT_STATUS: Final = enumerations.MAVLINK_MSG_ID_ROBOT_STATUS
DISABLED, DEFAULT = -1, 0  # intervals with a special meaning

PERIODS: Final = {HEARTBEAT: 1.0, ROBOT_STATUS: 1.0}
"""The messages that can be requested: message id -> default interval in seconds."""
SHORTEST: Final = 0.05
"""The shortest interval in seconds; a shorter request is raised to this."""
LONGEST_US: Final = 2**31 - 1
"""The longest interval in microseconds that MESSAGE_INTERVAL can state."""
LAST_ID: Final = 2**16 - 1
"""The highest message id that MESSAGE_INTERVAL can state."""


class Answer(NamedTuple):
    """The replies to the sender of a command, and the action that follows."""

    system: int
    """The system id that was addressed. The replies are sent with this id."""
    replies: tuple[CommandAck | MessageInterval, ...]
    interval: float | None
    """The new interval of ROBOT_STATUS to the sender, in seconds; None: the default; inf: none are sent."""
    once: int | None
    """The id of a message to send once after the replies: HEARTBEAT or ROBOT_STATUS."""


class _Outcome(NamedTuple):
    result: int
    interval: float | None
    once: int | None = None
    interval_message: MessageInterval | None = None


def answer(
    message: CommandLong | CommandInt,
    sender: tuple[int, int],
    is_us: Callable[[int, int], bool],
    interval: float | None = None,
    offered: Container[float] = frozenset(PERIODS),
) -> Answer | None:
    """The answer to a command; None if it is not addressed to us. Never raises. Repeating a command has no effect.

    `sender` and the arguments of `is_us` are system id and component id. `interval` is the `Answer.interval` of the
    previous command on the same channel. `offered` are the messages of PERIODS that are sent: for example, the
    heartbeat may be switched off.
    """
    if not is_us(message.target_system, message.target_component):
        return None
    handle = COMMANDS.get(message.command)
    outcome = _Outcome(UNSUPPORTED, interval) if handle is None else handle(message, interval, offered)
    ack = CommandAck(message.command, outcome.result, 0, 0, *sender)
    replies = (ack,) if outcome.interval_message is None else (ack, outcome.interval_message)
    return Answer(message.target_system, replies, outcome.interval, outcome.once)


# A parameter is a float: 59900.0 equals the int; NaN and fractions equal no id, and NaN fails every comparison.


def _request(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    if message.param1 == MESSAGE_INTERVAL:  # replaces GET_MESSAGE_INTERVAL in newer versions of MAVLink
        return _message_interval(message.param2, interval, offered)
    if message.param1 not in offered:
        return _Outcome(DENIED, interval)
    return _Outcome(ACCEPTED, interval, once=int(message.param1))


def _get(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    return _message_interval(message.param1, interval, offered)


def _message_interval(message_id: float, interval: float | None, offered: Container[float]) -> _Outcome:
    """MESSAGE_INTERVAL: -1 is disabled, 0 is not available."""
    if not 0 <= message_id <= LAST_ID or message_id % 1:
        return _Outcome(DENIED, interval)
    if message_id not in offered:
        us = 0
    elif interval is None or message_id != ROBOT_STATUS:
        us = round(PERIODS[int(message_id)] * 1e6)
    else:
        us = DISABLED if interval == math.inf else round(interval * 1e6)
    return _Outcome(ACCEPTED, interval, interval_message=MessageInterval(us, int(message_id)))


def _set(message: CommandLong | CommandInt, interval: float | None, offered: Container[float]) -> _Outcome:
    message_id, us = message.param1, message.param2
    if message_id not in offered or not (us in (DISABLED, DEFAULT) or 0 < us <= LONGEST_US):
        return _Outcome(DENIED, interval)
    if message_id != ROBOT_STATUS:  # the interval of the heartbeat is fixed
        return _Outcome(ACCEPTED if us in (DEFAULT, PERIODS[int(message_id)] * 1e6) else DENIED, interval)
    if us in (DISABLED, DEFAULT):
        return _Outcome(ACCEPTED, math.inf if us == DISABLED else None)
    return _Outcome(ACCEPTED, max(us / 1e6, SHORTEST))


COMMANDS: Final[dict[int, Callable[[CommandLong | CommandInt, float | None, Container[float]], _Outcome]]] = {
    GET_MESSAGE_INTERVAL: _get,
    SET_MESSAGE_INTERVAL: _set,
    REQUEST_MESSAGE: _request,
}
