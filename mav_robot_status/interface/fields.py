"""The fields of a RobotStatus: one row each, with the meaning of the field and its name on every wire.

`RobotStatus` is the table. Publishers, views, metrics and explanations are made from `FIELDS`; the JSON schema, the
MAVLink dialect and the documents are compared with it by tests. A field keeps its own name in JSON lines, MQTT topics,
metrics (after the prefix `mav_robot_status_`), explanations and reports.

Numbers are those of industrial_msgs: TriState -1/0/1, RobotMode -1/1/2 (0 is not a mode).
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Annotated, Final, NamedTuple, get_args, get_type_hints


class TriState(IntEnum):
    """industrial_msgs/TriState. UNKNOWN never means FALSE."""

    UNKNOWN = -1
    FALSE = 0
    TRUE = 1

    @classmethod
    def of(cls, value: bool | None) -> TriState:
        """TRUE, FALSE, or UNKNOWN for None."""
        return cls.UNKNOWN if value is None else cls.TRUE if value else cls.FALSE


class RobotMode(IntEnum):
    """industrial_msgs/RobotMode: who commands the motion of the robot, a person (MANUAL) or a program (AUTO)."""

    UNKNOWN = -1
    MANUAL = 1
    AUTO = 2

    @classmethod
    def of(cls, automatic: bool | None) -> RobotMode:
        """AUTO, MANUAL, or UNKNOWN for None."""
        return cls.UNKNOWN if automatic is None else cls.AUTO if automatic else cls.MANUAL


class Kind(Enum):
    """What a field holds."""

    MODE = "mode"
    TRI_STATE = "tri-state"
    CODE = "code"


KINDS: Final = {RobotMode: Kind.MODE, TriState: Kind.TRI_STATE, int: Kind.CODE}
SAME: Final = ""
"""The field keeps its own name on this wire."""


class Row(NamedTuple):
    """What `RobotStatus` declares for a field besides its name, type and default. None: not on that wire."""

    meaning: str
    """The meaning of TRUE for a TriState; the meaning of a mode or a code. One line."""
    bits: int | None = None
    """The lower of its two bits in NAMED_VALUE_INT RS_STATE."""
    ros1: str | None = SAME
    """Its name in industrial_msgs/RobotStatus of ROS 1."""
    ros2: str | None = SAME
    """Its name in industrial_msgs/RobotStatus of ROS 2."""
    mavlink: str | None = SAME
    """Its name in ROBOT_STATUS."""


class RobotStatus(NamedTuple):
    """The table: the seven fields of industrial_msgs/RobotStatus. As created, nothing is known."""

    mode: Annotated[RobotMode, Row("Who moves it: a person (MANUAL), a program (AUTO).", 0)] = RobotMode.UNKNOWN
    e_stopped: Annotated[TriState, Row("An emergency stop is engaged.", 2)] = TriState.UNKNOWN
    drives_powered: Annotated[TriState, Row("The robot is armed and nothing blocks its drives.", 4)] = TriState.UNKNOWN
    motion_possible: Annotated[TriState, Row("The robot would execute a motion command.", 6)] = TriState.UNKNOWN
    in_motion: Annotated[TriState, Row("The robot moves, turns or is airborne.", 8)] = TriState.UNKNOWN
    in_error: Annotated[TriState, Row("At least one error cause is active.", 10)] = TriState.UNKNOWN
    error_code: Annotated[int, Row("The most important active cause, 0 if there is none.", ros2="error_codes")] = 0


class Field(NamedTuple):
    """One row of the table, with the name and the kind of its field. All wire names are filled in."""

    name: str
    kind: Kind
    row: Row

    def plain(self, value: int) -> str | bool | int | None:
        """The JSON value: the name of a mode, true, false or null (UNKNOWN), a number."""
        if self.kind is Kind.MODE:
            return RobotMode(value).name
        if self.kind is Kind.TRI_STATE:
            return None if value == TriState.UNKNOWN else bool(value)
        return int(value)

    def word(self, value: int) -> str:
        """The value as a word: the name of the mode or TriState, the number of a code."""
        if self.kind is Kind.MODE:
            return RobotMode(value).name
        return TriState(value).name if self.kind is Kind.TRI_STATE else str(value)


def _field(name: str, hint: object) -> Field:
    kind, row = get_args(hint)
    names = {wire: name for wire in ("ros1", "ros2", "mavlink") if getattr(row, wire) == SAME}
    return Field(name, KINDS[kind], row._replace(**names))


FIELDS: Final = tuple(_field(*item) for item in get_type_hints(RobotStatus, include_extras=True).items())
"""Every field, in the order of `RobotStatus`."""
STATES: Final = tuple(field for field in FIELDS if field.kind is not Kind.CODE)
"""The fields with a few named values. Each has evidence, a column in tables, and a track in reports."""
TRI_STATES: Final = tuple(field for field in FIELDS if field.kind is Kind.TRI_STATE)
UNKNOWN_STATUS: Final = RobotStatus()
"""Nothing is known."""
