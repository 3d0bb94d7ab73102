"""Properties that hold for any messages of a vehicle, in any order and at any rate."""

from __future__ import annotations

import copy
import string
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.faults import causes, text_assembly
from mav_robot_status.hardware.mavlink.heartbeat.messages import MOST_MODES
from mav_robot_status.hardware.mavlink.heartbeat.state import RUNS
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import REMEMBERED, VehicleState
from mav_robot_status.hardware.mavlink.subjects import HANDLERS, WANTED_IDS
from mav_robot_status.hardware.mavlink.vehicle import ExpectedVehicle, TrackedVehicle
from mav_robot_status.interface import Detail, IndustrialRobotStatusHandle, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import Parser

from .driver import (
    ARDUPILOT,
    FITTED,
    PLANE,
    PREARM,
    PX4,
    QUAD,
    ROVER,
    Flight,
    Numbers,
    check_invariants,
    check_present,
    copter,
    derived,
    frame_of,
)
from .driver import statustext as text_message

QUICK = settings(max_examples=75, deadline=None, suppress_health_check=list(HealthCheck))

INTEGERS = {"B": (0, 8), "b": (-8, 8), "H": (0, 16), "h": (-16, 16), "I": (0, 32), "i": (-32, 32), "Q": (0, 64)}

# Values that rules test for, in addition to arbitrary ones: masks, modes and states of real vehicles.
TELLING = {
    "type": [0, 1, 2, 4, 5, 6, 7, 10, 11, 12, 18, 20, 43],
    "autopilot": [0, 3, 3, 12, 12, 8, 9],
    "base_mode": [0, 1, 81, 128, 129, 161, 209],
    "system_status": list(range(9)),
    "custom_mode": [0, 4, 5, 15, 16, 4 << 16 | 3 << 24, 10 << 16],
    "onboard_control_sensors_present": [0, FITTED, FITTED | PREARM, 0x0101000F],
    "onboard_control_sensors_enabled": [0, FITTED, FITTED | PREARM, FITTED & ~(1 << 15)],
    "onboard_control_sensors_health": [0, FITTED, FITTED | PREARM, PREARM],
    "severity": list(range(8)),
    "id": [0, 0, 1, 2],
    "chunk_seq": [0, 1, 2, 31, 32],
    "landed_state": [0, 1, 2, 3, 4],
    "time_boot_ms": [0, 100, 5000, 900_000, 2**32 - 1],
    "port": [0, 1],
    "custom0": [1, 81, 209 - 256, -128],
    "eph": [0],
    "epv": [0],
    "climb_rate": [0],
    "custom1": [0],
    "custom2": [0],
}
WORDS = [
    "Radio Failsafe",
    "Radio Failsafe Cleared",
    "Battery 1 is low ",
    "Battery 1 is critical ",
    "Crash: Disarming",
    "PreArm: Motors Emergency Stopped",
    "RC7: MotorEStop HIGH",
    "RC7: MotorEStop LOW",
    "Terminating due to GCS request",
    "Something bad",
    "Failsafe activated\t",
    "Preflight Fail: Attitude failure (roll)",
    "PreArm: Internal errors 0x400 l:1 x",
]


def integers(code: str) -> st.SearchStrategy[int]:
    low, bits = INTEGERS[code]
    return st.integers(-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if low < 0 else st.integers(0, (1 << bits) - 1)


def values(name: str, code: str, size: int) -> st.SearchStrategy[Any]:
    """Any value of one field, or one that a rule tests for."""
    if code == "s":
        raw = st.binary(max_size=size)
        said = st.sampled_from(WORDS).map(str.encode) if name == "text" else st.just(b"SERVO3_FUNCTION")
        return st.one_of(said, raw)
    if code == "f":
        return st.one_of(st.floats(width=32), st.sampled_from([0.0, 0.05, 0.2, 1.0, 33.0]))
    some = integers(code)
    telling = [value for value in TELLING.get(name, []) if value < 1 << INTEGERS[code][1]]
    return st.one_of(st.sampled_from(telling), some) if telling else some


def messages_of(definition: mav.Definition) -> st.SearchStrategy[Any]:
    codes: list[tuple[str, int]] = []
    digits = ""
    for character in definition.layout.format[1:]:
        if character in string.digits:
            digits += character
            continue
        if character == "s":
            codes.append(("s", int(digits)))
        elif character != "x":
            codes += [(character, 1)] * int(digits or 1)
        digits = ""
    fields = [values(name, *code) for name, code in zip(definition.type._fields, codes, strict=True)]
    return st.tuples(*fields).map(definition.type._make)


USED = [definition for definition in mav.MESSAGES.values() if definition.id in WANTED_IDS]
HEARTBEATS = st.builds(
    partial(mav.Heartbeat, mavlink_version=3),
    *(st.sampled_from(TELLING[name]) for name in ("custom_mode", "type", "autopilot", "base_mode", "system_status")),
)
SAME_VEHICLE = HEARTBEATS.map(lambda beat: beat._replace(type=2, autopilot=3))
SENTENCES = st.builds(text_message, st.sampled_from(WORDS), st.integers(0, 7))
MESSAGES = st.one_of(SAME_VEHICLE, SAME_VEHICLE, HEARTBEATS, SENTENCES, st.one_of([messages_of(d) for d in USED]))
STEPS = st.sampled_from([0.0, 0.0, 0.05, 0.3, 0.5, 1.0, 1.0, 2.5, 4.0, 31.0])
FLIGHTS = st.lists(st.tuples(STEPS, MESSAGES), min_size=10, max_size=40)
OPTIONS = st.builds(
    HardwareOptions,
    heartbeat_timeout=st.sampled_from([0.1, 1.5, 3.5]),
    sys_status_timeout=st.sampled_from([0.5, 5.0]),
    hover_is_motion=st.booleans(),
    manual_blocks_motion=st.booleans(),
    estop_unknown_as=st.sampled_from(["unknown", "false"]),
    estop_assume_visible=st.booleans(),
    watch_outputs=st.booleans(),
    link_loss_is_error=st.booleans(),
    treat_hil_as_live=st.booleans(),
    text_hold_s=st.sampled_from([0.0, 10.0]),
    mode_overrides=st.sampled_from([{}, {"copter": {5: RobotMode.AUTO}}]),
    ignore_sensors=st.sampled_from([frozenset(), frozenset({"3D_GYRO", "LEAK"})]),
)
START = Instant(1000.0, 1_800_000_000_000_000)
FIRST = mav.Heartbeat(0, 2, 3, 1, 3, 3)


class Walk:
    """The hardware interface, fed step by step."""

    def __init__(self, options: HardwareOptions) -> None:
        self.hw = MavlinkRobotHW(options, [ExpectedVehicle(1, 1)])
        self.now = START
        self._numbers = Numbers()
        self.take(FIRST)

    def take(self, message: Any, seconds: float = 0.0) -> RobotStatus:
        self.now = later(self.now, seconds)
        self.hw.on_frame(frame_of(message, sequence=self._numbers.next(None)), self.now)
        self.hw.read(self.now)
        return self.status

    @property
    def vehicle(self) -> TrackedVehicle:
        vehicle = self.hw.find(1, 1)
        assert vehicle is not None
        return vehicle

    @property
    def state(self) -> VehicleState:
        assert self.vehicle.state is not None
        return self.vehicle.state

    @property
    def status(self) -> RobotStatus:
        return self._handle.status

    @property
    def _handle(self) -> IndustrialRobotStatusHandle:
        return self.vehicle.handle

    @property
    def detail(self) -> Detail:
        return self._handle.detail


@QUICK
@given(FLIGHTS, OPTIONS)
def test_nothing_raises_and_the_invariants_hold_after_every_step(
    flight: list[tuple[float, Any]], options: HardwareOptions
) -> None:
    walk = Walk(options)
    for seconds, message in flight:
        walk.take(message, seconds)
        check_invariants(walk.status, walk.detail, options)
        silent = derived(walk.state, walk.detail, later(walk.now, 3.6), options)
        check_invariants(silent.status, silent.detail, options)


@QUICK
@given(FLIGHTS, OPTIONS)
def test_only_messages_and_time_change_a_status(flight: list[tuple[float, Any]], options: HardwareOptions) -> None:
    walk = Walk(options)
    for seconds, message in flight:
        walk.take(message, seconds)
        before = walk.status, walk.detail, copy.deepcopy(walk.state)
        walk.hw.read(walk.now)
        assert (walk.status, walk.detail, walk.state) == before
        check_present(walk.vehicle, walk.now, options)


@QUICK
@given(FLIGHTS, OPTIONS, st.data())
def test_the_same_messages_give_the_same_statuses_and_later_ones_do_not_change_earlier_ones(
    flight: list[tuple[float, Any]], options: HardwareOptions, data: st.DataObject
) -> None:
    cut = data.draw(st.integers(0, len(flight)))
    whole, prefix = Walk(options), Walk(options)
    statuses = [whole.take(message, seconds) for seconds, message in flight]
    assert [prefix.take(message, seconds) for seconds, message in flight[:cut]] == statuses[:cut]


@QUICK
@given(FLIGHTS)
def test_memory_stays_bounded_for_any_messages(flight: list[tuple[float, Any]]) -> None:
    walk = Walk(HardwareOptions())
    for seconds, message in flight:
        walk.take(message, seconds)
        check_bounds(walk.state)


STREAMS: dict[str, Callable[[Flight, float], Any]] = {
    "heartbeat": lambda flight, _: flight.heartbeat(),
    "sys_status": lambda flight, _: flight.sys_status(),
    "system_time": lambda flight, _: flight.system_time(),
    "landed": lambda _, x: mav.ExtendedSysState(0, round(4 * x)),
    "global": lambda flight, x: mav.GlobalPositionInt(flight.boot_ms, 1, 1, round(100 * x), 0, 0),
    "local": lambda flight, x: mav.LocalPositionNed(flight.boot_ms, x, 0, 0),
    "hud": lambda _, x: mav.VfrHud(x, x, round(100 * x)),
    "attitude": lambda flight, x: mav.Attitude(flight.boot_ms, 0, 0, x / 5),
    "outputs": lambda _, x: mav.ServoOutputRaw._make((*[1000 + 600 * round(x)] * 8, 0, *[0] * 8)),
    "esc": lambda _, x: mav.EscTelemetry1To4(b"", b"", b"", bytes([round(x)]) * 8, b"", b""),
    "current_mode": lambda flight, x: mav.CurrentMode(flight.mode, flight.mode, round(8 * x)),
}
SETTINGS: dict[str, list[Any]] = {
    "armed": [False, True],
    "state": [0, 1, 3, 4, 5, 6, 8],
    "mode": [0, 4, 16, 4 << 16 | 3 << 24],
    "flags": [1, 0x21, 0x51],
    "health": [FITTED, FITTED | PREARM, FITTED & ~1 | PREARM, FITTED & ~(1 << 21)],
    "enabled": [FITTED | PREARM, FITTED & ~(1 << 15) | PREARM],
    "internal_errors": [0, 1],
}
ACTIONS = st.one_of(
    st.tuples(
        st.just("stream"), st.sampled_from(sorted(STREAMS)), st.sampled_from([0.3, 1, 5]), st.sampled_from([0, 0.2, 1])
    ),
    st.tuples(st.just("stop"), st.sampled_from(sorted(STREAMS))),
    st.sampled_from([("set", name, value) for name, some in SETTINGS.items() for value in some]),
    st.tuples(st.just("text"), st.sampled_from(WORDS), st.integers(0, 4)),
    st.tuples(st.just("event"), st.sampled_from([0x42, 0x62, 0x88])),
    st.tuples(st.just("reboot")),
)
STORIES = st.lists(st.tuples(ACTIONS, st.sampled_from([0.0, 0.4, 1.3, 3.0, 7.0])), min_size=5, max_size=25)


def act(flight: Flight, action: tuple[Any, ...]) -> None:
    """Run one action of a story."""
    match action:
        case ("stream", name, hz, x):
            flight.stream(name, lambda: STREAMS[name](flight, x), hz)
        case ("stop", name) if flight.has(name):
            flight.stop(name)
        case ("set", name, value):
            flight.set(**{name: value})
        case ("text", words, severity):
            flight.text(words, severity)
        case ("event", levels):
            flight.event(levels)
        case ("reboot",):
            flight.reboot()


@settings(QUICK, max_examples=60)
@given(st.sampled_from([0, ARDUPILOT, ARDUPILOT, PX4]), st.sampled_from([QUAD, ROVER, PLANE, 11]), STORIES, OPTIONS)
def test_the_handle_is_correct_at_every_moment_of_a_random_flight(
    autopilot: int, vehicle_type: int, story: list[tuple[Any, float]], options: HardwareOptions
) -> None:
    flight = Flight(autopilot, vehicle_type, options=options)
    for action, seconds in story:  # each read compares the handle with a newly derived status
        act(flight, action)
        flight.wait(seconds)


def check_bounds(state: VehicleState) -> None:
    assert set(state.latches) <= set(causes.CAUSES)
    assert len(state.modes) <= MOST_MODES
    assert len(state.texts) <= text_assembly.MOST_TEXTS
    assert all(len(partial_text.chunks) <= text_assembly.MOST_CHUNKS for _, partial_text in state.texts)
    assert len(state.heartbeats.runs) <= RUNS
    assert set(state.watch.functions) <= set(range(1, 33))
    assert set(state.watch.stop) <= set(range(1, 17))
    assert set(state.faults) <= set(range(64))
    assert all(
        heard is None or len(heard.times) <= REMEMBERED
        for heard in (getattr(state.latest, kind.name) for kind in fields(state.latest))
    )


def test_memory_stays_bounded_under_a_flood_of_modes_texts_chunks_and_parameters() -> None:
    walk = Walk(HardwareOptions())
    for n in range(1000):
        walk.take(mav.AvailableModes(n, 0, 255, n % 256, 0, b"MODE"))
        walk.take(text_message("x" * 50, 2, n + 1, n % 256))
        walk.take(mav.ParamValue(33.0, 0, 0, b"SERVO%d_FUNCTION" % (n % 200), 2))
        walk.take(FIRST._replace(base_mode=1 | (n % 2) << 7))
        check_bounds(walk.state)
    assert len(walk.state.modes) == MOST_MODES
    assert len(walk.state.texts) == text_assembly.MOST_TEXTS
    assert len(walk.state.watch.functions) == 32


@QUICK
@given(st.sampled_from(sorted(WANTED_IDS)), st.binary(max_size=255), st.sampled_from([1, 2]))
def test_any_payload_is_accepted(message_id: int, payload: bytes, version: int) -> None:
    flight = copter().look()
    if version == 1 and message_id > 255:
        return
    data = enclose(message_id, payload, system=1, component=1, sequence=0, version=version)
    (frame,) = Parser(WANTED_IDS).feed(data)
    flight.hw.on_frame(frame, flight.clock.now())
    flight.hw.read(flight.clock.now())
    check_invariants(flight.status, flight.detail, flight.hw.options)


def test_every_handled_message_is_in_the_property_tests() -> None:
    assert set(HANDLERS) <= {definition.type for definition in USED}


SIGNS_OF_A_STOP = st.one_of(
    st.sampled_from(
        [
            text_message("RC7: MotorEStop HIGH", 6),
            text_message("MotorEStop HIGH", 6),
            text_message("RC7: MotorEStop LOW", 6),
            text_message("PreArm: Motors Emergency Stopped", 2),
            mav.CommandAck(218, 0, 0, 0, 255, 190),
            mav.CommandLong(31, 2, 0, 0, 0, 0, 0, 218, 1, 1, 0),
            mav.CommandLong(31, 0, 0, 0, 0, 0, 0, 218, 1, 1, 0),
            mav.MissionCurrent(1),
            mav.ParamValue(31.0, 0, 0, b"RC7_OPTION", 4),
            mav.RcChannels(*[1900] * 18),
            mav.RcChannels(*[1000] * 18),
        ]
    ),
    st.integers(0, 3).map(lambda value: mav.NamedValueFloat(0, value, b"RS_STOP")),
    st.sampled_from([FITTED | PREARM, FITTED]).map(
        lambda health: mav.SysStatus(FITTED | PREARM, FITTED | PREARM, health, *[0] * 5)
    ),
)


@QUICK
@given(
    evidence=st.lists(st.tuples(st.sampled_from([0.0, 0.1, 0.6, 1.0, 3.0, 4.0]), SIGNS_OF_A_STOP), max_size=20),
    vehicle=st.sampled_from([(QUAD, (1000,) * 4, (1632,) * 4), (ROVER, (1500, 0, 1500), (1500, 0, 1700))]),
)
def test_no_order_of_evidence_makes_a_driven_vehicle_stopped(
    evidence: list[tuple[float, Any]], vehicle: tuple[int, tuple[int, ...], tuple[int, ...]]
) -> None:
    vehicle_type, stop, driven = vehicle
    flight = Flight(ARDUPILOT, vehicle_type, options=HardwareOptions(watch_outputs=True))
    values = [stop]

    def outputs() -> mav.ServoOutputRaw:
        pulses = (*values[0], *[0] * 16)[:16]
        return mav.ServoOutputRaw._make((*pulses[:8], 0, *pulses[8:]))

    flight.stream("outputs", outputs, hz=4).stream("hud", lambda: mav.VfrHud(3.0, 0.0, 40), hz=4)
    flight.wait(5)
    flight.hb(armed=True, state=4)
    values[0] = driven
    flight.wait(2)
    assert flight.status.drives_powered > TriState.FALSE
    for seconds, message in evidence:
        flight.wait(seconds)
        flight.send(message, (255, 190) if isinstance(message, mav.CommandLong) else (1, 1))
    flight.wait(2.0)
    assert flight.status.e_stopped is not TriState.TRUE, flight.vehicle.handle.evidence["e_stopped"]
    assert flight.status.drives_powered is not TriState.FALSE
    assert flight.status.motion_possible is not TriState.FALSE


@QUICK
@given(st.lists(st.tuples(st.sampled_from([0.0, 0.1, 1.0, 4.0]), SIGNS_OF_A_STOP), max_size=20), st.booleans())
def test_a_stopped_vehicle_is_never_live_without_evidence_of_a_release(
    evidence: list[tuple[float, Any]], applet: bool
) -> None:
    flight = Flight(ARDUPILOT, ROVER)
    flight.hb(armed=True, state=4).wait(2)
    for seconds, message in evidence:
        flight.wait(seconds)
        flight.send(message, (255, 190) if isinstance(message, mav.CommandLong) else (1, 1))
    flight.wait(4)
    flight.send(mav.NamedValueFloat(0, 1, b"RS_STOP") if applet else text_message("RC7: MotorEStop HIGH", 6))
    flight.wait(30)
    flight.stop("heartbeat").wait(5)
    flight.stream("heartbeat", flight.heartbeat).wait(30)
    assert flight.status.e_stopped is not TriState.FALSE
    assert flight.status.drives_powered is not TriState.TRUE
