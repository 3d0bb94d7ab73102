"""HIGH_LATENCY2: the only message of a vehicle behind a satellite. It counts while no HEARTBEAT arrives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..faults.texts import pass_time
from ..state import begin, timeout_of
from . import state as rules

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import HighLatency2
    from ..options import HardwareOptions
    from ..state import VehicleState


def sends_heartbeats(state: VehicleState, now: float, options: HardwareOptions) -> bool:
    """Whether HEARTBEATs arrive, so that a HIGH_LATENCY2 says nothing new."""
    beat = state.latest.heartbeat
    return state.high_latency is None and beat is not None and now <= beat.at + timeout_of(state, options)


def follows(state: VehicleState, message: HighLatency2) -> bool:
    """Whether a message is not older than the latest one. Notes the time of an older one."""
    known = state.high_latency
    if known is None or not rules.is_late(known, message):
        return True
    state.high_latency = rules.doubting(known, message)
    return False


def high_latency(state: VehicleState, message: HighLatency2, now: Instant, options: HardwareOptions) -> None:
    """A HIGH_LATENCY2 of a vehicle that sends no HEARTBEAT. What HEARTBEATs said is kept until they come again."""
    if (message.autopilot, message.type) != (state.autopilot, state.vehicle_type):
        boots = state.boots
        state.become(begin(rules.stated(message), now))
        state.boots = boots
    pass_time(state, now, options)
    before = state.high_latency
    if before is None:
        state.high_latency = rules.first(message, now, options)
    elif now.mono > before.at + timeout_of(state, options):
        state.high_latency = rules.returned(before, message, now, options)
    else:
        state.high_latency = rules.following(before, message, now, options)
