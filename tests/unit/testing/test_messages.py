from __future__ import annotations

from mav_robot_status.mavlink.enumerations import EKF_CONST_POS_MODE
from mav_robot_status.testing.firmwares import ARDUROVER, PX4_QUAD
from mav_robot_status.testing.messages import BUILDERS, Snapshot, can_send, statustexts
from mav_robot_status.testing.scenario import Text

SNAPSHOT = Snapshot(ARDUROVER, ARDUROVER.ready._replace(velocity=(3.0, 4.0, -1.0)), True, 1234, 42)


def test_every_message_with_a_velocity_has_that_of_the_vehicle() -> None:
    position, local, hud = (BUILDERS[i](SNAPSHOT).to_dict() for i in (33, 32, 74))
    assert (position["vx"], position["vy"], position["vz"]) == (300, 400, -100)
    assert (local["vx"], local["vy"], local["vz"]) == (3.0, 4.0, -1.0)
    assert (hud["groundspeed"], hud["climb"]) == (5.0, 1.0)


def test_without_a_fix_the_position_is_zero() -> None:
    lost = SNAPSHOT._replace(state=SNAPSHOT.state._replace(position=False))
    assert BUILDERS[33](lost).to_dict()["lat"] == 0
    assert BUILDERS[33](SNAPSHOT).to_dict()["lat"] != 0


def test_servo_outputs_can_be_set_directly() -> None:
    outputs = BUILDERS[36](SNAPSHOT._replace(state=SNAPSHOT.state._replace(servos=(1100, 1200)))).to_dict()
    assert [outputs[f"servo{n}_raw"] for n in (1, 2, 3, 16)] == [1100, 1200, 0, 0]


def test_only_px4_has_current_mode() -> None:
    assert can_send(PX4_QUAD, 436)
    assert not can_send(ARDUROVER, 436)


def test_only_ardupilot_reports_whether_its_speed_is_measured() -> None:
    lost = SNAPSHOT._replace(state=SNAPSHOT.state._replace(position=False))
    assert can_send(ARDUROVER, 193)
    assert not can_send(PX4_QUAD, 193)
    flags = [BUILDERS[193](snapshot).to_dict()["flags"] for snapshot in (lost, SNAPSHOT)]
    assert [bool(int(flag) & EKF_CONST_POS_MODE) for flag in flags] == [True, False]


def test_short_ardupilot_texts_have_no_number_and_long_ones_are_chunks() -> None:
    (short,) = (m.to_dict() for m in statustexts(ARDUROVER, Text(4, "Radio Failsafe"), 7))
    assert (short["text"], short["id"]) == ("Radio Failsafe", 0)
    chunks = [m.to_dict() for m in statustexts(ARDUROVER, Text(2, "x" * 60), 7)]
    assert [(c["id"], c["chunk_seq"], len(c["text"])) for c in chunks] == [(7, 0, 50), (7, 1, 10)]


def test_px4_numbers_every_text_and_ends_a_full_chunk_with_an_empty_one() -> None:
    chunks = [m.to_dict() for m in statustexts(PX4_QUAD, Text(2, "x" * 50), 3)]
    assert [(c["id"], c["chunk_seq"], len(c["text"])) for c in chunks] == [(3, 0, 50), (3, 1, 0)]
