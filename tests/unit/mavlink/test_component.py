from __future__ import annotations

import logging

import pytest

from mav_robot_status.mavlink.component import COMPONENTS, SENT_KEPT, Component
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser


def parsed(data: bytes) -> Frame:
    (frame,) = Parser({0}).feed(data)
    return frame


def foreign(component: int, system: int = 1, sequence: int = 200) -> Frame:
    return parsed(encode(Heartbeat(0, 18, 8, 0, 4, 3), system=system, component=component, sequence=sequence))


def current(component: Component, system: int = 1) -> tuple[int, int]:
    frame = parsed(component.heartbeat(system))
    return frame.ids


def test_our_heartbeat_is_that_of_a_companion_computer_and_reports_the_error() -> None:
    component = Component()
    calm, alarmed = parsed(component.heartbeat(7)), parsed(component.heartbeat(7, in_error=True))
    assert (*calm.ids, calm.sequence, alarmed.sequence) == (7, 192, 0, 1)
    assert calm.message == Heartbeat(0, 18, 8, 0, 4, 3)
    assert alarmed.message == Heartbeat(0, 18, 8, 0, 5, 3)


def test_our_system_id_can_be_configured() -> None:
    component = Component(100, system=245)
    assert current(component, 7) == (245, 100)
    assert component.system_for(9) == 245


def test_sequences_are_counted_for_each_system() -> None:
    component = Component()
    assert [parsed(component.heartbeat(s)).sequence for s in (1, 2, 1, 2)] == [0, 0, 1, 1]


def test_another_program_with_our_component_makes_us_change_to_the_next() -> None:
    component = Component()
    taken = [current(component)[1]]
    for _ in range(3):
        component.observe(foreign(taken[-1]))
        taken.append(current(component)[1])
    assert taken == list(COMPONENTS)


def test_the_ids_of_a_program_that_sent_before_us_are_avoided_from_the_first_frame() -> None:
    component = Component()
    component.observe(foreign(192))
    component.observe(foreign(193))
    assert current(component) == (1, 194)


def test_if_all_components_are_in_use_ours_stays_and_one_line_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    component = Component()
    current(component)
    for sequence in range(100):
        for number in COMPONENTS:
            component.observe(foreign(number, sequence=sequence + 100))
    last = component.id
    assert last in COMPONENTS
    assert len([r for r in caplog.records if r.levelno == logging.WARNING]) == 4


def test_another_program_in_a_foreign_system_changes_nothing() -> None:
    component = Component()
    current(component, 1)
    component.observe(foreign(192, system=2))
    assert current(component, 1) == (1, 192)


def test_an_echo_of_our_heartbeats_is_not_another_program() -> None:
    component = Component()
    sent = [parsed(component.heartbeat(system)) for _ in range(SENT_KEPT) for system in range(1, 255)]
    for frame in sent:
        component.observe(frame)
    assert component.id == 192


def test_a_late_echo_from_before_the_change_is_still_our_own() -> None:
    component = Component()
    before = parsed(component.heartbeat(1))
    component.observe(foreign(192))
    component.heartbeat(1)
    component.observe(before)
    assert component.id == 193


def test_the_memory_of_other_programs_is_bounded() -> None:
    component = Component()
    for system in range(1, 256):
        for number in range(256):
            component.observe(foreign(number, system))
    assert len(component._others) <= 255 * len(COMPONENTS)


GCS = 6


def station(system: int) -> Frame:
    return parsed(encode(Heartbeat(0, GCS, 8, 0, 4, 3), system=system, component=190, sequence=0))


def test_no_heartbeat_has_the_system_id_of_ground_stations() -> None:
    assert not Component(system=255).may_beat(1)
    assert not Component().may_beat(255)
    assert Component(system=7).may_beat(1)


def test_no_heartbeat_has_the_system_id_of_a_ground_station_that_is_heard(caplog: pytest.LogCaptureFixture) -> None:
    component = Component()
    component.observe(station(1))
    assert [component.may_beat(1), component.may_beat(1), component.may_beat(2)] == [False, False, True]
    assert len(caplog.records) == 1
    for _ in range(62):
        component.pass_second()
    assert component.may_beat(1)
