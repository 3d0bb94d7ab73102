"""mode: who decides the next motion, a person or a program. The profile interprets the mode numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..autopilots.modes import FlightMode
    from ..facts import Facts
    from ..options import HardwareOptions


def flight_mode(facts: Facts, options: HardwareOptions) -> FlightMode:
    """The flight mode: the site's override, else the meaning in the profile."""
    modes, family = facts.kind.profile.modes, facts.kind.family
    found = modes.flight_mode(facts.heartbeat, family, facts.mode_hints)
    overrides = options.mode_overrides.get(modes.overrides_key or family.value, {})
    override = overrides.get(facts.heartbeat.custom_mode)
    return found if override is None else found._replace(mode=override, rule="mode_overrides")
