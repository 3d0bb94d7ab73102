"""What a group says step by step, as data: one part changes, and the group follows at the next read."""

from __future__ import annotations

from typing import Final, NamedTuple

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.combined import CombinedRobotHW
from mav_robot_status.hardware.group import Group
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    IndustrialRobotStatusHandle,
    Inhibit,
    LinkState,
    RobotHW,
    RobotMode,
    RobotStatus,
    TriState,
)

MODES: Final = {"A": RobotMode.AUTO, "M": RobotMode.MANUAL, "?": RobotMode.UNKNOWN}
WORDS: Final = {"1": TriState.TRUE, "0": TriState.FALSE, "?": TriState.UNKNOWN}
LINKS: Final = {"LINK_STALE": LinkState.LOST, "NEVER_SEEN": LinkState.NEVER_SEEN}


class Says(NamedTuple):
    """A status in short: mode, e_stopped, drives_powered, motion_possible, in_motion, in_error; then why."""

    fields: str
    inhibits: str = ""
    """Names. LINK_STALE and NEVER_SEEN are the state of the link too."""
    code: int = 0

    @property
    def status(self) -> RobotStatus:
        return RobotStatus._make((MODES[self.fields[0]], *(WORDS[sign] for sign in self.fields[1:]), self.code))


READY, DRIVES, REACHES = Says("A01100"), Says("A01110"), Says("A01110")
PARKED: Final = Says("M00000", "DISARMED")
STOPPED: Final = Says("A10000", "E_STOPPED")
BRAKES: Final = Says("A01000", "BRAKES_ENGAGED")
BY_HAND: Final = Says("M01110")
LOST, UNSEEN = Says("??????", "LINK_STALE"), Says("??????", "NEVER_SEEN")
FAILED: Final = Says("A01001", "PROTECTIVE_STOP", 8001)
SILENT: Final = Says("A01000")
"""It cannot move and does not say why."""

Step = tuple[str, Says, Says]
"""The part that changes, what it says now, and what the group says then."""

SEQUENCES: Final[dict[str, tuple[Step, ...]]] = {
    "a day of work": (
        ("base", PARKED, Says("M?????", "base:DISARMED arm:NEVER_SEEN")),
        ("arm", READY, Says("M01100")),
        ("base", READY, Says("A01100")),
        ("base", DRIVES, Says("A01110")),
        ("base", READY, Says("A01100")),
        ("arm", REACHES, Says("A01110")),
        ("arm", READY, Says("A01100")),
        ("base", PARKED, Says("M01100")),
        ("arm", PARKED, Says("M00000", "base:DISARMED arm:DISARMED")),
    ),
    "the arm is stopped while the base drives": (
        ("base", DRIVES, Says("??111?")),
        ("arm", REACHES, Says("A01110")),
        ("arm", STOPPED, Says("A?1110")),
        ("base", READY, Says("A?1100")),
        ("arm", BRAKES, Says("A01100")),
        ("arm", READY, Says("A01100")),
    ),
    "both are stopped, and released one after the other": (
        ("base", STOPPED, Says("??????", "base:E_STOPPED arm:NEVER_SEEN")),
        ("arm", STOPPED, Says("A10000", "base:E_STOPPED arm:E_STOPPED")),
        ("base", READY, Says("A?1100")),
        ("arm", READY, Says("A01100")),
    ),
    "the base is lost while the arm works": (
        ("base", READY, Says("??11??")),
        ("arm", REACHES, Says("A01110")),
        ("base", LOST, Says("??111?")),
        ("arm", READY, Says("??11??")),
        ("base", READY, Says("A01100")),
    ),
    "a stop of one part proves nothing of a lost one": (
        ("base", READY, Says("??11??")),
        ("arm", STOPPED, Says("A?1100")),
        ("base", LOST, Says("??????", "base:LINK_STALE arm:E_STOPPED")),
        ("arm", LOST, Says("??????", "base:LINK_STALE arm:LINK_STALE")),
        ("base", DRIVES, Says("??111?")),
        ("arm", STOPPED, Says("A?1110")),
    ),
    "a person takes the arm by hand": (
        ("base", READY, Says("??11??")),
        ("arm", READY, Says("A01100")),
        ("arm", BY_HAND, Says("M01110")),
        ("base", LOST, Says("M?111?")),
    ),
    "the arm fails and recovers": (
        ("base", READY, Says("??11??")),
        ("arm", FAILED, Says("A01101", "", 8001)),
        ("base", LOST, Says("??1??1", "base:LINK_STALE arm:PROTECTIVE_STOP", 8001)),
        ("arm", READY, Says("??11??")),
        ("base", READY, Says("A01100")),
    ),
    "a part that gives no reason": (
        ("base", PARKED, Says("M?????", "base:DISARMED arm:NEVER_SEEN")),
        ("arm", SILENT, Says("M01000", "base:DISARMED arm:MOTION_NOT_POSSIBLE")),
        ("base", LOST, Says("??1???", "base:LINK_STALE arm:MOTION_NOT_POSSIBLE")),
        ("arm", READY, Says("??11??")),
    ),
}


class Part(RobotHW):
    """A robot that says what a step tells it to say."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.robot = IndustrialRobotStatusHandle(name)
        self.handles.register_handle(self.robot)
        self.says = UNSEEN

    def read(self, now: Instant) -> None:
        says = self.says
        inhibits = tuple(Inhibit(name, None, now.unix_us) for name in says.inhibits.split())
        errors = (ErrorCause(says.code, "CAUSE", None, now.unix_us),) if says.code else ()
        link = LINKS.get(says.inhibits, LinkState.CONNECTED)
        self.set_status(self.robot, says.status, Detail(errors=errors, inhibits=inhibits, link=link))


@pytest.mark.parametrize("name", SEQUENCES)
def test_a_group_follows_its_members_step_by_step(name: str) -> None:
    parts = {"base": Part("base"), "arm": Part("arm")}
    robot = CombinedRobotHW(tuple(parts.values()), [Group("robot", ("base", "arm"))])
    (handle,) = (handle for handle in robot.handles if handle.name == "robot")
    for second, (part, says, expected) in enumerate(SEQUENCES[name]):
        parts[part].says = says
        robot.read(Instant(float(second), second * 1_000_000))
        assert handle.status == expected.status, (second, part)
        assert " ".join(f"{one.handle}:{one.name}" for one in handle.detail.inhibits) == expected.inhibits, (
            second,
            part,
        )
        assert [error.handle for error in handle.detail.errors] == (["arm"] if expected.code else [])


def test_the_reason_of_a_silent_member_keeps_its_time_while_another_one_changes() -> None:
    parts = {"base": Part("base"), "arm": Part("arm")}
    robot = CombinedRobotHW(tuple(parts.values()), [Group("robot", ("base", "arm"))])
    (handle,) = (handle for handle in robot.handles if handle.name == "robot")
    for second, (part, says, _) in enumerate(SEQUENCES["a part that gives no reason"][:3]):
        parts[part].says = says
        robot.read(Instant(float(second), second * 1_000_000))
    assert [one.since_us for one in handle.detail.inhibits] == [2_000_000, 1_000_000]
