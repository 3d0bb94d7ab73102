"""Asks an autopilot why it cannot be armed: MAV_CMD_RUN_PREARM_CHECKS, once per connection and boot.

Without this a gateway that connects waits for the reasons: ArduPilot repeats them every 30 s, PX4 reports only changes.
The checks change nothing on the vehicle (`GCS_MAVLINK::handle_command_run_prearm_checks`; PX4 sends its last report
again). An armed vehicle is never asked: nothing is said about the checks in flight. A lost command is not repeated.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink import definitions as mav
from ....mavlink.enumerations import MAV_CMD_RUN_PREARM_CHECKS

if TYPE_CHECKING:
    from ..vehicle import TrackedVehicle

LISTEN: Final = 3.0
"""Seconds from the first heartbeat in which a PX4 may report by itself."""


def is_wanted(tracked: TrackedVehicle, now: float) -> bool:
    """Whether the vehicle is disarmed beyond doubt, can be asked, and has not said whether, or why, its checks fail."""
    state, facts = tracked.state, tracked.facts
    if state is None or not facts or not state.profile.requests.prearm_checks:
        return False
    if state.heartbeats.armed or tracked.handle.status.drives_powered is not TriState.FALSE:
        return False
    if state.profile.texts.sends_events:
        return not state.arming.chunks and now >= state.heartbeats.since.mono + LISTEN
    return facts.fresh.sys_status and facts.sys_status.ready is TriState.FALSE


def command(ids: tuple[int, int]) -> mav.CommandLong:
    """The command for the autopilot with these ids."""
    return mav.CommandLong(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, MAV_CMD_RUN_PREARM_CHECKS, *ids, confirmation=0)
