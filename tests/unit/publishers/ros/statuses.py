"""Statuses for the tests of ROS messages."""

from __future__ import annotations

from hypothesis import strategies as st

from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    NotReady,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
MOVABLE = RobotStatus(
    mode=RobotMode.AUTO, e_stopped=FALSE, drives_powered=TRUE, motion_possible=TRUE, in_motion=FALSE, in_error=FALSE
)
HEARD = Detail(1, 1)
DISARMED = Detail(1, 1, inhibits=(Inhibit("DISARMED", None, 1), Inhibit("PREARM_FAILING", "PreArm: Bad fix", 2)))
BLOCKED = MOVABLE._replace(drives_powered=FALSE, motion_possible=FALSE)
FAILING = MOVABLE._replace(in_error=TRUE, error_code=2001)
RADIO = Detail(1, 1, errors=(ErrorCause(2001, "RADIO_FAILSAFE", "Radio Failsafe", 1), ErrorCause(2003, "LOW", None, 1)))

_text = st.text(max_size=20)
_tri_states = st.sampled_from(TriState)
_codes = st.integers(-(2**31), 2**31 - 1)
_statuses = st.builds(
    RobotStatus, st.sampled_from(RobotMode), _tri_states, _tri_states, _tri_states, _tri_states, _tri_states, _codes
)
_details = st.builds(
    Detail,
    errors=st.lists(st.builds(ErrorCause, _codes, _text, st.none() | _text, st.just(0)), max_size=4).map(tuple),
    inhibits=st.lists(st.builds(Inhibit, _text, st.none() | _text, st.just(0)), max_size=4).map(tuple),
    vehicle=st.builds(Vehicle, flight_mode=st.none() | _text),
    link=st.sampled_from(LinkState),
    members=st.lists(_text, max_size=2).map(tuple),
    not_ready=st.lists(st.builds(NotReady, _text, _text), max_size=2).map(tuple),
)
messages = st.builds(
    RobotStatusMsg, _text, st.integers(0, 2**31 * 1_000_000 - 1), _statuses, _details, st.none() | st.just(0.1)
)
"""Every status that the types allow, also impossible ones."""


def message(
    status: RobotStatus = MOVABLE, detail: Detail = HEARD, handle: str = "rover", unix_us: int = 1_800_000_000_123_456
) -> RobotStatusMsg:
    return RobotStatusMsg(handle, unix_us, status, detail, 0.1)
