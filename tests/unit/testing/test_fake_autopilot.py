from __future__ import annotations

import random
import socket
import threading
from collections import Counter
from typing import Any

import pytest

from mav_robot_status.testing import BY_NAME, DEMO, FakeAutopilot, Scenario, Step, arducopter, ardurover, decode, px4

SET_MESSAGE_INTERVAL, ARM_DISARM, DO_SET_MODE, RUN_PREARM_CHECKS = 511, 400, 176, 401
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)


def kinds(messages: list[Any]) -> set[str]:
    return {m.get_type() for m in messages}


def texts(messages: list[Any]) -> list[str]:
    return [m.text for m in messages if m.get_type() == "STATUSTEXT"]


# Streams


def test_a_silent_listener_of_a_copter_gets_heartbeats_only(stage: Any) -> None:
    received = stage(arducopter.MANUAL).play(12.0)
    assert kinds(received) == {"HEARTBEAT"}
    assert len(received) == 12 + 1 + 1  # one at once, one for the mode change


def test_a_requested_stream_has_the_requested_rate(stage: Any) -> None:
    at = stage(arducopter.READY)
    assert at.command(SET_MESSAGE_INTERVAL, 33, 250_000).result == ACCEPTED
    assert len(at.play(10.0, "GLOBAL_POSITION_INT")) == 40
    at.command(SET_MESSAGE_INTERVAL, 33, -1)
    assert at.play(3.0, "GLOBAL_POSITION_INT") == []


def test_interval_zero_is_the_default_rate(stage: Any) -> None:
    at = stage(px4.READY)
    at.command(SET_MESSAGE_INTERVAL, 33, 20_000_000)
    at.command(SET_MESSAGE_INTERVAL, 33, 0)
    assert len(at.play(4.0, "GLOBAL_POSITION_INT")) == 20


@pytest.mark.parametrize(
    ("message_id", "microseconds", "result"),
    [(1, 1e6, ACCEPTED), (245, 5e5, ACCEPTED), (9999, 1e6, FAILED), (436, 1e6, FAILED), (1, -7, DENIED),
     (float("nan"), 1e6, FAILED), (1, float("nan"), DENIED), (1, float("inf"), ACCEPTED)],
)  # fmt: skip
def test_set_message_interval_has_the_answers_of_ardupilot(
    stage: Any, message_id: float, microseconds: float, result: int
) -> None:
    ack = stage(ardurover.READY).command(SET_MESSAGE_INTERVAL, message_id, microseconds)
    assert (ack.command, ack.result) == (SET_MESSAGE_INTERVAL, result)
    assert (ack.target_system, ack.target_component) == (1, 192)


def test_the_old_stream_request_works_on_ardupilot(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.send(at.listener.mav.request_data_stream_encode(1, 1, 10, 4, 1), at.autopilot)
    assert len(at.play(5.05, "ATTITUDE")) == 20
    at.listener.send(at.listener.mav.request_data_stream_encode(1, 1, 0, 2, 1), at.autopilot)
    assert {"SYS_STATUS", "SERVO_OUTPUT_RAW", "SYSTEM_TIME", "VFR_HUD"} <= kinds(at.play(2.0))
    at.listener.send(at.listener.mav.request_data_stream_encode(1, 1, 0, 0, 0), at.autopilot)
    at.play(0.1)
    assert kinds(at.play(5.0)) == {"HEARTBEAT"}


def test_px4_streams_by_itself_but_texts_only_to_a_ground_station(stage: Any) -> None:
    at = stage(px4.RC_FAILSAFE)
    received = Counter(m.get_type() for m in at.play(4.0))
    assert (received["HEARTBEAT"], received["SYS_STATUS"], received["GLOBAL_POSITION_INT"], received["ATTITUDE"]) == (
        5,
        4,
        20,
        60,
    )
    assert received["STATUSTEXT"] == 0
    at.listener.ground_station_heartbeat(at.autopilot)
    assert "Failsafe activated: entering Hold for 5 seconds\t" in texts(at.play(8.0))


def test_sys_status_waits_until_ardupilot_is_initialised(stage: Any) -> None:
    at = stage(DEMO)
    assert "SYS_STATUS" not in kinds(at.play(1.9))
    first, *_ = at.play(1.0, "SYS_STATUS")
    assert not first.onboard_control_sensors_health & 1 << 28


# Commands


def test_arming_is_refused_while_the_checks_fail(stage: Any) -> None:
    at = stage(ardurover.PREARM_FAILING)
    at.play(3.0)
    at.listener.command(at.autopilot, ARM_DISARM, 1)
    received = at.play(0.1)
    assert [m.result for m in received if m.get_type() == "COMMAND_ACK"] == [FAILED]
    assert "Arm: Compass not healthy" in texts(received)
    assert not at.autopilot.state.armed
    assert at.command(ARM_DISARM, 1, 21196).result == ACCEPTED  # forced
    assert at.autopilot.state.armed


def test_ardupilot_runs_its_checks_on_command_and_names_every_reason(stage: Any) -> None:
    at = stage(ardurover.REASONS)
    at.play(1.0)
    at.listener.command(at.autopilot, RUN_PREARM_CHECKS)
    received = at.play(0.1)
    assert [m.result for m in received if m.get_type() == "COMMAND_ACK"] == [ACCEPTED]
    names = ("3D Accel calibration needed", "GPS 1: Bad fix", "Compass not calibrated")
    assert texts(received) == [f"PreArm: {name}" for name in names]
    at.listener.command(at.autopilot, ARM_DISARM, 1)
    assert texts(at.play(0.1)) == [f"Arm: {name}" for name in names]
    at.command(ARM_DISARM, 1, 21196)  # forced
    assert at.command(RUN_PREARM_CHECKS).result == TEMPORARILY_REJECTED


def test_px4_does_not_run_its_checks_in_texts(stage: Any) -> None:
    assert stage(px4.PREARM_FAILING).command(RUN_PREARM_CHECKS).result == UNSUPPORTED


def test_px4_refuses_with_its_result_and_its_text(stage: Any) -> None:
    at = stage(px4.PREARM_FAILING)
    at.listener.ground_station_heartbeat(at.autopilot)
    at.play(2.5)
    at.listener.command(at.autopilot, ARM_DISARM, 1)
    received = at.play(0.1)
    assert [m.result for m in received if m.get_type() == "COMMAND_ACK"] == [TEMPORARILY_REJECTED]
    assert texts(received) == ["Arming denied: Resolve system health failures firs", "t\t"]


def test_arming_and_disarming_are_announced(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.command(at.autopilot, ARM_DISARM, 1)
    assert texts(at.play(1.1)) == ["Throttle armed"]
    at.listener.command(at.autopilot, ARM_DISARM, 0)
    assert texts(at.play(1.1)) == ["Throttle disarmed"]


def test_a_flying_copter_is_not_disarmed_unless_forced(stage: Any) -> None:
    at = stage(arducopter.MANUAL)
    at.play(9.0)
    assert at.command(ARM_DISARM, 0).result == FAILED
    assert at.command(ARM_DISARM, 0, 21196).result == ACCEPTED


def test_a_mode_change_is_applied_and_reported_at_once(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.command(at.autopilot, DO_SET_MODE, 1, 10)
    received = at.play(0.05)
    assert [m.custom_mode for m in received if m.get_type() == "HEARTBEAT"] == [0, 10]
    assert [m.result for m in received if m.get_type() == "COMMAND_ACK"] == [ACCEPTED]


def test_the_old_set_mode_message_is_acknowledged_too(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.send(at.listener.mav.set_mode_encode(1, 1, 4), at.autopilot)
    assert [(m.command, m.result) for m in at.play(0.05, "COMMAND_ACK")] == [(11, ACCEPTED)]
    assert at.autopilot.state.custom_mode == 4


def test_px4_answers_a_mode_command_twice(stage: Any) -> None:
    at = stage(px4.READY)
    at.listener.command(at.autopilot, DO_SET_MODE, 1, 4, 4)
    assert [m.result for m in at.play(0.05, "COMMAND_ACK")] == [ACCEPTED, ACCEPTED]
    assert at.autopilot.state.custom_mode == px4.MISSION


@pytest.mark.parametrize("params", [(1, 99), (0, 4), (1, float("nan")), (float("inf"), 4)])
def test_an_impossible_mode_is_refused(stage: Any, params: tuple[float, ...]) -> None:
    at = stage(ardurover.READY)
    assert at.command(DO_SET_MODE, *params).result in (DENIED, FAILED)
    assert at.autopilot.state.custom_mode == 0


def test_a_message_can_be_requested_once(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.command(at.autopilot, 512, 1)
    received = at.play(2.0)
    assert [m.result for m in received if m.get_type() == "COMMAND_ACK"] == [ACCEPTED]
    assert sum(m.get_type() == "SYS_STATUS" for m in received) == 1


@pytest.mark.parametrize("command", [(512, 435), (512, 999), (185, 1)])
def test_an_unknown_command_is_unsupported(stage: Any, command: tuple[int, float]) -> None:
    assert stage(ardurover.READY).command(*command).result == UNSUPPORTED


def test_a_parameter_is_read_by_name_and_unknown_ones_have_no_answer(stage: Any) -> None:
    at = stage(ardurover.READY)
    for name in (b"SERVO3_FUNCTION", b"SERVO4_FUNCTION", b"NO_SUCH_PARAM"):
        at.listener.send(at.listener.mav.param_request_read_encode(1, 1, name, -1), at.autopilot)
    assert [(m.param_id, m.param_value) for m in at.play(0.1, "PARAM_VALUE")] == [
        ("SERVO3_FUNCTION", 70.0),
        ("SERVO4_FUNCTION", 0.0),
    ]


def test_a_message_for_another_vehicle_is_not_answered(stage: Any) -> None:
    at = stage(ardurover.READY, system=2)
    at.listener.command(at.autopilot, ARM_DISARM, 1)  # to system 1
    assert at.play(1.0, "COMMAND_ACK") == []
    assert at.autopilot.heard("COMMAND_LONG") == []


def test_several_vehicles_send_with_their_own_ids(stage: Any) -> None:
    vehicles = [
        stage(scenario, system=n, component=n + 4) for n, scenario in enumerate((ardurover.READY, px4.READY), 1)
    ]
    received = [m for at in vehicles for m in at.play(1.0, "HEARTBEAT")]
    assert {(m.get_srcSystem(), m.get_srcComponent(), m.autopilot) for m in received} == {(1, 5, 3), (2, 6, 12)}


# Scenarios


def test_a_scenario_changes_the_messages_at_its_times(stage: Any) -> None:
    at = stage(ardurover.RC_FAILSAFE)
    at.command(SET_MESSAGE_INTERVAL, 1, 500_000)
    seen = {}
    for second in range(1, 20):
        received = at.play(1.0)
        seen[second] = [(m.custom_mode, m.base_mode, m.system_status) for m in received if m.get_type() == "HEARTBEAT"][
            -1
        ]
        if second == 9:
            assert "Radio Failsafe" in texts(received)
        if second == 15:
            assert texts(received) == ["Radio Failsafe Cleared"]
    assert seen[2] == (0, 65, 4)
    assert seen[4] == (0, 193, 4)
    assert seen[7] == (10, 137, 4)
    assert seen[10] == (4, 129, 5)
    assert seen[16] == (4, 129, 3)
    assert seen[19] == (0, 193, 4)


def test_a_cut_link_neither_sends_nor_receives_until_it_is_restored(stage: Any) -> None:
    at = stage(ardurover.LINK_SILENCE)
    at.play(8.05)
    at.listener.command(at.autopilot, ARM_DISARM, 0)
    assert at.play(5.9) == []
    assert at.autopilot.state.armed
    assert at.autopilot.heard() == []
    assert at.play(1.1, "HEARTBEAT")


def test_a_reboot_restarts_times_and_sequence_and_forgets_requests(stage: Any) -> None:
    at = stage(ardurover.REBOOT)
    at.command(SET_MESSAGE_INTERVAL, 2, 500_000)
    before = at.play(7.9)
    assert before[-1].get_seq() > 15
    assert [m.time_boot_ms for m in before if m.get_type() == "SYSTEM_TIME"][-1] > 7000
    gap = at.play(1.2)
    assert gap == []
    first, *rest = at.play(10.0)
    assert (first.get_type(), first.get_seq()) == ("HEARTBEAT", 0)
    assert (first.custom_mode, first.system_status, first.base_mode) == (16, 2, 65)
    assert kinds(rest) == {"HEARTBEAT"}
    at.command(SET_MESSAGE_INTERVAL, 2, 500_000)
    assert 9_000 < at.play(1.0, "SYSTEM_TIME")[0].time_boot_ms < 12_000
    assert at.autopilot.state == ardurover.READY.start


def test_system_time_has_the_time_of_the_poll(stage: Any) -> None:
    at = stage(DEMO)
    (*_, message) = at.play(7.0, "SYSTEM_TIME")
    assert at.clock.now().unix_us - 1_000_000 < message.time_unix_usec <= at.clock.now().unix_us


@pytest.mark.parametrize("scenario", BY_NAME.values(), ids=BY_NAME)
def test_every_scenario_runs_to_its_end(stage: Any, scenario: Scenario) -> None:
    at = stage(scenario, speed=4.0)
    received = at.play(scenario.duration / 4 + 4.0)  # a reboot adds its boot
    assert at.autopilot.finished
    assert ("HIGH_LATENCY2" if scenario.satellite else "HEARTBEAT") in kinds(received)


@pytest.mark.parametrize(("scenario", "period"), [(ardurover.SATELLITE, 5.0), (px4.SATELLITE, 1 / 0.015)])
def test_behind_a_satellite_it_sends_nothing_but_high_latency2(stage: Any, scenario: Scenario, period: float) -> None:
    at = stage(scenario)
    received = at.play(3 * period + 1.0)
    assert kinds(received) == {"HIGH_LATENCY2"}
    assert len(received) == 4
    assert [m.custom0 for m in received] == ([-128] * 4 if scenario is px4.SATELLITE else [65, -63, -119, 9])


def test_the_demo_sends_the_messages_that_a_gateway_needs(stage: Any) -> None:
    at = stage(DEMO)
    received = at.play(DEMO.duration + 1.0)
    assert texts(received) == [
        "Beginning INS calibration. Do not move vehicle",
        "ArduPilot Ready",
        "AHRS: DCM active",
        "PreArm: GPS 1: Bad fix",
        "AHRS: EKF3 active",
        "Throttle armed",
        "Mission: 1 WP",
        "Radio Failsafe",
        "Radio Failsafe Cleared",
        "Mission: 1 WP",
        "RC7: MotorEStop HIGH",
        "RC7: MotorEStop LOW",
        "Crash: Going to HOLD",
        "Throttle disarmed",
    ]
    assert all(m.onboard_control_sensors_present & 1 << 15 for m in received if m.get_type() == "SYS_STATUS")
    assert at.play(3.0) == []


# Changes by a test


def test_a_test_can_change_the_vehicle(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.command(SET_MESSAGE_INTERVAL, 30, 1e6)
    at.autopilot.arm()
    at.autopilot.set_mode(77)
    at.autopilot.say(4, "EKF variance")
    at.autopilot.set(rates=(0.0, 0.0, 0.5))
    received = at.play(1.1)
    heartbeat = [m for m in received if m.get_type() == "HEARTBEAT"][-1]
    assert (heartbeat.custom_mode, heartbeat.base_mode) == (77, 129)
    assert texts(received) == ["Throttle armed", "EKF variance"]
    assert [round(m.yawspeed, 2) for m in received if m.get_type() == "ATTITUDE"] == [0.5]
    at.autopilot.silence()
    assert at.play(3.0) == []
    at.autopilot.resume()
    assert at.play(1.1)
    at.autopilot.disarm()
    at.autopilot.reboot()
    at.play(0.05)
    assert at.play(1.1) == []
    assert at.play(0.2)[0].custom_mode == 16


def test_a_misspelt_field_is_an_error_at_the_call(stage: Any) -> None:
    with pytest.raises((TypeError, ValueError), match="spede"):
        stage(ardurover.READY).autopilot.set(spede=3)


def test_it_returns_the_messages_that_it_received(stage: Any) -> None:
    at = stage(ardurover.READY)
    at.listener.ground_station_heartbeat(at.autopilot)
    at.listener.command(at.autopilot, SET_MESSAGE_INTERVAL, 1, 1e6)
    at.play(0.1)
    assert [m.get_type() for m in at.autopilot.heard()] == ["HEARTBEAT", "COMMAND_LONG"]
    assert [m.param1 for m in at.autopilot.heard("COMMAND_LONG")] == [1.0]


def test_the_list_of_received_messages_is_bounded(stage: Any) -> None:
    at = stage(ardurover.READY)
    for _ in range(12):
        for _ in range(100):
            at.listener.ground_station_heartbeat(at.autopilot)
        at.play(0.05)
    assert len(at.autopilot.heard()) == 1000


def test_without_an_address_it_answers_the_latest_sender(stage: Any) -> None:
    at = stage(ardurover.READY, to=None)
    assert at.play(2.0) == []
    at.listener.ground_station_heartbeat(at.autopilot)
    assert kinds(at.play(2.0)) == {"HEARTBEAT"}


def test_garbage_has_no_effect(stage: Any) -> None:
    at = stage(ardurover.READY)
    chance = random.Random(1)
    frame = at.listener.mav.command_long_encode(1, 1, ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0).pack(at.listener.mav)
    junk = [b"", b"\xfd", b"\xfe", frame[:-1], frame[:5], b"\xfd" * 300, bytes(range(256))]
    junk += [chance.randbytes(chance.randrange(1, 300)) for _ in range(200)]
    junk += [
        bytes((b ^ (chance.random() < 0.1)) for b in frame[:1] + chance.randbytes(9) + frame[10:]) for _ in range(200)
    ]
    for datagram in junk:
        at.listener.socket.sendto(datagram, at.autopilot.address)
        at.autopilot.poll(at.clock.advance(0.01))
    assert not at.autopilot.state.armed
    at.listener.socket.sendto(b"noise before" + frame, at.autopilot.address)
    at.play(0.05)
    assert at.autopilot.state.armed


def test_a_missing_gateway_has_no_effect(stage: Any) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(("127.0.0.1", 0))
        address = gone.getsockname()
    stage(DEMO, to=address).play(5.0)


def test_a_port_in_use_is_an_error_and_leaves_nothing_open(listener: Any) -> None:
    with pytest.raises(OSError, match="in use"):
        FakeAutopilot(ardurover.READY, bind=listener.address)


# In a thread


def test_it_runs_in_a_thread_and_stops_cleanly(listener: Any) -> None:
    listener.socket.settimeout(5.0)
    threads = threading.active_count()
    notes: list[Step] = []
    with FakeAutopilot(ardurover.MANUAL, to=listener.address, speed=1000.0, on_note=notes.append) as autopilot:
        assert listener.socket.recv(300)[:1] == b"\xfd"
        autopilot.set_mode(4)
        assert any(decode(listener.socket.recv(300))[0].to_dict().get("custom_mode") == 4 for _ in range(100))
    assert threading.active_count() == threads
    assert autopilot.finished
    assert [n.note for n in notes] == [s.note for s in ardurover.MANUAL.steps]


def test_the_example_in_the_documentation_works() -> None:
    import doctest

    import mav_robot_status.testing

    result = doctest.testmod(mav_robot_status.testing)
    assert result.attempted == 3
    assert result.failed == 0
