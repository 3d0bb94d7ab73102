"""Hardware in the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....mavlink.enumerations import MAV_MODE_FLAG_HIL_ENABLED

if TYPE_CHECKING:
    from ..facts import Facts
    from ..options import HardwareOptions


def is_simulated(facts: Facts) -> bool:
    """Whether the autopilot reports hardware-in-the-loop simulation."""
    return bool(facts.heartbeat.base_mode & MAV_MODE_FLAG_HIL_ENABLED)


def actuators_blocked(facts: Facts, options: HardwareOptions) -> bool:
    """Whether the simulation blocks the actuators."""
    return is_simulated(facts) and not options.treat_hil_as_live
