from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.estop.outputs import (
    Watch,
    channels,
    heard_outputs,
    heartbeat_arrived,
    hovers,
    is_vetoed,
    proves_stop,
)
from mav_robot_status.hardware.mavlink.heartbeat.state import HeartbeatHistory, first_heartbeat, next_heartbeat
from mav_robot_status.hardware.mavlink.identity import family_of
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink.definitions import Heartbeat

NOW = Instant(1000.0, 1_800_000_000_000_000)
QUAD, HELI, PLANE, ROVER, SUB = 2, 4, 1, 10, 12
STOP, FLYING = (1000,) * 4, (1632,) * 4


class Machine:
    """Heartbeats and outputs of one vehicle; each takes half a second."""

    def __init__(self, vehicle_type: int = QUAD, functions: dict[int, int] | None = None) -> None:
        self.type, self.watch = vehicle_type, Watch(functions=functions or {})
        self.now = NOW
        self.heartbeats: HeartbeatHistory | None = None

    def beat(self, armed: bool, enabled: bool = True, seconds: float = 0.5) -> Machine:
        self.now = later(self.now, seconds)
        before = self.heartbeats
        heartbeat = Heartbeat(0, self.type, 3, 0x81 if armed else 1, 4, 3)
        after = next_heartbeat(before, heartbeat, self.now, True) if before else first_heartbeat(heartbeat, self.now)
        self.heartbeats = after
        heartbeat_arrived(self.watch, after, before, enabled, self.type, self.now.mono)
        return self

    def put(
        self,
        values: tuple[int, ...],
        throttle: float | None = 50,
        speed: float = 0.0,
        vtol: int = 0,
        seconds: float = 0.5,
        throttle_age: float = 0.1,
    ) -> Machine:
        self.now = later(self.now, seconds)
        self.latest = values, throttle, speed, vtol
        assert self.heartbeats is not None
        padded = (*values, *(0,) * 16)[:16]
        falls = hovers(family_of(self.type), self.type, vtol)
        at = self.now.mono
        heard_outputs(self.watch, padded, self.type, self.heartbeats, throttle, at - throttle_age, speed, at, falls)
        return self

    def learn(self, values: tuple[int, ...] = STOP) -> Machine:
        return self.beat(False).put(values).beat(False)

    def fly(self, values: tuple[int, ...] = FLYING) -> Machine:
        return self.beat(True).put(values)

    def judge(self, speed: float = 0.0, after: float = 0.0, turning: float = 0.0, climb: float = 0.0) -> TriState:
        """TRUE held, FALSE driven, UNKNOWN neither. `after` so many seconds the same outputs arrive again."""
        if after:
            self.put(*self.latest, seconds=after)
        watch, family = self.watch, family_of(self.type)
        if watch.driven:
            return TriState.FALSE
        if not watch.held:
            return TriState.UNKNOWN
        if is_vetoed(watch, family, self.type, speed, climb, turning) or not proves_stop(family, self.type, 0):
            return TriState.UNKNOWN
        return TriState.TRUE


def test_a_motor_off_its_stop_value_is_driven() -> None:
    assert Machine().learn().fly().judge() is TriState.FALSE


def test_outputs_back_at_stop_with_throttle_are_held_after_one_second() -> None:
    machine = Machine().learn().fly().put(STOP)
    assert machine.judge(after=0.9) is TriState.UNKNOWN
    assert machine.judge(after=0.1) is TriState.TRUE


def test_one_sample_at_stop_is_not_held_however_long_ago_it_is() -> None:
    machine = Machine(ROVER).learn((0, 0, 1500)).fly((0, 0, 1655)).put((0, 0, 1500))
    machine.put((0, 0, 1655), seconds=2.0)
    assert machine.judge() is TriState.FALSE
    assert not machine.watch.held


def test_a_throttle_from_before_the_stop_does_not_make_a_resting_rover_held() -> None:
    machine = Machine(ROVER).learn((0, 0, 1500)).fly((0, 0, 1655)).put((0, 0, 1500))
    for age in (0.6, 1.1, 1.6, 2.1):
        assert machine.put((0, 0, 1500), throttle_age=age).judge() is TriState.UNKNOWN
    assert machine.put((0, 0, 1500), throttle_age=0.1).judge() is TriState.TRUE


def test_outputs_at_stop_without_throttle_are_not_evidence() -> None:
    assert Machine().learn().fly().put(STOP, throttle=14).judge(after=9) is TriState.UNKNOWN
    assert Machine().learn().fly().put(STOP, throttle=None).judge(after=9) is TriState.UNKNOWN


def test_outputs_near_their_stop_value_are_not_stopped() -> None:
    assert Machine().learn().fly().put((1005, 1000, 995, 1000)).judge(after=1) is TriState.TRUE
    assert Machine().learn().fly().put((1006, 1000, 1000, 1000)).judge(after=9) is TriState.UNKNOWN


def test_outputs_that_never_left_their_stop_value_since_arming_are_not_held() -> None:
    machine = Machine().learn().fly()
    machine.beat(False).put(STOP).beat(False)
    assert machine.beat(True).put(STOP).judge(after=9) is TriState.UNKNOWN


def test_an_assumed_channel_is_ignored_until_throttle_moves_it() -> None:
    rover = Machine(ROVER).learn((1500, 0, 1500)).beat(True)
    assert rover.put((1500, 0, 1655), throttle=0).judge() is TriState.UNKNOWN
    assert rover.put((1500, 0, 1655), throttle=20).judge() is TriState.FALSE


def test_one_of_several_assumed_channels_may_not_be_a_motor() -> None:
    # motors on outputs 9 and up; the assumed motor output drives a gimbal
    one_off = (1632, 1000, 1000, 1000)
    machine = Machine().learn().beat(True).put(one_off, throttle=40)
    assert machine.judge() is TriState.UNKNOWN
    assert machine.put(STOP, throttle=40).judge(after=9) is TriState.UNKNOWN
    known = Machine(functions={n: 32 + n for n in (1, 2, 3, 4)}).learn().beat(True)
    assert known.put(one_off, throttle=0).judge() is TriState.FALSE


def test_several_assumed_channels_that_all_leave_their_stop_value_are_motors() -> None:
    assert Machine().learn().beat(True).put(FLYING, throttle=0).judge() is TriState.FALSE


def test_an_increasing_speed_overrides_the_outputs() -> None:
    copter = Machine().learn().fly().put(STOP)
    assert copter.judge(climb=0.6, after=2) is TriState.UNKNOWN
    assert copter.judge(climb=-3.0, after=2) is TriState.TRUE
    rover = Machine(ROVER).learn((1500, 0, 1500)).fly((1500, 0, 1655)).put((1500, 0, 1500), speed=2.0)
    assert rover.judge(speed=2.2, after=2) is TriState.TRUE
    assert rover.judge(speed=2.6, after=2) is TriState.UNKNOWN


def test_a_rover_with_a_motor_on_each_side_is_not_held_while_it_turns_about_one_of_them() -> None:
    turning = {"speed": 1.0, "after": 2.0, "turning": 0.8}
    both_sticks_full = ((1500, 0, 1500), (1700, 0, 1700), (2000, 0, 1500))
    assumed, known = Machine(ROVER), Machine(ROVER, {1: 73, 3: 74})
    for machine in (assumed, known):
        stop, straight, round_ = both_sticks_full
        machine.learn(stop).fly(straight).put(round_, speed=1.0)
    assert assumed.judge(**turning) is TriState.UNKNOWN
    assert known.judge(**turning) is TriState.FALSE


@pytest.mark.parametrize("vehicle_type", [HELI, SUB])
def test_helicopters_and_subs_are_never_held(vehicle_type: int) -> None:
    functions = {1: 31} if vehicle_type == HELI else {1: 33}
    machine = Machine(vehicle_type, functions).learn().fly()
    assert machine.judge() is TriState.FALSE
    assert machine.put(STOP).judge(after=9) is TriState.UNKNOWN


def test_a_stop_value_is_learnt_only_between_two_near_disarmed_heartbeats_with_outputs_enabled() -> None:
    assert set(Machine().learn().watch.stop.values()) == {1000}
    assert Machine().beat(False).put(STOP).beat(False, enabled=False).watch.stop == {}
    assert Machine().beat(False).put(STOP).beat(False, seconds=4).watch.stop == {}
    assert Machine().beat(False).put(STOP).beat(True).watch.stop == {}
    assert Machine().beat(True).put(STOP).beat(False).beat(False).watch.stop == {}


def test_a_disabled_output_does_not_set_a_stop_value() -> None:
    assert Machine().learn((0, 0, 0, 0)).watch.stop == {}
    assert Machine().learn((0, 0, 0, 0)).fly().judge() is TriState.UNKNOWN


def test_disarming_ends_the_evidence_of_the_outputs() -> None:
    machine = Machine().learn().fly().put(STOP).beat(False).put(STOP)
    assert machine.judge(after=9) is TriState.UNKNOWN


def test_channels_come_from_the_parameters_or_else_from_the_vehicle_type() -> None:
    assert channels(Watch(), QUAD) == ((1, 2, 3, 4), True)
    assert channels(Watch(), ROVER) == ((3,), True)
    assert channels(Watch(), PLANE) == ((3,), True)
    assert channels(Watch(), SUB) == ((1, 2, 3, 4, 5, 6), True)
    skid = Watch(functions={1: 73, 2: 0, 3: 74})
    assert channels(skid, ROVER) == ((1, 3), False)
    assert channels(Watch(functions={1: 33, 8: 31}), HELI) == ((8,), False)
