"""What is left of a status while another sender claims the ids of the vehicle: only what all senders agree on.

Nobody can tell which of them is the vehicle. A heartbeat shows armed and mode; all else comes from one sender only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode, TriState
from ....values import NamedTuple
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source

if TYPE_CHECKING:
    from ..facts import Claimed

CLAIMED: Final = Reason("another sender claims the ids of this vehicle", Source.CLAIMS)
AGREED: Final = Reason("all senders with the ids of this vehicle agree", Source.CLAIMS)
NOTHING: Final[Finding] = UNKNOWN, CLAIMED


class Agreed(NamedTuple):
    """The fields on which all senders agree, with their reasons."""

    mode: tuple[RobotMode, Reason]
    e_stopped: Finding
    drives_powered: Finding
    motion_possible: Finding
    in_motion: Finding


def agreed(claimed: Claimed, mode: RobotMode, drives: TriState) -> Agreed:
    """The fields of a doubted status. `mode` and `drives` are those of the selected sender."""
    powered = NOTHING
    if claimed.all_disarmed:
        powered = FALSE, AGREED
    elif claimed.all_armed and drives is TRUE:
        powered = TRUE, AGREED
    return Agreed(
        mode=(mode, AGREED) if claimed.one_mode else (RobotMode.UNKNOWN, CLAIMED),
        e_stopped=NOTHING,
        drives_powered=powered,
        motion_possible=powered if powered[0] is FALSE else NOTHING,
        in_motion=NOTHING,
    )
