"""Routing of frames: the MAVLink routing guide as a table, then arbitrary traffic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzz.routing import World
from mav_robot_status.gateway.links.routing import (
    AGAIN,
    BEAT_PRESENT,
    MOST_FRAMES,
    MOST_ROUTES,
    PRESENT,
    REPEAT,
    SILENCE,
    WINDOW,
    Router,
)
from mav_robot_status.mavlink.definitions import (
    Attitude,
    CommandAck,
    CommandLong,
    Heartbeat,
    RequestDataStream,
    SetMode,
)
from mav_robot_status.mavlink.encode import enclose, encode
from mav_robot_status.mavlink.framing import Frame, Parser

if TYPE_CHECKING:
    from typing import NamedTuple


@dataclass(frozen=True, eq=False)
class End:
    name: str
    is_out: bool = False
    passive: bool = False

    def __repr__(self) -> str:
        return self.name


VEHICLE, CAMERA, OTHER = End("vehicle"), End("camera"), End("other vehicle")
PASSIVE = End("passive", passive=True)
GROUND, TABLET, NOBODY = End("ground", is_out=True), End("tablet", is_out=True), End("nobody", is_out=True)
ALL = (VEHICLE, CAMERA, OTHER, PASSIVE, GROUND, TABLET, NOBODY)
WHO_IS_WHERE = (
    (VEHICLE, 1, 1),
    (VEHICLE, 1, 154),
    (CAMERA, 1, 100),
    (OTHER, 2, 1),
    (PASSIVE, 3, 1),
    (GROUND, 255, 190),
    (TABLET, 254, 190),
)

ATTITUDE = Attitude(1, 5.0, 6.0, 7.0)
UNKNOWN_ID = 0x7A0001


def command(system: int, component: int) -> CommandLong:
    return CommandLong(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 400, system, component, 0)


def frame_of(message: NamedTuple, system: int = 1, component: int = 1, sequence: int = 0, version: int = 2) -> Frame:
    raw = encode(message, system=system, component=component, sequence=sequence, version=version)
    (frame,) = Parser(None).feed(raw)
    return frame


def unknown_frame(system: int = 1, component: int = 1, sequence: int = 0, payload: bytes = b"\x02\x01") -> Frame:
    head = bytes([0xFD, len(payload), 0, 0, sequence, system, component]) + UNKNOWN_ID.to_bytes(3, "little")
    return Frame(UNKNOWN_ID, (system, component), sequence, None, head + payload + b"??")


def router() -> Router[End]:
    made: Router[End] = Router()
    for end, system, component in WHO_IS_WHERE:
        made.heard(end, system, component, 0.0)
    return made


GUIDE = [
    # case, source channel, sender, message, destinations
    ("no target: from a vehicle to all outs and the rest of it", VEHICLE, (1, 1), ATTITUDE, (CAMERA, *ALL[4:])),
    ("no target: from a ground station to all", GROUND, (255, 190), ATTITUDE, (VEHICLE, CAMERA, OTHER, TABLET, NOBODY)),
    ("target 0: to all", GROUND, (255, 190), command(0, 0), (VEHICLE, CAMERA, OTHER, TABLET, NOBODY)),
    ("target 0 with a component: to all", GROUND, (255, 190), command(0, 1), (VEHICLE, CAMERA, OTHER, TABLET, NOBODY)),
    ("all of a system", GROUND, (255, 190), command(1, 0), (VEHICLE, CAMERA)),
    ("one component", GROUND, (255, 190), command(1, 1), (VEHICLE,)),
    ("another component of the same system", GROUND, (255, 190), command(1, 100), (CAMERA,)),
    ("a component that never spoke", GROUND, (255, 190), command(1, 25), (VEHICLE, CAMERA)),
    ("a system that never spoke", GROUND, (255, 190), command(9, 1), ()),
    ("the target is where it came from", VEHICLE, (1, 1), command(1, 154), ()),
    ("the rest of the system is elsewhere, too", VEHICLE, (1, 1), command(1, 0), (CAMERA,)),
    ("an answer to its ground station only", VEHICLE, (1, 1), CommandAck(400, 0, 0, 0, 255, 190), (GROUND,)),
    ("an answer without a target to all", VEHICLE, (1, 1), CommandAck(400, 0, 0, 0, 0, 0), (CAMERA, *ALL[4:])),
    ("to a vehicle that nothing may be sent to", GROUND, (255, 190), command(3, 1), ()),
    ("from a vehicle that nothing may be sent to", PASSIVE, (3, 1), ATTITUDE, (GROUND, TABLET, NOBODY)),
    ("one ground station to another", GROUND, (255, 190), command(254, 190), (TABLET,)),
    ("one vehicle to another, if it means it", VEHICLE, (1, 1), command(2, 1), (OTHER,)),
    ("an unheard sender on an out", NOBODY, (77, 1), ATTITUDE, (VEHICLE, CAMERA, OTHER, GROUND, TABLET)),
    ("the second way to a vehicle is not told what it said", CAMERA, (1, 1), ATTITUDE, (GROUND, TABLET, NOBODY)),
]


@pytest.mark.parametrize(("came_from", "sender", "message", "to"), [c[1:] for c in GUIDE], ids=[c[0] for c in GUIDE])
def test_the_routing_guide(came_from: End, sender: tuple[int, int], message: NamedTuple, to: tuple[End, ...]) -> None:
    assert router().destinations(frame_of(message, *sender), came_from, ALL, 1.0) == to


BEAT_OF_GROUND = Heartbeat(0, 6, 8, 0, 4, 3)
THERE = (VEHICLE, CAMERA, OTHER)  # the vehicle links that may be sent to
HEARD_TOO = [
    # case: the message that VEHICLE passed on from a ground station, seconds ago; what comes from it on GROUND; to
    ("its heartbeat comes from there", BEAT_OF_GROUND, 1.0, BEAT_OF_GROUND, (CAMERA, OTHER)),
    ("its heartbeat comes no more from there", BEAT_OF_GROUND, BEAT_PRESENT + 0.01, BEAT_OF_GROUND, THERE),
    ("the link was left minutes ago", BEAT_OF_GROUND, 200.0, BEAT_OF_GROUND, THERE),
    ("only other messages come from there", ATTITUDE, 0.1, BEAT_OF_GROUND, THERE),
    ("a broadcast while it comes from there", BEAT_OF_GROUND, 1.0, ATTITUDE, (CAMERA, OTHER)),
    ("a broadcast when it comes no more from there", BEAT_OF_GROUND, PRESENT + 0.01, ATTITUDE, THERE),
    ("a command is never held back", BEAT_OF_GROUND, 0.1, command(1, 1), (VEHICLE,)),
    ("a command for the whole system is never held back", BEAT_OF_GROUND, 0.1, command(1, 0), (VEHICLE, CAMERA)),
]


@pytest.mark.parametrize(
    ("passed_on", "ago", "message", "to"), [c[1:] for c in HEARD_TOO], ids=[c[0] for c in HEARD_TOO]
)
def test_a_frame_is_held_back_only_while_its_sender_still_comes_from_there(
    passed_on: NamedTuple, ago: float, message: NamedTuple, to: tuple[End, ...]
) -> None:
    some = router()
    for end, system, component in WHO_IS_WHERE:
        some.heard(end, system, component, 500.0 - ago)
    some.destinations(frame_of(passed_on, 255, 190), VEHICLE, ALL, 500.0 - ago)
    found = some.destinations(frame_of(message, 255, 190, sequence=9), GROUND, ALL, 500.0)
    assert tuple(end for end in found if not end.is_out) == to


def test_a_ground_station_that_changes_its_way_is_not_silent_for_its_autopilot() -> None:
    """It is heard through the autopilot for a minute, and then only on the out."""
    some = router()
    for second in range(60):
        some.destinations(frame_of(BEAT_OF_GROUND, 255, 190, second), VEHICLE, ALL, float(second))
    passed = [
        second
        for second in range(60, 80)
        if VEHICLE in some.destinations(frame_of(BEAT_OF_GROUND, 255, 190, second), GROUND, ALL, second + 0.1)
    ]
    assert passed == list(range(61, 80))  # the autopilot had one at second 59


def test_an_autopilot_does_not_get_its_own_telemetry_from_its_other_link() -> None:
    radio, cable = End("radio"), End("cable")
    ends = (radio, cable, GROUND)
    some: Router[End] = Router()
    some.destinations(frame_of(ATTITUDE), cable, ends, 1.0)
    late = 1.0 + PRESENT + 1.0  # the cable is silent
    assert some.destinations(frame_of(ATTITUDE, sequence=1), radio, ends, late) == (GROUND,)
    some.heard(cable, 1, 100, late)  # something else of the vehicle is on the cable
    assert some.destinations(frame_of(ATTITUDE, sequence=2), radio, ends, late + 1) == (cable, GROUND)


@pytest.mark.parametrize("seed", range(4))
def test_no_heartbeat_is_late_and_no_loop_amplifies_in_an_hour_of_changing_ways(seed: int) -> None:
    world = World(seed)
    world.run(3600.0)
    assert world.made > 10_000
    assert world.sent > 5_000


def test_the_status_of_a_telemetry_radio_is_forwarded_and_adds_no_route() -> None:
    """It is never signed. Its ids may be forged."""
    some = router()
    (radio,) = Parser(None).feed(enclose(109, bytes(9), system=77, component=7, sequence=0))
    assert some.destinations(radio, VEHICLE, ALL, 1.0) == (GROUND, TABLET, NOBODY)
    assert some.destinations(frame_of(command(77, 7)), GROUND, ALL, 1.0) == ()


@pytest.mark.parametrize("version", [1, 2])
def test_mavlink_1_and_mavlink_2_are_routed_alike(version: int) -> None:
    request = RequestDataStream(4, 2, 1, 0, 1)
    assert router().destinations(frame_of(request, 255, 190, version=version), GROUND, ALL, 1.0) == (OTHER,)


def test_a_truncated_target_field_is_zero() -> None:
    """A MAVLink 1 COMMAND_ACK has no target. MAVLink 2 omits trailing zeros."""
    payload = frame_of(CommandAck(400, 0, 0, 0, 255, 190)).payload

    def cut_to(length: int) -> Frame:
        (frame,) = Parser(None).feed(enclose(77, payload[:length], system=1, component=1, sequence=0))
        return frame

    for length in (0, 3, 8):
        cut = cut_to(length)
        assert router().destinations(cut, VEHICLE, ALL, 1.0) == (CAMERA, GROUND, TABLET, NOBODY)
    assert router().destinations(cut_to(9), VEHICLE, ALL, 1.0) == (GROUND,)


def test_a_message_with_only_a_target_system_goes_to_all_its_components() -> None:
    set_mode = frame_of(SetMode(0, 1, 100), 255, 190)  # its last byte is not a component
    assert router().destinations(set_mode, GROUND, ALL, 1.0) == (VEHICLE, CAMERA)


def test_target_component_0_means_the_whole_system_even_if_a_sender_uses_0() -> None:
    some = router()
    some.destinations(frame_of(ATTITUDE, 255, 0), TABLET, ALL, 1.0)
    assert some.destinations(frame_of(command(255, 0)), VEHICLE, ALL, 1.0) == (GROUND, TABLET)
    assert some.destinations(frame_of(ATTITUDE, 255, 0, 1), TABLET, ALL, 1.0) == (
        VEHICLE,
        CAMERA,
        OTHER,
        GROUND,
        NOBODY,
    )


def test_an_unknown_message_is_broadcast_and_adds_no_route() -> None:
    some = router()
    assert some.destinations(unknown_frame(77, 7), GROUND, ALL, 1.0) == (VEHICLE, CAMERA, OTHER, TABLET, NOBODY)
    assert some.destinations(frame_of(command(77, 7)), VEHICLE, ALL, 1.0) == ()


def test_a_known_message_adds_a_route_even_after_unknown_messages() -> None:
    some = router()
    some.destinations(unknown_frame(77, 7), TABLET, ALL, 1.0)
    some.destinations(frame_of(ATTITUDE, 77, 7), TABLET, ALL, 1.0)
    assert some.destinations(frame_of(command(77, 7)), VEHICLE, ALL, 1.0) == (TABLET,)


def test_a_sender_that_moves_is_routed_to_its_new_channel_at_once() -> None:
    some = router()
    assert some.destinations(frame_of(command(1, 1), 255, 190), GROUND, ALL, 1.0) == (VEHICLE,)
    some.destinations(frame_of(ATTITUDE), OTHER, ALL, 1.0)
    assert some.destinations(frame_of(command(1, 1), 255, 190, 1), GROUND, ALL, 1.0) == (VEHICLE, OTHER)


def test_a_sender_with_the_broadcast_system_id_adds_no_route() -> None:
    some = router()
    some.destinations(frame_of(ATTITUDE, 0, 5), GROUND, ALL, 1.0)
    assert some.destinations(frame_of(ATTITUDE, 0, 5, 1), TABLET, ALL, 1.0) == (VEHICLE, CAMERA, OTHER, GROUND, NOBODY)


def test_channels_can_be_added_and_removed() -> None:
    some = router()
    late = End("late", is_out=True)
    assert some.destinations(frame_of(ATTITUDE, sequence=1), VEHICLE, (VEHICLE, GROUND), 1.0) == (GROUND,)
    assert some.destinations(frame_of(ATTITUDE, sequence=2), VEHICLE, (VEHICLE, GROUND, late), 1.0) == (GROUND, late)
    assert some.destinations(frame_of(ATTITUDE, sequence=3), VEHICLE, (VEHICLE, late), 1.0) == (late,)


def test_our_own_frames_are_dropped_and_add_no_route() -> None:
    some = router()
    assert some.destinations(frame_of(command(1, 192), 255, 190, 2), TABLET, ALL, 1.0) == (VEHICLE, CAMERA)
    some.speak_as({(1, 192)})
    assert some.destinations(frame_of(ATTITUDE, 1, 192), GROUND, ALL, 1.0) == ()
    assert some.destinations(frame_of(command(1, 192), 255, 190), TABLET, ALL, 1.0) == ()
    some.speak_as({(1, 193)})
    assert some.destinations(frame_of(ATTITUDE, 1, 192, 1), CAMERA, ALL, 1.0) == (VEHICLE, GROUND, TABLET, NOBODY)
    assert some.destinations(frame_of(command(1, 192), 255, 190, 1), TABLET, ALL, 1.0) == (CAMERA,)


def test_a_copy_on_another_channel_is_dropped_and_adds_no_route() -> None:
    some = router()
    frame = frame_of(ATTITUDE, 5, 1)
    assert VEHICLE in some.destinations(frame, GROUND, ALL, 1.0)
    assert some.destinations(frame, TABLET, ALL, 1.0 + WINDOW) == ()
    assert some.destinations(frame_of(command(5, 1)), VEHICLE, ALL, 1.1) == (GROUND,)


def test_a_repeat_on_the_same_channel_is_forwarded() -> None:
    some = router()
    for i in range(50):
        assert some.destinations(frame_of(ATTITUDE), VEHICLE, ALL, 1.0 + i / 10) == (CAMERA, GROUND, TABLET, NOBODY)
    assert some.destinations(frame_of(ATTITUDE), GROUND, ALL, 1.0 + 50 / 10) == ()


def test_a_frame_that_loops_back_to_its_first_channel_ends() -> None:
    """Something beyond the channel sends each frame of a sender back, sooner or later than its next frame."""
    for way in (0.004, 0.06, 0.4):
        some = router()
        sent: dict[int, int] = {}
        due = [(i * 0.1, i) for i in range(100)]
        while due:
            due.sort()
            now, number = due.pop(0)
            if some.destinations(frame_of(ATTITUDE, 255, 190, number), GROUND, ALL, 1.0 + now):
                sent[number] = sent.get(number, 0) + 1
                due.append((now + way, number))
        assert sum(sent.values()) <= 2.2 * 100
        assert max(sent.values()) <= 3


def test_a_sender_with_a_constant_sequence_number_may_alternate_its_messages() -> None:
    some = router()
    passed = [
        bool(some.destinations(frame_of((ATTITUDE, command(1, 1))[i % 2]), GROUND, ALL, 1.0 + i * 0.6 * REPEAT))
        for i in range(40)
    ]
    assert sum(passed) >= 38


def test_a_sender_with_a_constant_sequence_number_on_two_ways_is_heard_every_second() -> None:
    some = router()
    passed = []
    for second in range(20):
        frame = frame_of(BEAT_OF_GROUND, 255, 190)
        passed.append(bool(some.destinations(frame, GROUND, ALL, second + 0.0)))
        assert some.destinations(frame, TABLET, ALL, second + 0.3) == ()
    assert AGAIN < 0.7
    assert all(passed)


def test_the_same_bytes_much_later_are_not_a_copy() -> None:
    some = router()
    some.destinations(frame_of(ATTITUDE, 5, 1), GROUND, ALL, 1.0)
    assert some.destinations(frame_of(ATTITUDE, 5, 1), TABLET, ALL, 1.0 + 2 * WINDOW) != ()


def test_a_burst_of_frames_only_shortens_the_duplicate_window() -> None:
    some = router()
    first = frame_of(ATTITUDE, 5, 1)
    some.destinations(first, GROUND, ALL, 1.0)
    for i in range(2 * MOST_FRAMES):
        some.destinations(first._replace(raw=b"%d" % i), GROUND, ALL, 1.0)
    assert some.destinations(first, TABLET, ALL, 1.0) != ()


def test_a_routing_loop_ends() -> None:
    """Two links end in one hub that repeats each frame to all ports except its source."""
    left, right = End("left", is_out=True), End("right", is_out=True)
    ends = (left, right)
    some: Router[End] = Router()
    frame = frame_of(ATTITUDE, 5, 1)
    arriving, sent = [left, right], 0  # as the hub delivers the frame
    while arriving and sent < 100:
        to = some.destinations(frame, arriving.pop(0), ends, 1.0)
        sent += len(to)
        arriving += [left if end is right else right for end in to]
    assert sent == 1


def test_silent_senders_are_forgotten_and_active_ones_are_not() -> None:
    some = router()
    for second in range(1, int(SILENCE) + 10):
        some.destinations(frame_of(ATTITUDE, 1, 1, second % 256), VEHICLE, ALL, float(second))
    now = SILENCE + 10
    assert some.destinations(frame_of(command(1, 1), 255, 190), GROUND, ALL, now) == (VEHICLE,)
    assert some.destinations(frame_of(command(2, 1), 255, 190), GROUND, ALL, now) == ()


def test_the_routing_table_is_bounded_and_drops_the_longest_silent_sender_first() -> None:
    some = router()
    for i in range(20 * MOST_ROUTES):
        some.heard(NOBODY, 10 + i // 250, i % 250, 1.0)
        some.heard(VEHICLE, 1, 1, 1.0)
    assert len(some._heard) == MOST_ROUTES
    assert len(some._where) <= 2 * MOST_ROUTES
    assert some.destinations(frame_of(command(1, 1), 255, 190), GROUND, ALL, 1.0) == (VEHICLE,)
    assert some.destinations(frame_of(command(2, 1), 255, 190), GROUND, ALL, 1.0) == ()
    assert some.destinations(frame_of(command(10 + i // 250, i % 250), 255, 190), GROUND, ALL, 1.0) == (NOBODY,)


def datagram(*frames: Frame) -> bytes:
    return b"".join(frame.raw for frame in frames)


BEAT = Heartbeat(0, 2, 3, 0, 4, 3)


def test_a_datagram_for_one_route_is_forwarded_unchanged() -> None:
    one, two = frame_of(BEAT), frame_of(ATTITUDE, sequence=1)
    data = datagram(one, two)
    ((sent, to),) = router().plan(data, [one, two], VEHICLE, ALL, 1.0)
    assert sent is data
    assert to == (CAMERA, GROUND, TABLET, NOBODY)


def test_a_datagram_for_several_routes_is_forwarded_frame_by_frame() -> None:
    one, two, three = frame_of(BEAT), frame_of(command(255, 190), sequence=1), frame_of(command(9, 9), sequence=2)
    plan = router().plan(datagram(one, two, three), [one, two, three], VEHICLE, ALL, 1.0)
    assert plan == [(one.raw, (CAMERA, GROUND, TABLET, NOBODY)), (two.raw, (GROUND,))]


@pytest.mark.parametrize("count", [1, 2])
def test_garbage_is_not_forwarded(count: int) -> None:
    frames = [frame_of(BEAT), frame_of(ATTITUDE, sequence=1)][:count]
    for data in (b"xy" + datagram(*frames), b"y".join(f.raw for f in frames) + b"x", datagram(*frames) + b"\xfd\x09"):
        got = Parser(None).feed(data)
        assert [sent for sent, _ in router().plan(data, got, VEHICLE, ALL, 1.0)] == [f.raw for f in frames]


def test_frames_of_a_stream_are_forwarded_one_by_one() -> None:
    one, two = frame_of(BEAT), frame_of(ATTITUDE, sequence=1)
    assert [sent for sent, _ in router().plan(b"", [one, two], VEHICLE, ALL, 1.0)] == [one.raw, two.raw]


def test_a_frame_without_a_destination_has_no_plan() -> None:
    one, two = frame_of(command(9, 9)), frame_of(command(9, 9), sequence=1)
    assert router().plan(b"", [], VEHICLE, ALL, 1.0) == []
    assert router().plan(one.raw, [one], VEHICLE, ALL, 1.0) == []
    assert router().plan(datagram(one, two), [one, two], VEHICLE, ALL, 1.0) == []


SYSTEMS = st.sampled_from([0, 1, 2, 3, 254, 255])
COMPONENTS = st.sampled_from([0, 1, 100, 190, 192])
ENDS = st.sampled_from(ALL)
STEPS = st.lists(
    st.tuples(
        ENDS,
        SYSTEMS,
        COMPONENTS,
        st.one_of(st.just(ATTITUDE), st.none(), st.builds(command, SYSTEMS, COMPONENTS)),
        st.integers(0, 3),
        st.sampled_from([0.0, 0.1, 1.5, 400.0]),
    ),
    max_size=40,
)


@given(STEPS, st.sets(ENDS))
def test_the_routing_invariants_hold_for_any_traffic(
    steps: list[tuple[End, int, int, CommandLong | Attitude | None, int, float]], absent: set[End]
) -> None:
    some: Router[End] = Router()
    some.speak_as({(1, 192)})
    ends = tuple(end for end in ALL if end not in absent)
    spoke: set[tuple[End, int]] = set()
    now = 0.0
    for end, system, component, message, sequence, pause in steps:
        now += pause
        if message is None:
            frame = unknown_frame(system, component, sequence)
        else:
            frame = frame_of(message, system, component, sequence)
            spoke.add((end, system))
        to = some.destinations(frame, end, ends, now)
        assert end not in to
        assert len(set(to)) == len(to)
        assert set(to) <= set(ends)
        assert not any(other.passive for other in to)
        if (system, component) == (1, 192):
            assert to == ()
        if isinstance(message, CommandLong) and message.target_system:
            assert all((other, message.target_system) in spoke for other in to)
        if to and not isinstance(message, CommandLong) and not end.is_out:
            assert all(other.is_out or (other, system) in spoke for other in to)


FRAMES = st.builds(lambda *ids: frame_of(ATTITUDE, *ids).raw, SYSTEMS, COMPONENTS, st.integers(0, 255))
COMMANDS = st.builds(lambda s, c, ts, tc: frame_of(command(ts, tc), s, c).raw, SYSTEMS, COMPONENTS, SYSTEMS, COMPONENTS)
UNKNOWN = st.builds(lambda *ids: unknown_frame(*ids).raw, SYSTEMS, COMPONENTS, st.integers(0, 255))
BYTES = st.lists(st.one_of(FRAMES, COMMANDS, UNKNOWN, st.binary(max_size=30)), max_size=8).map(b"".join)


@given(st.lists(st.tuples(ENDS, BYTES, st.booleans()), max_size=10))
def test_any_bytes_are_accepted_and_no_bytes_are_added(pieces: list[tuple[End, bytes, bool]]) -> None:
    some = router()
    parsers = {end: Parser(None) for end in ALL}
    for end, data, stream in pieces:
        frames = parsers[end].feed(data)
        plan = some.plan(b"" if stream else data, frames, end, ALL, 1.0)
        raws = [frame.raw for frame in frames]
        sent = [part for part, _ in plan]
        if sent != [data]:
            rest = iter(raws)
            assert all(part in rest for part in sent)
        else:
            assert b"".join(raws).endswith(data)  # before it may come what was incomplete
        assert not any(end in to or PASSIVE in to for _, to in plan)
