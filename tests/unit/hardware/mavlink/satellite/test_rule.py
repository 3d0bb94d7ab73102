"""A vehicle behind a satellite, which sends HIGH_LATENCY2 and no HEARTBEAT."""

from __future__ import annotations

from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.faults import causes
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.satellite import failure_flags
from mav_robot_status.hardware.mavlink.satellite.state import LEAST_TIMEOUT, LONGEST_TIMEOUT, is_statement, stated
from mav_robot_status.interface import LinkState, RobotMode, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink import enumerations as mavlink

from ..driver import ARDUPILOT, PX4, QUAD, ROVER, frame_of
from .high_latency import ARMED, DISARMED, Sky, ardupilot, inav, px4, radio_room

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
FLAGS = [value for name, value in vars(mavlink).items() if name.startswith("HL_FAILURE_FLAG_")]


# -- what it says ------------------------------------------------------------------------------------------------------


def test_an_ardupilot_says_whether_it_is_armed() -> None:
    sky = Sky()
    status = sky.send(ardupilot(DISARMED))
    assert (status.mode, status.drives_powered, status.motion_possible) == (RobotMode.AUTO, FALSE, FALSE)
    assert (status.e_stopped, status.in_motion, status.in_error) == (UNKNOWN, UNKNOWN, UNKNOWN)
    assert sky.inhibits == ["DISARMED"]
    sky.wait(5)
    status = sky.send(ardupilot(ARMED))
    assert (status.drives_powered, status.motion_possible, status.e_stopped) == (TRUE, UNKNOWN, UNKNOWN)
    assert sky.inhibits == []


def test_px4_does_not_say_whether_it_is_armed() -> None:
    sky = Sky()
    status = sky.send(px4())
    assert (status.mode, sky.detail.vehicle.flight_mode) == (RobotMode.AUTO, "AUTO.MISSION")
    assert {status.e_stopped, status.drives_powered, status.motion_possible, status.in_motion} == {UNKNOWN}
    assert sky.inhibits == []
    assert sky.detail.vehicle.custom_mode == 4 << 16 | 4 << 24


@pytest.mark.parametrize(
    "message",
    [
        inav(),
        radio_room(),
        radio_room(9, base_mode=89),
        radio_room(13, base_mode=81, eph=0, epv=0),
        radio_room(13, custom_mode=217, eph=0, epv=0),
        ardupilot(-128),
        ardupilot(16),
        ardupilot(DISARMED, custom2=1),
        ardupilot(DISARMED, autopilot=0),
        ardupilot(DISARMED, climb_rate=1),
    ],
)
def test_a_sender_that_is_not_ardupilot_itself_does_not_say_disarmed(message: mav.HighLatency2) -> None:
    sky = Sky()
    status = sky.send(message)
    assert (status.drives_powered, status.motion_possible, status.e_stopped) == (UNKNOWN, UNKNOWN, UNKNOWN)
    assert sky.inhibits == []


@given(
    fields=st.fixed_dictionaries(
        {
            "custom0": st.integers(-128, 127),
            "custom_mode": st.integers(0, 0xFFFF),
            "autopilot": st.integers(0, 30),
            "type": st.sampled_from([QUAD, ROVER, 1, 12]),
            "failure_flags": st.integers(0, 0xFFFF),
            "groundspeed": st.integers(0, 255),
            "climb_rate": st.integers(-128, 127),
            "eph": st.sampled_from([0, 255]),
            "latitude": st.integers(-(2**31), 2**31 - 1),
            "longitude": st.integers(-(2**31), 2**31 - 1),
            "timestamp": st.integers(0, 2**32 - 1),
        }
    )
)
def test_no_message_says_stopped_or_at_rest_and_only_a_disarmed_ardupilot_says_unpowered(fields: Any) -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED))
    sky.wait(6)
    sky.send(ardupilot(**fields), timestamp=fields["timestamp"])
    status = sky.status
    assert status.e_stopped is UNKNOWN
    assert status.in_motion is not FALSE
    assert status.in_error is not FALSE
    if status.drives_powered is FALSE:
        custom0 = fields["custom0"] & 0xFF
        assert fields["autopilot"] == 3
        assert custom0 & 1
        assert not custom0 & 128 or custom0 & 32  # disarmed, or simulated


def test_its_state_and_what_is_not_told_are_null() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED))
    assert (sky.detail.vehicle.state, sky.detail.vehicle.firmware) == (None, None)
    assert sky.link == "CONNECTED"


def test_the_options_of_the_site_hold() -> None:
    sky = Sky(HardwareOptions(manual_blocks_motion=True, estop_unknown_as="false"))
    status = sky.send(ardupilot(ARMED, custom_mode=0))
    assert (status.mode, status.motion_possible, status.e_stopped) == (RobotMode.MANUAL, FALSE, FALSE)
    assert sky.inhibits == ["MODE_MANUAL"]


def test_a_rover_that_initialises_cannot_move() -> None:
    sky = Sky()
    status = sky.send(ardupilot(ARMED, type=ROVER, custom_mode=16))
    assert (status.motion_possible, sky.inhibits) == (FALSE, ["INITIALISING"])


def test_hardware_in_the_loop_blocks_the_actuators() -> None:
    sky = Sky()
    status = sky.send(ardupilot(ARMED | 32))
    assert (status.drives_powered, sky.inhibits) == (FALSE, ["HIL"])


def test_a_message_of_a_camera_is_no_vehicle() -> None:
    sky = Sky()
    sky.hw.on_frame((235, (1, 100), 1, ardupilot(autopilot=8), b"", 0), sky.clock.now(), None)
    assert list(sky.hw.vehicles) == []


def test_explain_names_the_message_behind_each_field() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED, groundspeed=12))
    evidence = sky.vehicle.handle.evidence
    told = "HIGH_LATENCY2: custom_mode 4, custom0 -47, failure_flags 0x0, groundspeed 2.4 m/s"
    for field in ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion"):
        assert (evidence[field].source, evidence[field].at) == (told, sky.clock.now().mono)


# -- errors ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flag", FLAGS)
def test_each_flag_has_a_cause_as_mavlink_defines_it(flag: int) -> None:
    row = failure_flags.DEFINED[flag]
    assert row.code in causes.CAUSES
    sky = Sky()
    status = sky.send(ardupilot(autopilot=0, failure_flags=flag))
    assert (sky.codes, status.in_error, status.error_code) == ([row.code], TRUE, row.code)
    sky.wait(5)
    assert sky.send(ardupilot(autopilot=0)).in_error is UNKNOWN


ARDUPILOT_CODES = {1: 3005, 2: 3004, 4: 3003, 8: 3001, 16: 3000, 32: 3002, 128: 3025, 256: 3016, 2048: 3020, 4096: 3021}


@pytest.mark.parametrize("flag", FLAGS)
def test_a_flag_of_ardupilot_has_the_code_of_its_bit_in_sys_status(flag: int) -> None:
    """Once it was clear and armed. TERRAIN is no error; three flags are never set."""
    sky = Sky()
    sky.send(ardupilot(ARMED))
    sky.wait(5)
    sky.send(ardupilot(ARMED, failure_flags=flag))
    assert sky.codes == ([ARDUPILOT_CODES[flag]] if flag in ARDUPILOT_CODES else [])


def test_an_ardupilot_sets_the_flags_of_sensors_that_it_does_not_have() -> None:
    absent = 1 | 2 | 32 | 64 | 256 | 2048  # GPS, airspeed, compass, terrain, remote control, geofence
    sky = Sky()
    assert sky.send(ardupilot(ARMED, failure_flags=absent)).in_error is UNKNOWN
    sky.wait(5)
    sky.send(ardupilot(ARMED, failure_flags=absent & ~1))
    sky.wait(5)
    sky.send(ardupilot(ARMED, failure_flags=absent))
    assert sky.codes == [3005]  # it had a fix
    sky.wait(5)
    assert sky.send(ardupilot(DISARMED, failure_flags=absent)).in_error is UNKNOWN


@pytest.mark.parametrize("flag", FLAGS)
def test_px4_sets_two_flags_while_nothing_is_wrong(flag: int) -> None:
    sky = Sky()
    sky.send(px4(failure_flags=flag))
    assert bool(sky.codes) is (flag not in (256, 512))


def test_px4_in_offboard_without_the_link_is_an_error() -> None:
    sky = Sky()
    sky.send(px4(failure_flags=512, custom_mode=6))
    assert sky.codes == [causes.OFFBOARD_LOST]


def test_the_inverted_flags_of_uv_radio_room_are_no_errors() -> None:
    assert Sky().send(radio_room(failure_flags=0xFFFF)).in_error is UNKNOWN


def test_in_the_first_seconds_after_its_boot_an_autopilot_has_no_errors() -> None:
    sky = Sky()
    assert sky.send(px4(failure_flags=16), timestamp=9_999).in_error is UNKNOWN
    assert sky.send(px4(failure_flags=16), timestamp=10_000).in_error is TRUE


def test_an_error_keeps_the_time_of_its_first_message() -> None:
    sky = Sky()
    sky.send(px4(failure_flags=16))
    since = sky.detail.errors[0].since_us
    sky.wait(60)
    sky.send(px4(failure_flags=16 | 8))
    assert [error.since_us - since for error in sky.detail.errors] == [0, 60_000_000]


def test_a_site_can_ignore_a_sensor() -> None:
    sky = Sky(HardwareOptions(ignore_sensors=frozenset({"3D_GYRO"})))
    assert sky.send(px4(failure_flags=16)).in_error is UNKNOWN


# -- motion ------------------------------------------------------------------------------------------------------------


def test_one_sample_of_speed_proves_nothing_and_two_do() -> None:
    sky = Sky()
    assert sky.send(px4(groundspeed=60)).in_motion is UNKNOWN
    sky.wait(60)
    assert sky.send(px4(groundspeed=60)).in_motion is TRUE
    sky.wait(60)
    assert sky.send(px4(groundspeed=0)).in_motion is UNKNOWN


def test_the_same_message_twice_is_one_sample() -> None:
    sky = Sky()
    sky.send(px4(groundspeed=60), timestamp=5000)
    sky.wait(1)
    assert sky.send(px4(groundspeed=60), timestamp=5000).in_motion is UNKNOWN


def test_a_climb_proves_motion_but_not_of_a_rover() -> None:
    for kind, expected in ((QUAD, TRUE), (ROVER, UNKNOWN)):
        sky = Sky()
        sky.send(px4(climb_rate=-20, type=kind))
        sky.wait(60)
        assert sky.send(px4(climb_rate=-20, type=kind)).in_motion is expected


@pytest.mark.parametrize(
    ("before", "after", "seconds", "expected"),
    [
        ((473977420, 85455940), (473987420, 85455940), 60, TRUE),  # 111 m to the north
        ((473977420, 85455940), (473977420, 85475940), 60, TRUE),  # 150 m to the east
        ((473977420, 85455940), (473978420, 85455940), 60, UNKNOWN),  # 11 m
        ((473977420, 85455940), (473987420, 85455940), 600, UNKNOWN),  # 111 m in ten minutes
        ((0, 0), (473987420, 85455940), 60, UNKNOWN),  # the first fix
        ((0, 1_799_999_000), (1000, -1_799_999_000), 10, UNKNOWN),  # 22 m across the date line
    ],
)
def test_two_positions_far_apart_prove_motion(before: Any, after: Any, seconds: float, expected: TriState) -> None:
    sky = Sky()
    sky.send(px4(latitude=before[0], longitude=before[1]))
    for _ in range(int(seconds // 150)):
        sky.wait(150)
        sky.send(px4(latitude=before[0], longitude=before[1]))
    status = sky.send(px4(latitude=after[0], longitude=after[1]), timestamp=round((1000 + 2 * seconds) * 1000))
    assert status.in_motion is expected


def test_messages_that_a_satellite_kept_and_sends_together_have_their_own_times() -> None:
    sky = Sky()
    sky.send(px4(latitude=473977420, longitude=85455940), timestamp=100_000)
    status = sky.send(px4(latitude=473987420, longitude=85455940), timestamp=700_000)
    assert status.in_motion is UNKNOWN  # 111 m in ten minutes


# -- time --------------------------------------------------------------------------------------------------------------


class Link(NamedTuple):
    """A channel whose link has a time-out of its own."""

    name: str
    heartbeat_timeout: float | None


def test_the_time_out_is_a_minute_and_from_the_second_interval_on_three_of_the_longest() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED))
    sky.wait(LEAST_TIMEOUT)
    assert sky.link == "CONNECTED"
    assert sky.wait(0.1).mode is RobotMode.UNKNOWN
    assert (sky.detail.link, sky.inhibits) == (LinkState.LOST, ["LINK_STALE"])
    for interval in (5.0, 5.0, 4.0):
        sky.send(ardupilot(ARMED))
        sky.wait(interval)
    sky.send(ardupilot(ARMED))  # the longest is that across the loss, 60.1 s
    sky.wait(180.5)
    assert sky.link == "CONNECTED"
    sky.wait(1)
    assert sky.link == "LOST"


def test_a_disarmed_vehicle_that_falls_silent_is_lost_after_three_of_its_intervals() -> None:
    sky = Sky()
    for _ in range(3):
        sky.send(ardupilot(DISARMED))
        sky.wait(5.0)
    assert sky.wait(10.4).drives_powered is FALSE
    assert sky.wait(0.2).drives_powered is UNKNOWN
    assert sky.link == "LOST"


def test_px4_is_waited_for_as_its_period_needs() -> None:
    sky = Sky()
    sky.send(px4())
    sky.wait(199)
    assert sky.link == "CONNECTED"
    sky.wait(2)
    assert sky.link == "LOST"


def test_a_pause_is_forgotten_and_no_time_out_is_longer_than_an_hour() -> None:
    sky = Sky()
    sky.send(px4())
    for interval in (1100, 1190, 1199):
        sky.wait(interval)
        sky.send(px4())
    sky.wait(LONGEST_TIMEOUT - 4)
    assert sky.link == "CONNECTED"
    sky.wait(5)
    assert sky.link == "LOST"
    for interval in (10_000, 5, 5, 5, 5, 5, 5):
        sky.wait(interval)
        sky.send(px4())
    sky.wait(201)
    assert sky.link == "LOST"


def test_a_link_has_a_time_out_of_its_own() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED), Link("satellite", 120.0))
    sky.wait(119)
    assert sky.link == "CONNECTED"
    sky.wait(2)
    assert sky.link == "LOST"
    sky.beat(Link("radio", None))
    sky.wait(4)
    assert sky.link == "LOST"


def test_a_link_time_out_holds_for_heartbeats_too() -> None:
    sky = Sky()
    sky.beat(Link("radio", 20.0))
    sky.wait(19)
    assert sky.link == "CONNECTED"
    sky.wait(2)
    assert sky.link == "LOST"


def test_a_late_message_changes_nothing_and_does_not_make_the_status_younger() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED), timestamp=50_000)
    heard = sky.vehicle.handle.heard_at
    sky.wait(2)
    assert sky.send(ardupilot(DISARMED), timestamp=40_000).drives_powered is TRUE
    assert sky.send(ardupilot(DISARMED), timestamp=30_000).drives_powered is TRUE
    assert sky.vehicle.handle.heard_at == heard


def test_a_clock_that_starts_again_is_a_reboot_once_it_goes_on() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED), timestamp=5_000_000)
    sky.wait(5)
    assert sky.send(ardupilot(DISARMED), timestamp=10_000).drives_powered is TRUE
    sky.wait(5)
    assert sky.send(ardupilot(DISARMED), timestamp=15_000).drives_powered is FALSE


def test_the_clock_of_the_sender_may_wrap() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED), timestamp=2**32 - 1000)
    sky.wait(5)
    assert sky.send(ardupilot(DISARMED), timestamp=4000).drives_powered is FALSE


# -- with HEARTBEATs ---------------------------------------------------------------------------------------------------


def test_high_latency2_beside_heartbeats_changes_nothing() -> None:
    sky = Sky()
    sky.beat("radio", armed=True)
    for _ in range(20):
        sky.wait(1)
        sky.beat("radio", armed=True)
        before, detail = sky.status, sky.detail
        sky.send(ardupilot(ARMED, failure_flags=16, groundspeed=50), "radio")
        assert (sky.status, sky.detail) == (before, detail)
    sky.wait(1)
    sky.beat("radio")
    assert sky.send(ardupilot(DISARMED), "radio").drives_powered is FALSE


@pytest.mark.parametrize("message", [ardupilot(ARMED), ardupilot(DISARMED), px4()])
def test_heartbeats_that_come_again_count_at_once(message: mav.HighLatency2) -> None:
    sky = Sky()
    sky.send(message)
    sky.wait(30)
    status = sky.beat(armed=True, autopilot=message.autopilot, way="satellite")
    assert (status.drives_powered, status.motion_possible) == (TRUE, TRUE)
    assert sky.detail.vehicle.state == "ACTIVE"
    assert sky.wait(3.6).mode is RobotMode.UNKNOWN
    assert sky.link == "LOST"


@pytest.mark.parametrize("way", ["satellite", "radio"])
def test_high_latency2_counts_when_the_heartbeats_are_lost(way: str) -> None:
    sky = Sky()
    sky.beat("radio", armed=True)
    sky.wait(3)
    assert sky.send(ardupilot(ARMED), way).motion_possible is TRUE  # by the HEARTBEAT
    sky.wait(1)
    assert sky.inhibits == ([] if way == "satellite" else ["HEARTBEAT_LATE"])
    status = sky.send(ardupilot(ARMED), way)
    assert (status.drives_powered, status.motion_possible, sky.detail.vehicle.state) == (TRUE, UNKNOWN, None)
    sky.wait(60)
    assert sky.link == "CONNECTED"
    status = sky.beat("radio", armed=True)
    assert (status.motion_possible, sky.detail.vehicle.state) == (TRUE, "ACTIVE")


def test_a_stop_that_was_said_before_the_heartbeats_were_lost_stays_a_doubt() -> None:
    sky = Sky()
    sky.beat("radio", armed=True)
    sky.send(mav.Statustext(2, b"RC7: MotorEStop HIGH", 0, 0), "radio")
    assert sky.status.e_stopped is TRUE
    sky.wait(10)
    sky.send(ardupilot(ARMED))
    sky.wait(5)
    status = sky.beat("radio", armed=True)
    assert (status.e_stopped, status.drives_powered) == (UNKNOWN, TRUE)  # by satellite, where nobody spoke of a stop
    for _ in range(12):
        sky.wait(1)
        status = sky.beat("radio", armed=True)
    assert (status.e_stopped, status.drives_powered) == (UNKNOWN, UNKNOWN)


def test_nothing_is_asked_of_a_vehicle_behind_a_satellite() -> None:
    sky = Sky()
    for _ in range(30):
        sky.send(ardupilot(ARMED))
        assert sky.hw.due_requests(sky.clock.now()) == []
        sky.wait(5)
    asked = []
    for _ in range(8):
        sky.beat("satellite", armed=True)
        asked += sky.hw.due_requests(sky.clock.now())
        sky.wait(1)
    assert asked
    sky.wait(10)
    sky.send(ardupilot(ARMED))
    assert sky.hw.due_requests(sky.clock.now()) == []


def test_forged_messages_do_not_keep_the_places_of_vehicles_for_a_minute() -> None:
    sky = Sky()
    for ids in [(system, component) for system in range(2, 66) for component in (1, 2, 3, 4)]:
        sky.hw.on_frame(frame_of(px4(timestamp=5), ids), sky.clock.now(), None)
    assert len(list(sky.hw.vehicles)) == 256
    sky.hw.read(sky.clock.now())
    for _ in range(10):
        sky.clock.advance(1.0)
        sky.hw.on_frame(frame_of(mav.Heartbeat(4, QUAD, PX4, 81, 3, 3)), sky.clock.now(), None)
        sky.hw.read(sky.clock.now())
    found = sky.hw.find(1, 1)
    assert found is not None
    assert found.handle.detail.link is LinkState.CONNECTED


# -- who may speak -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["forger", "radio"])
def test_a_forged_high_latency2_does_not_make_a_live_vehicle_look_safe(way: str) -> None:
    sky = Sky()
    for second in range(120):
        sky.beat("radio", armed=True)
        status = sky.send(ardupilot(DISARMED), way, sequence=second % 2 * 128)
        assert status.drives_powered is not FALSE
        assert status.motion_possible is not FALSE
        sky.wait(0.5)
        assert sky.status.drives_powered is not FALSE
        sky.wait(0.5)


@pytest.mark.parametrize("way", ["forger", "satellite"])
def test_a_forged_high_latency2_does_not_make_a_vehicle_behind_a_satellite_look_safe(way: str) -> None:
    sky = Sky()
    for number in range(40):
        sky.send(ardupilot(ARMED), sequence=number)
        for _ in range(5):
            sky.wait(1)
            status = sky.send(ardupilot(DISARMED), way, sequence=number + 128 & 255)
            assert status.drives_powered is not FALSE
            assert status.motion_possible is not FALSE


@pytest.mark.parametrize("way", ["forger", "satellite"])
def test_a_forged_heartbeat_does_not_make_a_vehicle_behind_a_satellite_look_safe(way: str) -> None:
    sky = Sky()
    for number in range(20):
        sky.send(ardupilot(ARMED), sequence=number)
        for tick in range(5):
            sky.wait(1)
            status = sky.beat(way, sequence=number + 128 + tick & 255)
            assert status.drives_powered is not FALSE
            assert status.motion_possible is not FALSE


def test_an_armed_high_latency2_is_held_against_disarmed_heartbeats() -> None:
    sky = Sky()
    sky.beat("radio")
    sky.wait(1)
    assert sky.beat("radio").drives_powered is FALSE
    for second in range(20):
        if second % 5 == 0:
            sky.send(ardupilot(ARMED))
        sky.wait(1)
        assert sky.beat("radio").drives_powered is TRUE
        assert sky.inhibits == ["SENDER_UNCERTAIN"]
    assert sky.send(ardupilot(DISARMED)).drives_powered is FALSE


def test_an_armed_one_that_falls_silent_counts_for_three_of_its_intervals() -> None:
    sky = Sky()
    for _ in range(2):
        sky.send(ardupilot(ARMED))
        for _ in range(5):
            sky.beat("radio")
            sky.wait(1)
    for _ in range(12):
        assert sky.beat("radio").drives_powered is TRUE
        sky.wait(1)
    assert sky.beat("radio").drives_powered is FALSE


def test_high_latency2_without_a_word_of_arming_is_not_held_against_heartbeats() -> None:
    sky = Sky()
    for _ in range(10):
        sky.beat("radio", autopilot=PX4)
        assert sky.send(px4()).drives_powered is FALSE
        sky.wait(1)


@pytest.mark.parametrize(("way", "expected"), [("satellite", FALSE), ("radio", UNKNOWN)])
def test_another_kind_of_vehicle_with_the_same_ids_is_a_conflict(way: str, expected: TriState) -> None:
    """Both say disarmed. In one count nobody can tell them apart."""
    sky = Sky()
    for _ in range(8):
        sky.beat("radio")
        sky.send(ardupilot(DISARMED, type=ROVER), way)
        sky.wait(1)
    status = sky.beat("radio")
    assert (status.drives_powered, status.error_code) == (expected, causes.SYSTEM_ID_CONFLICT)


def test_an_armed_high_latency2_on_the_way_of_disarmed_heartbeats_is_a_doubt_until_the_next_one() -> None:
    sky = Sky()
    sky.beat("radio")
    sky.wait(0.5)
    assert sky.send(ardupilot(ARMED), "radio").drives_powered is UNKNOWN
    assert sky.wait(0.4).drives_powered is UNKNOWN
    assert sky.beat("radio").drives_powered is FALSE


def test_a_vehicle_whose_satellite_gives_it_a_new_address_is_followed() -> None:
    sky = Sky()
    for number in range(10):
        sky.send(px4(), f"port {number}", sequence=number)
        assert sky.belief.channel == f"port {number}"
        sky.wait(67)
    assert sky.codes == []


def test_a_disarmed_message_from_a_new_address_waits_until_the_old_one_is_lost() -> None:
    sky = Sky()
    sky.send(ardupilot(ARMED), "port 1")
    for _ in range(12):
        sky.wait(4.9)
        assert sky.send(ardupilot(DISARMED), "port 2").drives_powered is TRUE
    sky.wait(2)
    assert sky.send(ardupilot(DISARMED), "port 2").drives_powered is FALSE


WORDS = st.sampled_from(
    [
        ("beat", True),
        ("beat", False),
        ("high latency", True),
        ("high latency", False),
        ("untold", False),
    ]
)


@given(
    st.lists(st.tuples(WORDS, st.sampled_from(["a", "b"]), st.sampled_from([0.5, 1.0, 5.0, 20.0, 70.0])), max_size=20)
)
def test_no_order_of_messages_calls_a_vehicle_safe_that_a_live_heartbeat_calls_armed(events: Any) -> None:
    """Only what says armed within 3 s on a way of its own is certain to be held against the others."""
    sky = Sky()
    sky.beat("truth", armed=True)
    for (word, armed), way, pause in events:
        if word == "beat":
            sky.beat(way, armed=armed)
        else:
            sky.send(inav() if word == "untold" else ardupilot(ARMED if armed else DISARMED), way)
        sky.beat("truth", armed=True)
        assert sky.status.drives_powered is not FALSE
        assert sky.status.motion_possible is not FALSE
        sky.wait(pause)


@given(
    st.lists(st.tuples(WORDS, st.sampled_from(["a", "b", "truth"]), st.sampled_from([0.5, 1.0, 3.0, 4.0])), max_size=20)
)
def test_no_order_of_messages_calls_a_vehicle_safe_that_says_armed_by_high_latency2(events: Any) -> None:
    """The forger does not know its count of sequence numbers."""
    sky = Sky()
    for number, ((word, armed), way, pause) in enumerate([*events, (("untold", False), "a", 1.0)]):
        sky.send(ardupilot(ARMED), "truth", sequence=number)
        sequence = number + 100 & 255 if way == "truth" else None
        if word == "beat":
            sky.beat(way, armed=armed, sequence=sequence)
        else:
            sky.send(inav() if word == "untold" else ardupilot(ARMED if armed else DISARMED), way, sequence=sequence)
        assert sky.status.drives_powered is not FALSE
        assert sky.wait(pause).drives_powered is not FALSE


def after_heartbeats(way: str) -> Sky:
    """A sky in which an armed vehicle sent five HEARTBEATs."""
    sky = Sky()
    for _ in range(5):
        sky.beat(way, armed=True)
        sky.wait(1.0)
    return sky


def test_the_first_message_after_heartbeats_is_held_against_a_disarmed_sender_for_a_minute() -> None:
    sky = after_heartbeats("truth")
    sky.wait(5.0)
    sky.send(ardupilot(ARMED), "truth")
    for second in range(50):
        sky.beat("forger")
        if second % 5 == 4:
            sky.send(ardupilot(ARMED), "truth")
        assert sky.wait(1.0).drives_powered is not FALSE


def test_a_conflict_of_two_disarmed_senders_does_not_outvote_an_armed_message_on_a_third_way() -> None:
    sky = Sky()
    for second in range(40):
        sky.beat("radio")
        sky.send(mav.Heartbeat(4, 10, ARDUPILOT, 81, 3, 3), "wifi")
        if second % 15 == 5:
            sky.send(ardupilot(ARMED), "satellite")
        status = sky.wait(1.0)
        if second > 5:
            assert status.drives_powered is not FALSE
    assert 9002 in sky.codes


def test_an_armed_message_is_held_against_heartbeats_in_a_state_without_motion_on_its_way() -> None:
    sky = Sky()
    for number in range(10):
        sky.send(mav.Heartbeat(4, QUAD, ARDUPILOT, 209, 8, 3), "radio", sequence=number)
        sky.wait(0.5)
        status = sky.send(ardupilot(ARMED), "radio", sequence=number + 128)
        assert status.e_stopped is not TRUE
        sky.wait(0.5)


def test_of_two_vehicles_on_one_satellite_the_disarmed_one_with_the_later_clock_is_not_believed() -> None:
    sky = Sky()
    for number in range(12):
        sky.send(ardupilot(DISARMED), timestamp=5_000_000 + 5000 * number)
        sky.wait(1.0)
        status = sky.send(ardupilot(ARMED), timestamp=100_000 + 5000 * number)
        assert status.drives_powered is not FALSE
        assert sky.wait(4.0).drives_powered is not FALSE


@pytest.mark.parametrize("message", [ardupilot(), px4()])
def test_a_statement_equals_no_heartbeat_that_can_arrive(message: mav.HighLatency2) -> None:
    statement = stated(message)
    assert is_statement(statement)
    assert statement.mavlink_version > 255
    assert statement.system_status > 255
