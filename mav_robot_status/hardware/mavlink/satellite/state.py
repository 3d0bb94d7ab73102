"""What a HIGH_LATENCY2 says of a vehicle that sends no HEARTBEAT, as behind a satellite.

Sources: `GCS_MAVLINK::send_high_latency2` of ArduPilot, `HIGH_LATENCY2.hpp` of PX4, `mavlinkSendHighLatency2` of INAV,
`MAVReport.cc` of UV Radio Room. They agree on type, autopilot and speed, and differ in all else:

* ArduPilot sends every 5 s. `custom0` is its base_mode, `custom_mode` the number of its mode. It sends the errors of
  position, the climb rate and the other custom fields as 0.
* PX4 sends every 67 s. `custom0` is always -128. `custom_mode` has the upper 16 bits of the one in HEARTBEAT. Speed and
  climb rate are the mean and the maximum since the last message.
* INAV sends 0 in `custom0`; UV Radio Room, on a computer beside an ArduPilot, sends the voltage of the battery there
  and packs base_mode and mode into `custom_mode`. Both announce ArduPilot, and neither says whether it is armed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from ....mavlink.definitions import Heartbeat
from ....mavlink.enumerations import (
    MAV_AUTOPILOT_ARDUPILOTMEGA,
    MAV_AUTOPILOT_PX4,
    MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
    MAV_MODE_FLAG_SAFETY_ARMED,
)
from ..identity import ROVER, family_of

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import HighLatency2
    from ..options import HardwareOptions

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

ARMED_TOLD: Final = 0x100
ARMED_UNTOLD: Final = 0x101
"""Heartbeat.mavlink_version of a statement: it says whether it is armed, or not. No HEARTBEAT can have these values."""
STATE_UNTOLD: Final = 0x100
"""Heartbeat.system_status of a statement: no HIGH_LATENCY2 tells MAV_STATE."""
MOST_MODES: Final = 64
"""ArduPilot's modes have smaller numbers. What UV Radio Room sends as custom_mode is greater."""

LEAST_TIMEOUT: Final = 60.0
"""Seconds without a message after which the link counts as lost, before the second interval."""
LONGEST_TIMEOUT: Final = 3600.0
INTERVALS: Final = 3
"""The link counts as lost after this many of the longest interval."""
MARGIN: Final = 0.5  # s
REMEMBERED: Final = 5
"""Intervals of which the longest counts: a pause does not make the time-out long for ever."""
PERIODS: Final = {MAV_AUTOPILOT_PX4: 1 / 0.015}
"""Seconds between two messages of an autopilot, if they are longer than LEAST_TIMEOUT / INTERVALS."""

CLIMB: Final = 1.0
"""m/s. A climb rate is the greatest of a minute, so that the noise of an estimate at rest counts."""
DISTANCE: Final = 50.0
"""Metres between two positions that prove motion: a receiver at rest wanders by less."""
METRES: Final = 0.0111319
"""Metres in 1e-7 degrees of latitude."""
HALF: Final = 1 << 31  # of the clock in milliseconds, which wraps


class HighLatency(NamedTuple):
    """What a vehicle says by HIGH_LATENCY2 alone."""

    message: HighLatency2
    """The latest one."""
    statement: Heartbeat
    """What a HEARTBEAT would say, see `stated`."""
    at: float
    """When it arrived, monotonic seconds."""
    armed: TriState
    intervals: tuple[float, ...] = ()
    """The latest intervals between two messages, seconds."""
    is_fast: bool = False
    """Whether the latest message has a speed that shows motion. One sample proves nothing."""
    moves: bool = False
    """Whether the latest two messages prove motion."""
    seen_clear: int = 0
    """The failure flags that were clear in a message."""
    flagged: Mapping[int, int] = {}
    """The failure flags of the latest message, each with the time of its first one, Unix microseconds."""
    doubt_ms: int | None = None
    """An earlier time of the sender that the next message must confirm."""


# -- one message -------------------------------------------------------------------------------------------------------


def stated(message: HighLatency2) -> Heartbeat:
    """What a HEARTBEAT would say. It equals no HEARTBEAT that can arrive."""
    armed = armed_in(message)
    return Heartbeat(
        custom_mode=message.custom_mode << 16 if message.autopilot == MAV_AUTOPILOT_PX4 else message.custom_mode,
        type=message.type,
        autopilot=message.autopilot,
        base_mode=0 if armed is UNKNOWN else message.custom0 & 0xFF,
        system_status=STATE_UNTOLD,
        mavlink_version=ARMED_UNTOLD if armed is UNKNOWN else ARMED_TOLD,
    )


def is_statement(heartbeat: Heartbeat) -> bool:
    """Whether this is no HEARTBEAT, but a statement of a HIGH_LATENCY2."""
    return heartbeat.mavlink_version >= ARMED_TOLD


def tells_armed(heartbeat: Heartbeat) -> bool:
    """Whether a HEARTBEAT or a statement says armed or disarmed at all."""
    return heartbeat.mavlink_version != ARMED_UNTOLD


def is_ardupilots_own(message: HighLatency2) -> bool:
    """Whether ArduPilot itself made this message, by the values that it always sends: `custom0` is then base_mode."""
    return (
        message.autopilot == MAV_AUTOPILOT_ARDUPILOTMEGA
        and bool(message.custom0 & MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
        and message.custom_mode < MOST_MODES
        and not (message.eph or message.epv or message.climb_rate or message.custom1 or message.custom2)
    )


def armed_in(message: HighLatency2) -> TriState:
    """Whether the vehicle is armed; UNKNOWN if its sender does not tell that."""
    if not is_ardupilots_own(message):
        return UNKNOWN
    return TRUE if message.custom0 & MAV_MODE_FLAG_SAFETY_ARMED else FALSE


# -- the messages of one vehicle ---------------------------------------------------------------------------------------


def is_late(before: HighLatency, message: HighLatency2) -> bool:
    """Whether a message is older than the latest one: a satellite delivers some late. A message after a reboot is not.

    A step back of the clock counts as a reboot when the next message confirms it: see `doubting`.
    """
    back = (before.message.timestamp - message.timestamp) & 0xFFFFFFFF
    if not 0 < back < HALF:
        return False
    return before.doubt_ms is None or message.timestamp <= before.doubt_ms


def doubting(before: HighLatency, message: HighLatency2) -> HighLatency:
    """The state after a late message, of which only the time is noted."""
    return before._replace(doubt_ms=message.timestamp)


def first(message: HighLatency2, now: Instant, options: HardwareOptions) -> HighLatency:
    """The state after the first message, or the first after the link was lost."""
    return HighLatency(
        message,
        stated(message),
        now.mono,
        armed_in(message),
        is_fast=_is_fast(message, options),
        seen_clear=~message.failure_flags,
        flagged=_flagged({}, message.failure_flags, now),
    )


def following(before: HighLatency, message: HighLatency2, now: Instant, options: HardwareOptions) -> HighLatency:
    """The state after one more message."""
    after = first(message, now, options)
    ran_ms = (message.timestamp - before.message.timestamp) & 0xFFFFFFFF
    goes_on = 0 < ran_ms < HALF  # not the same message once more, and no reboot
    interval = now.mono - before.at
    return after._replace(
        intervals=(*before.intervals, interval)[-REMEMBERED:],
        moves=goes_on and ((before.is_fast and after.is_fast) or _travelled(before.message, message, ran_ms, options)),
        seen_clear=before.seen_clear | after.seen_clear,
        flagged=_flagged(before.flagged, message.failure_flags, now),
    )


def returned(before: HighLatency, message: HighLatency2, now: Instant, options: HardwareOptions) -> HighLatency:
    """The state after a message that came after the link was lost: only the interval and old flags are of use."""
    interval = now.mono - before.at
    known = (*before.intervals, interval) if interval <= LONGEST_TIMEOUT / INTERVALS else before.intervals
    after = first(message, now, options)
    return after._replace(intervals=known[-REMEMBERED:], seen_clear=before.seen_clear | after.seen_clear)


def timeout(known: HighLatency) -> float:
    """Seconds without a message after which the link counts as lost, if the site does not say."""
    if len(known.intervals) < 2:
        return max(LEAST_TIMEOUT, INTERVALS * PERIODS.get(known.message.autopilot, 0.0))
    return min(INTERVALS * max(known.intervals) + MARGIN, LONGEST_TIMEOUT)


def speed(message: HighLatency2) -> float:
    """The speed over ground, m/s."""
    return message.groundspeed / 5


def _is_fast(message: HighLatency2, options: HardwareOptions) -> bool:
    """Whether a message has a speed that shows motion."""
    on = options.v_on if armed_in(message) is TRUE else options.v_on_disarmed
    climbs = abs(message.climb_rate) / 10 > CLIMB and family_of(message.type) is not ROVER
    return speed(message) > on or climbs


def _travelled(before: HighLatency2, after: HighLatency2, ran_ms: int, options: HardwareOptions) -> bool:
    """Whether two positions prove motion. 0, 0 means that none is known."""
    if not (before.latitude or before.longitude) or not (after.latitude or after.longitude):
        return False
    north = (after.latitude - before.latitude) * METRES
    turn = (after.longitude - before.longitude + 1_800_000_000) % 3_600_000_000 - 1_800_000_000
    east = turn * METRES * math.cos(math.radians(after.latitude / 1e7))
    distance = math.hypot(north, east)
    return distance > DISTANCE and distance > options.v_on_disarmed * ran_ms / 1000


def _flagged(before: Mapping[int, int], flags: int, now: Instant) -> dict[int, int]:
    """The flags of a message, each with the time since which it is set."""
    masks = (1 << bit for bit in range(flags.bit_length()) if flags >> bit & 1)
    return {mask: before.get(mask, now.unix_us) for mask in masks}
