"""vehicle.can_arm: whether the arming checks pass in the current mode, by the latest report of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .reason import UNKNOWN

if TYPE_CHECKING:
    from ....interface.status import TriState
    from ..facts import Facts


def can_arm(facts: Facts) -> TriState:
    """What the report says; UNKNOWN while SYS_STATUS contradicts it.

    PX4 reports at most every 2 s, and SYS_STATUS may be newer. For an armed vehicle SYS_STATUS shows something else:
    whether the mode can continue.
    """
    reported, shown = facts.arming.can_arm, facts.sys_status.ready
    if facts.armed or not facts.fresh.sys_status or UNKNOWN in (reported, shown):
        return reported
    return reported if reported is shown else UNKNOWN
