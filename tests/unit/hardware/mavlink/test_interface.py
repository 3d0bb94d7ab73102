from __future__ import annotations

import logging
import math
from itertools import permutations

import pytest

from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.slots import MOST_PASSING, MOST_VEHICLES
from mav_robot_status.hardware.mavlink.vehicle import ESTABLISHED, ExpectedVehicle
from mav_robot_status.interface import LinkState, RobotStatus, TriState, Vehicle
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.testing import ManualClock

from .driver import Flight, copter, frame_of, px4

BEAT = mav.Heartbeat(4, 2, 3, 129, 4, 3)
NAME = "industrial_robot_status_handle"


def hear(hw: MavlinkRobotHW, *ids: tuple[int, int]) -> None:
    clock = ManualClock()
    for one in ids:
        hw.on_frame(frame_of(BEAT, one), clock.now())
    hw.read(clock.now())


def test_every_autopilot_gets_a_handle_without_configuration() -> None:
    hw = MavlinkRobotHW()
    assert hw.handles.get_names() == []
    hear(hw, (7, 1), (8, 5))
    assert hw.handles.get_names() == [f"{NAME}/7.1", f"{NAME}/8.5"]


@pytest.mark.parametrize("order", list(permutations([(1, 1), (7, 1), (1, 2)])))
def test_the_name_of_a_handle_does_not_depend_on_who_is_heard_first(order: tuple[tuple[int, int], ...]) -> None:
    hw = MavlinkRobotHW()
    hear(hw, *order)
    names = {vehicle.ids: vehicle.handle.name for vehicle in hw.vehicles}
    assert names == {(1, 1): NAME, (7, 1): f"{NAME}/7.1", (1, 2): f"{NAME}/1.2"}


def test_vehicle_1_1_has_the_plain_handle_again_after_its_place_was_taken_away() -> None:
    hw, clock = MavlinkRobotHW(), ManualClock()
    beats(hw, clock, 3, *((1 + n, 1) for n in range(MOST_PASSING + 1)))
    hw.read(clock.advance(5))
    hw.read(clock.advance(10))
    assert hw.handles.get_names() == []
    beats(hw, clock, 1, (9, 1), (1, 1))
    assert hw.handles.get_names() == [f"{NAME}/9.1", NAME]


def test_configured_vehicles_have_their_handles_from_the_start_and_others_are_counted() -> None:
    hw = MavlinkRobotHW(slots=[ExpectedVehicle(1, None, "left"), ExpectedVehicle(2, None, "right")])
    assert hw.handles.get_names() == ["left", "right"]
    assert hw.handles.get_handle("left").detail.link is LinkState.NEVER_SEEN
    hear(hw, (2, 1), (3, 1), (3, 1))
    assert hw.handles.get_handle("right").detail.link is LinkState.CONNECTED
    assert hw.handles.get_handle("left").detail.link is LinkState.NEVER_SEEN
    assert hw.ignored == 2


def test_an_exact_vehicle_entry_takes_precedence_over_a_general_one() -> None:
    hw = MavlinkRobotHW(slots=[ExpectedVehicle(None, None, "any"), ExpectedVehicle(5, None, "five")])
    hear(hw, (5, 1), (6, 1))
    assert hw.handles.get_handle("five").detail.system == 5
    assert hw.handles.get_handle("any").detail.system == 6


def test_a_name_is_in_the_detail_before_during_and_after_the_link() -> None:
    hw = MavlinkRobotHW(slots=[ExpectedVehicle(1, None, "rover", "Rover-A")])
    handle, clock = hw.handles.get_handle("rover"), ManualClock()
    assert handle.detail.vehicle == Vehicle(name="Rover-A")
    beats(hw, clock, 6, (1, 1))
    assert (handle.detail.vehicle.name, handle.detail.vehicle.type) == ("Rover-A", "QUADROTOR")
    hw.read(clock.advance(10))
    assert (handle.detail.vehicle.name, handle.detail.link) == ("Rover-A", LinkState.LOST)
    hw.forget()
    assert handle.detail.vehicle == Vehicle(name="Rover-A")


def test_the_name_of_exact_ids_goes_before_that_of_a_system() -> None:
    hw = MavlinkRobotHW(names={(1, None): "Rover", (1, 2): "Arm", (5, 1): "Boat"})
    hear(hw, (1, 1), (1, 2), (2, 1), (5, 1))
    assert [handle.detail.vehicle.name for handle in hw.handles] == ["Rover", "Arm", None, "Boat"]


def test_a_name_of_the_command_line_goes_before_that_of_the_file() -> None:
    hw = MavlinkRobotHW(slots=[ExpectedVehicle(1, None, "rover", "old")], names={(1, None): "new"})
    assert hw.handles.get_handle("rover").detail.vehicle.name == "new"


def test_a_vehicle_taken_over_has_the_name_of_the_new_configuration() -> None:
    hw, heir = MavlinkRobotHW(names={(7, None): "old"}), MavlinkRobotHW(names={(7, None): "new"})
    hear(hw, (7, 1))
    heir.adopt(hw)
    heir.read(ManualClock().now())
    assert [handle.detail.vehicle.name for handle in heir.handles] == ["new"]


def test_a_handle_stays_with_its_vehicle() -> None:
    hw = MavlinkRobotHW(slots=[ExpectedVehicle()])
    hear(hw, (5, 1), (6, 1))
    assert hw.handles.get_handle(NAME).detail.system == 5


def test_the_number_of_vehicles_is_bounded() -> None:
    hw = MavlinkRobotHW()
    hear(hw, *((n % 250 + 1, n // 250 + 1) for n in range(MOST_VEHICLES + 10)))
    assert len(list(hw.vehicles)) == MOST_VEHICLES
    assert hw.ignored == 10


def test_only_autopilot_heartbeats_are_returned_to_the_caller() -> None:
    flight = copter()
    now = flight.clock.now()
    assert flight.hw.on_frame(frame_of(BEAT), now) is flight.vehicle
    assert flight.hw.on_frame(frame_of(flight.sys_status()), now) is None
    assert flight.hw.on_frame(frame_of(BEAT._replace(type=6, autopilot=8)), now) is None
    assert flight.hw.on_frame(frame_of(BEAT._replace(type=6, autopilot=8), (255, 190)), now) is None


def test_nothing_is_due_before_the_first_message_and_after_the_loss() -> None:
    hw = MavlinkRobotHW()
    assert hw.next_due() == math.inf
    flight = copter(streams=False).stream("heartbeat", lambda: BEAT)
    flight.wait(ESTABLISHED + 1)
    assert flight.hw.next_due() <= flight.clock.now().mono + 3.5001
    flight.stop().wait(5)
    assert flight.detail.link is LinkState.LOST
    assert flight.hw.next_due() == math.inf


def test_the_loss_is_detected_when_due_and_not_before() -> None:
    flight = copter(streams=False).hb()
    lost_at = None
    for _ in range(100):
        flight.hw.read(flight.clock.now())
        if flight.detail.link is LinkState.LOST:
            lost_at = flight.clock.now().mono
            break
        flight.clock.advance(max(flight.hw.next_due() - flight.clock.now().mono, 1e-6))
        flight.hw.due_requests(flight.clock.now())
    assert lost_at == pytest.approx(1003.5, abs=1e-3)


def test_a_loss_and_a_return_are_one_log_line_each(caplog: pytest.LogCaptureFixture) -> None:
    flight = copter()
    with caplog.at_level(logging.INFO):
        flight.hb().stop().wait(10)
        flight.resume().wait(10)
    lines = [record.message for record in caplog.records if "vehicle 1.1" in record.message]
    assert [line for line in lines if "requesting" not in line] == [
        "heard vehicle 1.1 (ARDUPILOTMEGA, QUADROTOR): handle 'industrial_robot_status_handle'",
        "lost vehicle 1.1: nothing for 3.5 s",
        "vehicle 1.1 is back",
    ]


def test_a_lost_link_is_an_error_only_if_configured_and_keeps_its_start_time() -> None:
    flight = copter(options=HardwareOptions(link_loss_is_error=True))
    flight.hb().wait(ESTABLISHED + 1)
    flight.stop().wait(4)
    assert flight.status == RobotStatus(in_error=TriState.TRUE, error_code=9001)
    since = flight.detail.errors[0].since_us
    flight.text("still talking", 6).wait(10)
    flight.text("still talking", 6)
    assert flight.detail.errors[0].since_us == since


def test_a_new_segment_starts_without_previous_messages(caplog: pytest.LogCaptureFixture) -> None:
    flight = Flight().stream("system_time", lambda: flight.system_time())
    flight.wait(3)
    flight.reboot().wait(3.1)
    assert flight.vehicle.boots == 1
    flight.hw.forget()
    handle = flight.vehicle.handle
    assert (handle.status, handle.detail.link, handle.heard_at) == (RobotStatus(), LinkState.NEVER_SEEN, None)
    flight.hw.read(flight.clock.now())
    assert (handle.status, handle.detail.link, handle.heard_at) == (RobotStatus(), LinkState.NEVER_SEEN, None)
    caplog.clear()
    with caplog.at_level(logging.INFO):
        flight.hb()
    assert (flight.status.drives_powered, flight.vehicle.boots) == (TriState.FALSE, 0)
    assert "rebooted" not in caplog.text


def test_vehicles_not_kept_are_forgotten_and_the_others_continue() -> None:
    hw = MavlinkRobotHW()
    hear(hw, (7, 1), (8, 5))
    hw.forget(keep={(8, 5)})
    first, second = (hw.handles.get_handle(name) for name in hw.handles.get_names())
    assert (first.status, first.detail.link) == (RobotStatus(), LinkState.NEVER_SEEN)
    assert (second.status.drives_powered, second.detail.link) == (TriState.TRUE, LinkState.CONNECTED)
    assert hw.deadline < math.inf


def test_vehicles_taken_over_have_their_statuses_at_once_and_continue() -> None:
    flight = copter()
    flight.wait(3)
    before = flight.vehicle.handle
    heir = MavlinkRobotHW(HardwareOptions(), [ExpectedVehicle(1, None, "copter")])
    heir.adopt(flight.hw)
    handle = heir.handles.get_handle("copter")
    assert (handle.status, handle.detail, handle.heard_at) == (before.status, before.detail, before.heard_at)
    heir.read(flight.clock.now())
    assert (handle.status, handle.detail.vehicle) == (before.status, before.detail.vehicle)
    late = flight.clock.advance(10.0)
    heir.read(late)
    assert handle.detail.link is LinkState.LOST


def test_a_vehicle_taken_over_keeps_its_name() -> None:
    hw, heir, third = MavlinkRobotHW(), MavlinkRobotHW(), MavlinkRobotHW()
    hear(hw, (7, 1), (8, 5))
    hw.forget(keep={(8, 5)})
    heir.adopt(hw)
    assert heir.handles.get_names() == [f"{NAME}/8.5"]
    hear(heir, (7, 1))
    third.adopt(heir)
    assert third.handles.get_names() == [f"{NAME}/8.5", f"{NAME}/7.1"]


def test_a_vehicle_that_is_no_longer_expected_is_not_taken_over() -> None:
    hw = MavlinkRobotHW()
    hear(hw, (7, 1))
    heir = MavlinkRobotHW(slots=[ExpectedVehicle(8, None, "eight")])
    heir.adopt(hw)
    assert list(heir.vehicles) == []
    assert heir.handles.get_handle("eight").detail.link is LinkState.NEVER_SEEN


def test_a_mavlink_1_frame_is_handled_like_a_mavlink_2_frame() -> None:
    flight = px4(streams=False)
    (frame,) = Parser({0}).feed(encode(BEAT, system=1, component=1, sequence=0, version=1))
    flight.hw.on_frame(frame, flight.clock.now())
    flight.look()
    assert flight.status.drives_powered is TriState.TRUE


def beats(hw: MavlinkRobotHW, clock: ManualClock, seconds: float, *ids: tuple[int, int]) -> None:
    """Heartbeats of these vehicles once a second; at the end a `read`."""
    for _ in range(round(seconds)):
        for one in ids:
            hw.on_frame(frame_of(BEAT, one), clock.now())
        hw.read(clock.now())
        clock.advance(1.0)
    hw.read(clock.now())


def test_a_vehicle_heard_briefly_stays_as_lost() -> None:
    hw, clock = MavlinkRobotHW(), ManualClock()
    beats(hw, clock, 3, (7, 1))
    clock.advance(1000)
    hw.read(clock.now())
    hw.read(clock.now())
    assert hw.handles.get_handle(f"{NAME}/7.1").detail.link is LinkState.LOST
    assert hw.next_due() == math.inf


def test_many_vehicles_heard_briefly_give_up_their_places_and_their_handles() -> None:
    hw, clock = MavlinkRobotHW(), ManualClock()
    beats(hw, clock, 3, *((7 + n, 1) for n in range(MOST_PASSING + 1)))
    handle = hw.handles.get_handle(f"{NAME}/7.1")
    clock.advance(5)
    hw.read(clock.now())
    assert handle.detail.link is LinkState.LOST
    assert hw.next_due() <= clock.now().mono + 10
    clock.advance(10)
    hw.read(clock.now())
    assert hw.handles.get_names() == []
    assert (handle.status, handle.detail.link) == (RobotStatus(), LinkState.NEVER_SEEN)
    assert hw.next_due() == math.inf
    beats(hw, clock, 1, (8, 1))
    assert hw.handles.get_names() == [f"{NAME}/8.1"]


def test_a_vehicle_that_was_there_stays_as_lost() -> None:
    hw, clock = MavlinkRobotHW(), ManualClock()
    beats(hw, clock, ESTABLISHED + 2, (7, 1))
    clock.advance(1000)
    hw.read(clock.now())
    assert hw.handles.get_handle(f"{NAME}/7.1").detail.link is LinkState.LOST


def test_a_new_vehicle_gets_the_place_of_the_one_that_is_silent_longest() -> None:
    hw, clock = MavlinkRobotHW(), ManualClock()
    ghosts = [(n % 250 + 2, n // 250 + 1) for n in range(MOST_VEHICLES)]
    beats(hw, clock, 1, *ghosts)
    beats(hw, clock, 8, *ghosts[1:], (1, 1))
    assert hw.find(*ghosts[0]) is None
    assert hw.find(1, 1) is not None
    assert len(list(hw.vehicles)) == MOST_VEHICLES


def test_the_open_entry_of_a_vehicle_heard_briefly_is_free_for_another() -> None:
    hw, clock = MavlinkRobotHW(slots=[ExpectedVehicle(handle="crane")]), ManualClock()
    beats(hw, clock, 2, (7, 1))
    clock.advance(60)
    hw.read(clock.now())
    assert hw.handles.get_handle("crane").detail.link is LinkState.LOST
    beats(hw, clock, 5, (1, 1))
    assert hw.handles.get_handle("crane").detail.system == 1


def test_the_open_entry_of_a_vehicle_that_was_there_is_nobody_elses() -> None:
    hw, clock = MavlinkRobotHW(slots=[ExpectedVehicle(handle="crane")]), ManualClock()
    beats(hw, clock, ESTABLISHED + 2, (7, 1))
    clock.advance(60)
    hw.read(clock.now())
    beats(hw, clock, 5, (1, 1))
    assert hw.handles.get_handle("crane").detail.system == 7
