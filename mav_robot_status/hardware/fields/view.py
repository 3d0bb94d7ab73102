"""One vehicle at one moment, as the functions of the fields see it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface.status import Evidence, TriState
from ...mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES, STATE_NAMES
from ..identity import ARMED, HIL

if TYPE_CHECKING:
    from ...mavlink.definitions import Heartbeat, SysStatus
    from ..memory import Memory
    from ..options import HardwareOptions

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

Finding = tuple[TriState, Evidence]

UNINIT, BOOT, CALIBRATING, STANDBY, CRITICAL, EMERGENCY, POWEROFF = 0, 1, 2, 3, 5, 6, 7  # MAV_STATE
TERMINATED: Final = 8  # FLIGHT_TERMINATION
NOT_MOVING_STATES: Final = frozenset({BOOT, CALIBRATING, EMERGENCY, POWEROFF, TERMINATED})


class View(NamedTuple):
    """One vehicle at one moment, as the field functions see it."""

    memory: Memory
    now: float
    options: HardwareOptions
    heartbeat: Heartbeat
    heard_at: float
    status: SysStatus | None
    """The latest SYS_STATUS if it is fresh."""
    status_at: float | None

    @property
    def armed(self) -> bool:
        """The only armed indication that exists."""
        return bool(self.heartbeat.base_mode & ARMED)

    @property
    def hil(self) -> bool:
        """Hardware in the loop: the actuators are blocked."""
        return bool(self.heartbeat.base_mode & HIL) and not self.options.treat_hil_as_live

    @property
    def state(self) -> int:
        """MAV_STATE."""
        return self.heartbeat.system_status


def named(names: Mapping[int, str], number: int) -> str:
    """MAVLink's name of a number, or the number as text."""
    return names.get(number, str(number))


def sensor_name(bit: int) -> str:
    """MAVLink's name of a SYS_STATUS bit; the extended word's bits count from 32."""
    if bit < 32:
        return SENSOR_NAMES.get(bit, str(bit))
    return EXTENDED_SENSOR_NAMES.get(bit - 32, str(bit - 32))


def beat(view: View, rule: str) -> Evidence:
    """The evidence of a rule that read the state in the heartbeat."""
    return Evidence(rule, f"HEARTBEAT.system_status {named(STATE_NAMES, view.state)}", view.heard_at)
