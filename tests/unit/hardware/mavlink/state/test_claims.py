"""Sequences of senders with one id: whose heartbeats count, and what is said meanwhile."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.state.claims import (
    HOLD,
    LIVE,
    MOST_CLAIMS,
    MOST_COPIES,
    PERSISTS,
    PROOFS,
    SILENCE,
    Claims,
    Outcome,
)
from mav_robot_status.hardware.mavlink.vehicle import ExpectedVehicle
from mav_robot_status.interface import RobotMode, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.framing import Frame
from mav_robot_status.testing import ManualClock

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
FIELDS = ("e_stopped", "drives_powered", "motion_possible", "in_motion")
APART_MS = 900_000


class Air:
    """Senders on ways to one hardware interface. Each way has its own count of sequence numbers."""

    def __init__(self, slots: tuple[ExpectedVehicle, ...] = ()) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(None, slots)
        self.counts: dict[Any, int] = {}

    def send(self, message: Any, message_id: int, way: Any, sequence: int | None, ids: tuple[int, int]) -> bool:
        if sequence is None:
            self.counts[way] = sequence = self.counts.get(way, 100) + 1 & 255
        now = self.clock.now()
        taken = self.hw.take((message_id, ids, sequence, message, b"", 0), now, way)
        self.hw.read(now)
        return taken is not None

    def beat(
        self,
        way: Any = "radio",
        *,
        armed: bool = False,
        mode: int = 3,
        vehicle_type: int = 2,
        state: int = 4,
        flags: int = 0,
        sequence: int | None = None,
        ids: tuple[int, int] = (1, 1),
    ) -> bool:
        message = mav.Heartbeat(mode, vehicle_type, 3, 217 | flags if armed else 89, state if armed else 3, 3)
        return self.send(message, 0, way, sequence, ids)

    def text(self, way: Any, words: str) -> None:
        self.send(mav.Statustext(6, words.encode(), 0, 0), 253, way, None, (1, 1))

    def attitude(self, way: Any, clock_ms: int, sequence: int | None = None) -> None:
        self.send(mav.Attitude(clock_ms, 0.0, 0.0, 0.0), 30, way, sequence, (1, 1))

    def wait(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self.hw.read(self.clock.now())

    @property
    def status(self) -> Any:
        return next(self.hw.vehicles).handle.status

    @property
    def errors(self) -> Any:
        return next(self.hw.vehicles).handle.detail.errors

    @property
    def claims(self) -> Claims[Any]:
        return next(self.hw.vehicles).claims

    def is_unknown(self) -> bool:
        return self.status.mode is RobotMode.UNKNOWN and all(getattr(self.status, name) is UNKNOWN for name in FIELDS)


def test_frames_of_the_first_way_count_and_those_of_another_do_not() -> None:
    air = Air()
    for _ in range(10):
        assert air.beat("radio")
        assert not air.beat("wifi")
        air.wait(1)
    assert air.claims.way == "radio"
    assert air.claims.unused == 10
    assert air.status.drives_powered is FALSE


def test_a_silent_way_is_replaced_before_the_link_is_lost_and_the_log_says_so(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO")
    air = Air()
    air.beat("radio")
    taken = []
    for tenth in range(40):
        if air.beat("wifi"):
            taken.append(tenth / 10)
        air.wait(0.1)
    assert SILENCE < taken[0] < 3.5
    assert "vehicle 1.1: now heard on wifi, no longer on radio" in caplog.messages


def test_only_a_heartbeat_selects_another_way() -> None:
    air = Air()
    air.beat("radio")
    air.wait(9)
    air.attitude("wifi", 1000)
    assert air.claims.way == "radio"
    air.beat("wifi")
    assert air.claims.way == "wifi"


def test_a_disarmed_sender_does_not_take_over_from_an_armed_one_before_the_vehicle_is_lost() -> None:
    air = Air()
    air.beat("radio", armed=True)
    for _ in range(6):
        air.wait(0.5)
        assert not air.beat("wifi")
        assert air.status.drives_powered is TRUE
    air.wait(0.6)
    assert air.beat("wifi")


@pytest.mark.parametrize("first_armed", [True, False])
def test_disarmed_is_unknown_at_once_while_a_live_sender_elsewhere_is_armed(first_armed: bool) -> None:
    air = Air()
    air.beat("radio", armed=first_armed)
    air.wait(0.2)
    air.beat("wifi", armed=not first_armed)
    if first_armed:
        assert air.status.drives_powered is TRUE
    else:
        assert air.is_unknown()
    assert air.status.error_code == 0


AT_REST = [{"state": 8}, {"state": 6}, {"flags": 32}]
"""What an armed heartbeat says of a vehicle that does not move: FLIGHT_TERMINATION, EMERGENCY, HIL."""


@pytest.mark.parametrize("says", AT_REST)
def test_a_sender_that_was_heard_first_is_not_believed_that_an_armed_vehicle_elsewhere_is_stopped(says: Any) -> None:
    air = Air()
    air.beat("forger", armed=True, **says)
    assert FALSE in (air.status.motion_possible, air.status.drives_powered)
    air.wait(0.2)
    air.beat("radio", armed=True)
    assert air.is_unknown()
    for _ in range(12):
        air.wait(0.5)
        air.beat("forger", armed=True, **says)
        air.beat("radio", armed=True)
        assert FALSE not in (air.status.motion_possible, air.status.drives_powered)
        assert air.status.e_stopped is not TRUE
    assert 9002 in [error.code for error in air.errors]


@pytest.mark.parametrize("says", AT_REST)
def test_a_dropout_of_an_armed_vehicle_does_not_make_a_sender_the_vehicle_that_calls_it_stopped(says: Any) -> None:
    air = Air()
    air.beat("radio", armed=True)
    for _ in range(6):
        air.wait(0.5)
        assert not air.beat("forger", armed=True, **says)
        assert air.status.motion_possible is TRUE


@pytest.mark.parametrize("mode", [0, 3])
def test_what_one_sender_said_of_its_stop_is_in_doubt_when_another_way_counts(mode: int) -> None:
    """The two may be two vehicles: nothing shows that they are one."""
    air = Air()
    for _ in range(3):
        air.beat("wifi", armed=True, mode=mode)
        air.wait(0.5)
        air.beat("radio", armed=True)
        air.wait(0.5)
    air.text("wifi", "RC7: MotorEStop HIGH")
    assert air.status.e_stopped is TRUE
    for _ in range(60):
        air.wait(1.0)
        air.beat("radio", armed=True)
    assert air.status.mode is RobotMode.AUTO
    assert (air.status.e_stopped, air.status.drives_powered) == (UNKNOWN, UNKNOWN)


def test_a_vehicle_whose_clock_is_the_same_on_two_ways_stays_stopped_on_the_other_way() -> None:
    air = Air()
    for second in range(8):
        for way in ("wifi", "radio"):
            air.beat(way, armed=True)
            air.attitude(way, 60_000 + 1000 * second)
        air.wait(1.0)
    air.text("wifi", "RC7: MotorEStop HIGH")
    assert air.status.e_stopped is TRUE
    for second in range(3):
        air.wait(1.0)
        air.beat("radio", armed=True)
        air.attitude("radio", 68_000 + 1000 * second)
    assert (air.status.e_stopped, air.status.drives_powered) == (TRUE, FALSE)


def test_a_link_that_is_closed_does_not_take_back_that_its_vehicle_is_armed() -> None:
    air = Air()
    for _ in range(3):
        air.beat("radio", armed=True)
        air.beat("wifi")
        air.wait(1.0)
    air.beat("radio", armed=True)
    air.claims.keep(lambda way: way == "wifi")
    air.wait(0.1)
    air.beat("wifi")
    assert air.status.drives_powered is UNKNOWN


def test_a_vehicle_on_two_ways_that_is_stopped_is_unknown_until_both_say_so() -> None:
    air = Air()
    for way in ("radio", "wifi"):
        air.beat(way, armed=True)
    air.wait(0.5)
    air.beat("radio", armed=True, state=8)
    assert air.is_unknown()
    air.wait(0.3)
    air.beat("wifi", armed=True, state=8)
    assert (air.status.e_stopped, air.status.drives_powered) == (TRUE, FALSE)
    assert 9002 not in [error.code for error in air.errors]


def test_a_stop_in_the_state_that_does_not_continue_the_count_is_believed_after_the_armed_heartbeat_is_old() -> None:
    air = Air()
    air.beat(armed=True, sequence=10)
    air.wait(1.0)
    air.beat(armed=True, sequence=11)
    air.wait(1.0)
    air.beat(armed=True, state=8, sequence=200)
    assert air.is_unknown()
    for number in range(201, 204):
        air.wait(1.0)
        air.beat(armed=True, state=8, sequence=number)
    assert air.status.e_stopped is TRUE


def test_a_disagreement_that_lasts_is_a_conflict_until_some_time_after_one_is_silent(
    caplog: pytest.LogCaptureFixture,
) -> None:
    air = Air()
    for _ in range(round(PERSISTS) + 2):
        air.beat("radio")
        air.beat("wifi", armed=True)
        air.wait(1)
        assert air.is_unknown()
    assert air.status.error_code == 9002
    assert "claim the ids 1.1: radio and wifi (armed and disarmed at the same time)" in caplog.text
    for second in range(20):
        air.beat("radio")
        assert air.is_unknown() == (second < HOLD - 1), second
        air.wait(1)
    assert air.status.error_code == 0
    assert air.status.drives_powered is FALSE


def test_another_type_on_another_way_is_a_conflict_at_once_and_disarmed_counts_if_both_say_so() -> None:
    air = Air()
    air.beat("radio")
    air.wait(0.1)
    air.beat("wifi", vehicle_type=10)
    assert air.status.error_code == 9002
    assert (air.status.drives_powered, air.status.motion_possible) == (FALSE, FALSE)
    assert (air.status.mode, air.status.e_stopped, air.status.in_motion) == (RobotMode.UNKNOWN, UNKNOWN, UNKNOWN)


def test_armed_counts_during_a_conflict_if_both_say_so() -> None:
    air = Air()
    for _ in range(3):
        air.beat("radio", armed=True)
        air.beat("wifi", armed=True, vehicle_type=10)
        air.wait(1)
    assert (air.status.drives_powered, air.status.motion_possible) == (TRUE, UNKNOWN)


def test_a_copy_of_a_heartbeat_on_another_way_is_no_claim_however_late() -> None:
    air = Air()
    for number in range(8):
        air.beat("radio", armed=True, sequence=number)
        air.beat("wifi", armed=True, sequence=number)
        air.wait(1)
    air.beat("radio", sequence=8)
    assert air.status.drives_powered is FALSE
    air.beat("wifi", armed=True, sequence=7)
    assert air.status.drives_powered is FALSE


def test_the_same_words_with_another_count_are_a_claim() -> None:
    air = Air()
    for number in range(3):
        air.beat("radio", armed=True, sequence=number)
        air.wait(1)
    air.beat("radio", sequence=3)
    air.beat("wifi", armed=True, sequence=77)
    assert air.is_unknown()


def test_a_vehicle_on_two_ways_that_disarms_is_unknown_until_both_say_so() -> None:
    air = Air()
    air.beat("radio", armed=True)
    air.beat("wifi", armed=True)
    air.wait(1)
    air.beat("radio")
    assert air.is_unknown()
    air.wait(0.3)
    air.beat("wifi")
    assert air.status.drives_powered is FALSE


@pytest.mark.parametrize(("apart", "conflict"), [(9_000, False), (APART_MS, True)])
def test_clocks_on_two_ways_distinguish_a_slow_way_from_another_vehicle(apart: int, conflict: bool) -> None:
    air = Air()
    for tenth in range(PROOFS * 5 + 5):
        air.attitude("radio", 1_000_000 + tenth * 100)
        air.attitude("wifi", 1_000_000 + tenth * 100 - apart)
        if tenth % 10 == 0:
            air.beat("radio")
            air.beat("wifi")
        air.wait(0.1)
    assert (air.status.error_code == 9002) == conflict


def test_a_reboot_seen_on_two_ways_is_not_a_conflict() -> None:
    air = Air()
    for tenth in range(60):
        now, late = tenth * 100, tenth * 100 - 400  # the radio is slow
        if tenth % 10 == 0:
            air.beat("radio")
            air.beat("wifi")
        air.attitude("wifi", now + 600_000 if tenth < 30 else now - 3000)
        air.attitude("radio", late + 600_000 if tenth < 34 else late - 3000)
        air.wait(0.1)
        assert air.status.error_code == 0


def test_two_senders_on_one_way_that_alternate_are_a_conflict_and_never_stopped() -> None:
    air = Air()
    for number in range(12):
        air.beat(sequence=number)
        air.wait(0.5)
        air.beat(armed=True, sequence=number + 100)
        air.wait(0.5)
        air.beat(sequence=number + 1)
        assert air.is_unknown()
        assert number < 3 or air.status.error_code == 9002
        air.wait(0.5)


def test_a_disarm_that_does_not_continue_the_count_is_believed_after_the_armed_heartbeat_is_old() -> None:
    air = Air()
    air.beat(armed=True, sequence=5)
    air.wait(1)
    air.beat(sequence=105)
    assert air.is_unknown()
    air.wait(1)
    air.beat(sequence=106)
    assert air.is_unknown()
    air.wait(LIVE - 1)
    assert air.status.drives_powered is FALSE
    assert air.status.error_code == 0


def test_a_disarm_that_follows_a_stream_of_another_count_is_not_believed_at_once() -> None:
    air = Air()
    air.beat(armed=True, sequence=5)
    air.attitude("radio", 1000, sequence=105)
    air.wait(0.1)
    air.beat(sequence=106)
    assert air.is_unknown()


@pytest.mark.parametrize("sequence", [6, 20, 0])
def test_a_disarm_that_continues_the_count_is_believed_at_once(sequence: int) -> None:
    air = Air()
    for number in (sequence - 3, sequence - 2):
        air.beat(armed=True, sequence=number & 255)
        air.wait(1)
    air.beat(sequence=sequence)
    assert air.status.drives_powered is FALSE


def test_a_person_who_arms_disarms_and_arms_again_is_not_a_conflict() -> None:
    air = Air()
    for armed in (False, True, False, True):
        air.beat(armed=armed)
        air.wait(1.2)
    assert air.status.error_code == 0
    assert air.status.drives_powered is TRUE


def test_modes_in_turn_on_one_way_are_a_conflict() -> None:
    air = Air()
    for number in range(8):
        air.beat(mode=3 + number % 2, sequence=number + 100 * (number % 2))
        air.wait(0.4)
    assert air.status.error_code == 9002


def test_a_program_that_arms_and_disarms_in_turn_is_one_sender_if_its_count_goes_on() -> None:
    air = Air()
    for number in range(8):
        air.beat(armed=number % 2 == 1, mode=3 + number % 2)
        air.wait(0.1)
    assert air.status.error_code == 0
    assert air.status.drives_powered is TRUE


def test_another_vehicle_that_takes_over_after_a_loss_starts_with_a_new_state() -> None:
    air = Air()
    air.beat("radio")
    air.send(mav.Statustext(0, b"Crash: Disarming: AngErr=42", 0, 0), 253, "radio", None, (1, 1))
    assert air.status.error_code == 4001
    air.wait(5)
    air.beat("wifi", vehicle_type=10)
    assert air.status.error_code == 0
    assert next(air.hw.vehicles).handle.detail.vehicle.type == "GROUND_ROVER"


def test_another_vehicle_that_has_run_for_longer_starts_with_a_new_state_after_a_loss() -> None:
    air = Air()
    air.beat("radio")
    air.attitude("radio", 10_000)
    air.send(mav.Statustext(0, b"Crash: Disarming: AngErr=42", 0, 0), 253, "radio", None, (1, 1))
    air.wait(5)
    air.beat("radio")
    assert air.status.error_code == 4001
    air.attitude("radio", APART_MS)
    assert air.status.error_code == 0


def test_component_one_takes_the_handle_of_its_system_from_another_component() -> None:
    air = Air((ExpectedVehicle(1),))
    assert air.beat("forger", ids=(1, 77))
    assert air.beat("radio", armed=True)
    assert [tracked.ids for tracked in air.hw.vehicles] == [(1, 1)]
    assert air.status.drives_powered is TRUE
    assert not air.beat("forger", ids=(1, 77))


def test_a_forged_component_one_cannot_say_disarmed_of_a_live_armed_component() -> None:
    air = Air((ExpectedVehicle(1),))
    air.beat("radio", armed=True, ids=(1, 77))
    for _ in range(12):
        air.beat("forger", ids=(1, 1))
        assert air.is_unknown()
        air.wait(0.5)
        air.beat("radio", armed=True, ids=(1, 77))
    assert air.status.error_code == 9002


def test_another_component_never_gets_the_handle_of_an_autopilot_that_was_there() -> None:
    air = Air((ExpectedVehicle(1),))
    for _ in range(8):
        air.beat("radio")
        air.wait(1)
    for _ in range(60):
        air.wait(1)
        assert not air.beat("forger", ids=(1, 77))


def test_a_signed_vehicle_is_heard_at_once_and_nobody_else_claims_its_ids() -> None:
    air = Air()
    air.beat("forger")
    air.claims.verified("radio", air.clock.now().mono)
    assert air.beat("radio", armed=True)
    for _ in range(8):
        assert not air.beat("forger")
        assert air.beat("radio", armed=True)
        assert air.status.drives_powered is TRUE
        air.wait(1)
    assert air.status.error_code == 0


def test_a_vehicle_continues_on_the_most_recent_remaining_way() -> None:
    air = Air()
    for way in ("radio", "cable", "wifi"):
        air.beat(way)
        air.wait(0.1)
    air.claims.keep(lambda way: way != "radio")
    assert air.claims.way == "wifi"
    assert air.beat("wifi")


def test_a_vehicle_without_a_remaining_way_is_forgotten() -> None:
    air = Air()
    air.beat("radio")
    air.claims.keep(lambda way: way == "cable")
    assert air.claims.way is None


BEATS = st.tuples(st.integers(0, 20), st.booleans(), st.integers(0, 255), st.sampled_from([0.0, 0.3, 1.6, 4.0]))


@given(st.lists(BEATS, max_size=60))
def test_any_number_of_senders_uses_bounded_memory(beats: list[tuple[int, bool, int, float]]) -> None:
    air = Air()
    for way, armed, sequence, pause in beats:
        air.beat(way, armed=armed, sequence=sequence)
        air.attitude(way, sequence * 1000)
        air.wait(pause)
        assert len(air.claims.others) <= MOST_CLAIMS + 1
        assert len(air.claims._copies) <= MOST_COPIES


def test_an_armed_claim_is_not_pushed_out_by_many_disarmed_ones() -> None:
    air = Air()
    air.beat("radio")
    air.beat("wifi", armed=True)
    for number in range(3 * MOST_CLAIMS):
        air.beat(number)
    assert air.is_unknown()


def test_the_first_heartbeat_selects_its_way_without_a_hardware_interface() -> None:
    claims: Claims[str] = Claims()
    beat = Frame(0, (1, 1), 0, mav.Heartbeat(0, 2, 3, 0, 3, 3), b"").message
    assert claims.elsewhere(beat, 0, "radio", ManualClock().now(), None, 3.5) is Outcome.SELECTED


def test_a_copy_that_becomes_the_selected_way_is_a_claim_of_its_own() -> None:
    air = Air()
    air.beat("radio", armed=True, sequence=10)
    air.beat("cable", armed=True, sequence=10)
    air.wait(0.1)
    air.beat("radio", armed=True, sequence=11)
    air.beat("cable", armed=True, sequence=11)
    air.wait(11)
    assert air.beat("cable", armed=True, sequence=22)
    air.beat("cable", sequence=150)
    assert air.status.drives_powered is UNKNOWN


def test_what_a_way_said_long_ago_does_not_hide_what_another_says_now() -> None:
    claims = Claims[str]()
    claims.armed_at = claims.disarmed_at = 20.0
    for base_mode in (128, 0):
        claims._note(mav.Heartbeat(0, 10, 3, base_mode, 4, 3), 10.0)
    assert (claims.armed_at, claims.disarmed_at) == (20.0, 20.0)
