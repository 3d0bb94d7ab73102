"""The status of a group: every rule over all combinations of its members, and its invariants over random ones."""

from __future__ import annotations

import itertools
import json
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.group import RULES, Combined, Group, Member, Rule, combine, last_heard
from mav_robot_status.hardware.join import Logic
from mav_robot_status.interface import (
    GROUP,
    Detail,
    ErrorCause,
    Evidence,
    Inhibit,
    LinkState,
    NotReady,
    RobotMode,
    RobotStatus,
    TriState,
    validate,
)
from mav_robot_status.language import headline
from mav_robot_status.publishers.json_lines import native_body

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
MANUAL, AUTO = RobotMode.MANUAL, RobotMode.AUTO
ROBOT: Final = Group("robot", component=192)
NOW: Final = 1_000_000


def member(name: str, status: RobotStatus, detail: Detail | None = None, heard_at: float | None = 1.0) -> Member:
    evidence = {"e_stopped": Evidence(f"the word of {name}", "its message", 0.5)}
    return Member(name, status, detail or Detail(), heard_at, evidence)


def of(*statuses: RobotStatus, group: Group = ROBOT) -> Combined:
    members = [member("abc"[place], status) for place, status in enumerate(statuses)]
    return combine(group, members, Detail(), NOW)


def with_field(field: str, value: Any) -> RobotStatus:
    """A status of which only this field is known."""
    return RobotStatus()._replace(**{field: value})


def oracle(field: str, values: tuple[TriState, ...]) -> TriState:
    """The table of rules in words, for the tri-states."""
    if field == "e_stopped":
        return values[0] if len(set(values)) == 1 else UNKNOWN
    return TRUE if TRUE in values else FALSE if set(values) == {FALSE} else UNKNOWN


@pytest.mark.parametrize("field", [field for field in RULES if field != "mode"])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_every_combination_of_members_follows_the_rule_of_the_field(field: str, size: int) -> None:
    for values in itertools.product(TriState, repeat=size):
        statuses = [with_field(field, value) for value in values]
        assert getattr(of(*statuses).status, field) is oracle(field, values), values


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_person_with_one_part_in_hand_makes_it_manual(size: int) -> None:
    for modes in itertools.product(RobotMode, repeat=size):
        expected = MANUAL if MANUAL in modes else AUTO if set(modes) == {AUTO} else RobotMode.UNKNOWN
        assert of(*map(RobotStatus, modes)).status.mode is expected, modes


@pytest.mark.parametrize("field", RULES)
def test_the_order_of_members_does_not_matter(field: str) -> None:
    values: list[Any] = list(RobotMode) if field == "mode" else list(TriState)
    for pair in itertools.product(values, repeat=2):
        forth, back = (of(*(with_field(field, value) for value in found)).status for found in (pair, pair[::-1]))
        assert forth == back


def test_another_rule_can_be_chosen_for_a_field() -> None:
    rover, arm = RobotStatus(drives_powered=TRUE, in_motion=TRUE), RobotStatus(drives_powered=FALSE, in_motion=FALSE)
    group = Group("robot", rules={"drives_powered": Rule(Logic.ALL), "in_motion": Rule(Logic.ANY, of="b")})
    assert of(rover, arm).status[2:5:2] == (TRUE, TRUE)
    assert of(rover, arm, group=group).status[2:5:2] == (FALSE, FALSE)


def test_a_rule_of_a_member_that_is_not_there_is_unknown() -> None:
    group = Group("robot", rules={"in_motion": Rule(Logic.ANY, of="z")})
    found = of(RobotStatus(in_motion=TRUE), group=group)
    assert found.status.in_motion is UNKNOWN
    assert found.evidence["in_motion"].rule == "no member of the group knows"


def test_a_group_without_members_knows_nothing() -> None:
    found = of()
    assert found.status == RobotStatus()
    assert found.detail.link is LinkState.NEVER_SEEN


def test_a_stopped_member_proves_nothing_of_a_lost_one() -> None:
    lost = Detail(inhibits=(Inhibit("LINK_STALE", None, 5),), link=LinkState.LOST)
    stopped = RobotStatus(e_stopped=TRUE, drives_powered=FALSE, motion_possible=FALSE)
    why = Detail(inhibits=(Inhibit("E_STOPPED", "the red button", 7),))
    base, arm = member("base", RobotStatus(), lost), member("arm", stopped, why)
    status, detail, _ = combine(ROBOT, [base, arm], Detail(), NOW)
    assert status == RobotStatus()
    assert detail.link is LinkState.CONNECTED
    assert [(i.handle, i.name, i.text, i.since_us) for i in detail.inhibits] == [
        ("base", "LINK_STALE", None, 5),
        ("arm", "E_STOPPED", "the red button", 7),
    ]


@pytest.mark.parametrize(
    ("links", "expected"),
    [
        ((LinkState.LOST, LinkState.CONNECTED), LinkState.CONNECTED),
        ((LinkState.LOST, LinkState.NEVER_SEEN), LinkState.LOST),
        ((LinkState.NEVER_SEEN, LinkState.NEVER_SEEN), LinkState.NEVER_SEEN),
    ],
)
def test_the_link_of_a_group_is_that_of_its_best_member(links: tuple[LinkState, ...], expected: LinkState) -> None:
    members = [member(str(place), RobotStatus(), Detail(link=link)) for place, link in enumerate(links)]
    assert combine(ROBOT, members, Detail(), NOW).detail.link is expected


def test_the_errors_of_all_members_are_listed_with_the_most_important_of_each_first() -> None:
    def failing(name: str, *codes: int) -> Member:
        errors = tuple(ErrorCause(code, f"CAUSE_{code}", None, code) for code in codes)
        return member(name, RobotStatus(in_error=TRUE, error_code=codes[0]), Detail(errors=errors))

    status, detail, _ = combine(ROBOT, [failing("base", 2001, 3025), failing("arm", 8001)], Detail(), NOW)
    assert (status.in_error, status.error_code) == (TRUE, 2001)
    assert [(e.handle, e.code) for e in detail.errors] == [("base", 2001), ("arm", 8001), ("base", 3025)]


def test_what_a_group_on_another_gateway_says_of_its_members_stays() -> None:
    arm = Inhibit("E_STOPPED", None, 5, handle="arm")
    cell = member("cell", RobotStatus(motion_possible=FALSE), Detail(inhibits=(arm,)))
    assert combine(ROBOT, [cell], Detail(), NOW).detail.inhibits == (arm,)


def test_a_member_that_gives_no_reason_gets_one_that_keeps_its_time() -> None:
    silent = member("arm", RobotStatus(motion_possible=FALSE))
    first = combine(ROBOT, [silent], Detail(), NOW).detail
    assert first.inhibits == (Inhibit("MOTION_NOT_POSSIBLE", None, NOW, "arm"),)
    assert combine(ROBOT, [silent], first, NOW + 5).detail == first


def test_the_evidence_names_the_member_that_decided() -> None:
    stopped = RobotStatus(e_stopped=TRUE)
    assert of(stopped, stopped).evidence["e_stopped"] == Evidence("a, and 1 more: the word of a", "its message", 0.5)
    found = of(stopped, RobotStatus(), stopped)
    assert found.evidence["e_stopped"] == Evidence("b: the word of b", "its message", 0.5)
    assert found.evidence["in_motion"] == Evidence("a, and 2 more", None, 1.0)


def test_a_group_has_the_system_id_of_its_first_vehicle_and_a_component_of_its_own() -> None:
    members = [member("arm", RobotStatus()), member("base", RobotStatus(), Detail(7, 1))]
    detail = combine(ROBOT, members, Detail(), NOW).detail
    assert (detail.system, detail.component, detail.vehicle.type) == (7, 192, GROUP)
    assert combine(ROBOT, members[:1], Detail(), NOW).detail.component is None
    assert detail.members == ("arm", "base")


@pytest.mark.parametrize(
    ("heard", "expected"), [((3.0, 1.0, 2.0), 1.0), ((3.0, None), None), ((), None), ((None,), None)]
)
def test_a_group_is_as_old_as_its_oldest_member(heard: tuple[float | None, ...], expected: float | None) -> None:
    assert last_heard(heard) == expected


tri_states = st.sampled_from(TriState)


@st.composite
def members(draw: st.DrawFn) -> Member:
    """A valid member."""
    name = draw(st.sampled_from("abcd"))
    link = draw(st.sampled_from(LinkState))
    if link is not LinkState.CONNECTED:
        return member(name, RobotStatus(), Detail(inhibits=(Inhibit("LINK_STALE", None, 1),), link=link), None)
    stopped, powered, possible = draw(tri_states), draw(tri_states), draw(tri_states)
    if stopped is TRUE:
        powered = FALSE
    if powered is FALSE:
        possible = FALSE
    codes = draw(st.lists(st.integers(1, 9999), max_size=3))
    wrong = TRUE if codes else draw(st.sampled_from([FALSE, UNKNOWN]))
    mode = draw(st.sampled_from(RobotMode))
    status = RobotStatus(mode, stopped, powered, possible, draw(tri_states), wrong, codes[0] if codes else 0)
    reasons = draw(st.lists(st.sampled_from(["DISARMED", "E_STOPPED"]), max_size=2)) if possible is not TRUE else []
    detail = Detail(
        draw(st.none() | st.integers(1, 255)),
        errors=tuple(ErrorCause(code, "CAUSE", None, 1) for code in codes),
        inhibits=tuple(Inhibit(reason, None, 1) for reason in reasons),
    )
    assert validate(status, detail) is None
    return member(name, status, detail)


def rules() -> st.SearchStrategy[dict[str, Rule]]:
    one = st.builds(Rule, st.sampled_from(Logic), st.none() | st.sampled_from("abcd"))
    return st.dictionaries(st.sampled_from(list(RULES)), one)


@given(st.lists(members(), max_size=4), rules())
def test_the_invariants_of_a_group_hold_for_all_members_and_rules(found: list[Member], chosen: dict[str, Rule]) -> None:
    status, detail, evidence = combine(ROBOT._replace(rules=chosen), found, Detail(), NOW)
    if found:
        assert validate(status, detail) is None
    if status.motion_possible is FALSE:
        assert detail.inhibits
    assert evidence.keys() == RULES.keys()


@given(st.lists(members(), min_size=1, max_size=4))
def test_what_a_group_knows_no_unknown_member_can_refute(found: list[Member]) -> None:
    """Kleene logic is monotonic: whatever an unknown field turns out to be, a known field of the group stays."""
    known = combine(ROBOT, found, Detail(), NOW).status
    for value in (TRUE, FALSE):
        refined = [
            one._replace(status=RobotStatus(*(value if v is UNKNOWN else v for v in one.status)))  # type: ignore[arg-type]
            for one in found
        ]
        after = combine(ROBOT, refined, Detail(), NOW).status
        for field in RULES:
            before = getattr(known, field)
            if before.name != "UNKNOWN" and field != "mode":
                assert getattr(after, field) is before


def parts(link: LinkState = LinkState.CONNECTED, *, errors: str = "", inhibits: str = "") -> Detail:
    causes = tuple(ErrorCause(1, name, None, 1) for name in errors.split())
    return Detail(errors=causes, inhibits=tuple(Inhibit(name, None, 1) for name in inhibits.split()), link=link)


CAN = RobotStatus(e_stopped=FALSE, drives_powered=TRUE, motion_possible=TRUE, in_error=FALSE)
CANNOT = CAN._replace(motion_possible=FALSE)


@pytest.mark.parametrize(
    ("status", "detail", "why"),
    [
        (CAN, parts(), None),
        (CAN._replace(e_stopped=UNKNOWN, in_error=UNKNOWN), parts(), None),
        (RobotStatus(), parts(LinkState.LOST, inhibits="LINK_STALE"), "LINK_STALE"),
        (RobotStatus(), parts(LinkState.NEVER_SEEN), "LINK_STALE"),
        (CANNOT._replace(e_stopped=TRUE, in_error=TRUE), parts(errors="CRASHED", inhibits="DISARMED"), "E_STOPPED"),
        (CAN._replace(in_error=TRUE), parts(errors="RADIO_FAILSAFE BATTERY_LOW"), "RADIO_FAILSAFE"),
        (CANNOT._replace(in_error=TRUE), parts(errors="CRASHED", inhibits="DISARMED"), "CRASHED"),
        (CANNOT, parts(inhibits="DISARMED PREARM_FAILING"), "DISARMED"),
        (CANNOT, parts(), "MOTION_NOT_POSSIBLE"),
        (CAN._replace(motion_possible=UNKNOWN), parts(inhibits="STOP_UNCERTAIN"), "STOP_UNCERTAIN"),
        (CAN._replace(motion_possible=UNKNOWN), parts(), "MOTION_UNKNOWN"),
    ],
)
def test_a_member_is_ready_or_says_why_not(status: RobotStatus, detail: Detail, why: str | None) -> None:
    group = combine(ROBOT, [member("base", CAN), member("arm", status, detail)], Detail(), NOW).detail
    assert group.not_ready == (() if why is None else (NotReady("arm", why),))
    assert group.ready is (why is None)


def test_a_group_without_members_is_not_ready_and_a_single_robot_is_neither() -> None:
    assert of().detail.ready is False
    assert Detail().ready is None


@given(st.lists(members(), min_size=1, max_size=4, unique_by=lambda one: one.name))
def test_no_group_says_safe_while_a_member_that_is_heard_can_move(found: list[Member]) -> None:
    status, detail, _ = combine(ROBOT, found, Detail(), NOW)
    line = json.loads("{" + native_body("robot", status, detail) + "}}")
    for one in found:
        if TRUE in (one.status.motion_possible, one.status.drives_powered, one.status.in_motion):
            for field in ("motion_possible", "drives_powered", "in_motion"):
                assert getattr(status, field) is TRUE or getattr(one.status, field) is not TRUE
            assert status.e_stopped is not TRUE or one.status.e_stopped is TRUE
        if one.status.motion_possible is TRUE:
            assert headline(line).word not in ("EMERGENCY STOP", "READY", "PARKED", "CANNOT ARM")
            assert not detail.inhibits
    everybody = all(one.status.motion_possible is TRUE and one.status.in_error is not TRUE for one in found)
    assert detail.ready is everybody
