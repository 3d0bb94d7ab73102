"""Senders with one id, seen from outside: whose words are in the status, and when several claim the ids."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.belief import Belief
from mav_robot_status.hardware.mavlink.belief.belief import MOST_SPEAKERS
from mav_robot_status.hardware.mavlink.belief.speakers import HOLD, STANDS
from mav_robot_status.hardware.mavlink.interface import SETTLES, MavlinkRobotHW
from mav_robot_status.hardware.mavlink.vehicle import ExpectedVehicle, TrackedVehicle
from mav_robot_status.interface import Detail, LinkState, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.testing import ManualClock

from .driver import Numbers, check_invariants, frame_of, statustext

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
FIELDS = ("e_stopped", "drives_powered", "motion_possible", "in_motion")
APART_MS = 900_000
LOST = 3.6  # s


class Air:
    """Senders on channels to one hardware interface. Each channel has its own count of sequence numbers."""

    def __init__(self, slots: tuple[ExpectedVehicle, ...] = ()) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(None, slots)
        self._numbers = Numbers()
        self._first: dict[Any, int] = {}

    def send(self, message: Any, channel: Any, sequence: int | None = None, ids: tuple[int, int] = (1, 1)) -> bool:
        """One message. Returns whether it is a heartbeat of the vehicle, and its news."""
        first = self._first.setdefault(channel, 60 * len(self._first))
        number = (self._numbers.next(channel) + first if sequence is None else sequence) & 255
        taken = self.hw.on_frame(frame_of(message, ids, number), self.clock.now(), channel)
        self._read()
        return taken is not None

    def beat(
        self,
        channel: Any = "radio",
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
        return self.send(message, channel, sequence, ids)

    def text(self, channel: Any, words: str) -> None:
        self.send(statustext(words, 6), channel)

    def attitude(self, channel: Any, clock_ms: int, sequence: int | None = None) -> None:
        self.send(mav.Attitude(clock_ms, 0.0, 0.0, 0.0), channel, sequence)

    def wait(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self._read()

    def _read(self) -> None:
        self.hw.read(self.clock.now())
        for tracked in self.hw.vehicles:
            check_invariants(tracked.handle.status, tracked.handle.detail, self.hw.options)

    @property
    def vehicle(self) -> TrackedVehicle:
        return next(self.hw.vehicles)

    @property
    def status(self) -> RobotStatus:
        return self.vehicle.handle.status

    @property
    def detail(self) -> Detail:
        return self.vehicle.handle.detail

    @property
    def drives(self) -> TriState:
        return self.status.drives_powered

    @property
    def belief(self) -> Belief:
        return self.vehicle.belief

    @property
    def codes(self) -> list[int]:
        return [error.code for error in self.detail.errors]

    @property
    def inhibits(self) -> set[str]:
        return {inhibit.name for inhibit in self.detail.inhibits}

    def is_unknown(self) -> bool:
        return self.status.mode is RobotMode.UNKNOWN and all(getattr(self.status, name) is UNKNOWN for name in FIELDS)


# -- one sender --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lost", [0, 10, 48])
def test_a_disarm_that_continues_the_count_is_believed_at_once(lost: int) -> None:
    air = Air()
    for number in range(3):
        air.beat(armed=True, sequence=number)
        air.wait(1)
    air.beat(sequence=3 + lost)
    assert air.drives is FALSE


def test_a_disarm_after_a_gap_that_is_too_long_is_that_of_another_speaker_until_the_armed_one_is_silent() -> None:
    air = Air()
    for number in range(3):
        air.beat(armed=True, sequence=number)
        air.wait(1)
    for number in range(5):
        air.beat(sequence=103 + number)
        assert air.drives is (TRUE, TRUE, TRUE, UNKNOWN, FALSE)[number]
        air.wait(1)
    assert air.codes == []


def test_after_a_gap_one_sample_of_the_same_clock_is_enough() -> None:
    air = Air()
    for number in range(0, 6, 2):
        air.beat(armed=True, sequence=number)
        air.attitude("radio", 60_000 + 500 * number, sequence=number + 1)
        air.wait(1)
    air.wait(1)
    air.beat(sequence=150)
    assert air.drives is not FALSE
    air.attitude("radio", 64_000, sequence=151)
    air.wait(SETTLES)
    assert air.drives is FALSE


def test_a_disarm_that_follows_a_stream_of_another_count_is_not_believed_at_once() -> None:
    air = Air()
    air.beat(armed=True, sequence=5)
    air.attitude("radio", 1000, sequence=105)
    air.wait(0.1)
    air.beat(sequence=106)
    assert air.drives is TRUE


def test_a_disarm_within_an_instant_of_armed_heartbeats_waits_for_the_next_one() -> None:
    air = Air()
    for number in range(8):
        air.beat(armed=True, sequence=number)
        air.wait(0.1)
    air.beat(sequence=8)
    assert air.drives is UNKNOWN
    air.wait(1.0)
    air.beat(sequence=9)
    assert air.drives is FALSE


def test_a_person_who_arms_disarms_and_arms_again_is_not_a_conflict() -> None:
    air = Air()
    for armed in (False, True, False, True):
        air.beat(armed=armed)
        air.wait(1.2)
    assert (air.codes, air.drives) == ([], TRUE)


def test_an_armed_heartbeat_that_was_held_back_makes_disarmed_unknown_until_the_next_one() -> None:
    air = Air()
    air.beat(armed=True, sequence=10)
    air.wait(1.0)
    air.beat(sequence=12)
    air.wait(0.2)
    air.beat(armed=True, sequence=11)
    air.wait(0.1)
    assert air.drives is UNKNOWN
    air.beat(sequence=13)
    air.wait(0.1)
    assert air.drives is FALSE


def test_a_disarmed_heartbeat_that_was_held_back_changes_nothing() -> None:
    air = Air()
    air.beat(sequence=10)
    air.wait(1.0)
    air.beat(armed=True, sequence=12)
    air.wait(0.2)
    air.beat(sequence=11)
    air.wait(0.1)
    assert air.drives is TRUE


# -- several channels --------------------------------------------------------------------------------------------------


def test_the_status_is_that_of_the_first_speaker_and_another_one_that_agrees_changes_nothing() -> None:
    air = Air()
    for _ in range(10):
        assert air.beat("radio")
        assert not air.beat("wifi")
        assert (air.drives, air.codes) == (FALSE, [])
        air.wait(1)
    assert air.belief.channel == "radio"


def test_another_speaker_goes_on_when_the_first_one_is_lost_with_what_it_said_itself() -> None:
    air = Air()
    air.beat("radio")
    air.text("radio", "Crash: Disarming: AngErr=42")
    assert air.codes == [4001]
    for _ in range(5):
        air.wait(1)
        air.beat("wifi")
    assert (air.belief.channel, air.codes) == ("wifi", [])
    assert air.detail.link is LinkState.CONNECTED


def test_only_a_heartbeat_makes_a_speaker_the_vehicle() -> None:
    air = Air()
    air.beat("radio")
    air.wait(9)
    air.attitude("wifi", 1000)
    assert air.detail.link is LinkState.LOST
    air.beat("wifi")
    assert (air.detail.link, air.belief.channel) == (LinkState.CONNECTED, "wifi")


@pytest.mark.parametrize("first_armed", [True, False])
def test_a_vehicle_is_live_while_one_of_its_speakers_says_so(first_armed: bool) -> None:
    air = Air()
    air.beat("radio", armed=first_armed)
    air.wait(0.2)
    air.beat("wifi", armed=not first_armed)
    assert (air.drives, air.status.error_code) == (TRUE, 0)


def test_a_disarmed_speaker_does_not_take_over_from_an_armed_one_before_that_is_lost() -> None:
    air = Air()
    air.beat("radio", armed=True)
    for _ in range(6):
        air.wait(0.5)
        assert not air.beat("wifi")
        assert air.drives is TRUE
    for _ in range(2):
        air.wait(0.6)
        air.beat("wifi")
    assert (air.belief.channel, air.drives) == ("wifi", FALSE)


AT_REST = [{"state": 8}, {"state": 6}, {"flags": 32}]
"""What an armed heartbeat says of a vehicle that does not move: FLIGHT_TERMINATION, EMERGENCY, HIL."""


@pytest.mark.parametrize("says", AT_REST)
def test_a_sender_that_was_heard_first_is_not_believed_that_an_armed_vehicle_elsewhere_is_stopped(says: Any) -> None:
    air = Air()
    air.beat("forger", armed=True, **says)
    assert FALSE in (air.status.motion_possible, air.drives)
    for _ in range(12):
        air.wait(0.2)
        air.beat("radio", armed=True)
        assert (air.drives, air.status.motion_possible) == (TRUE, TRUE)
        assert air.status.e_stopped is not TRUE
        air.wait(0.5)
        air.beat("forger", armed=True, **says)
        assert FALSE not in (air.drives, air.status.motion_possible)


@pytest.mark.parametrize("says", AT_REST)
def test_a_dropout_of_an_armed_vehicle_does_not_make_a_sender_the_vehicle_that_calls_it_stopped(says: Any) -> None:
    air = Air()
    air.beat("radio", armed=True)
    for _ in range(6):
        air.wait(0.5)
        assert not air.beat("forger", armed=True, **says)
        assert air.status.motion_possible is TRUE


def test_a_vehicle_on_two_channels_that_disarms_is_live_until_both_say_so() -> None:
    air = Air()
    air.beat("radio", armed=True)
    air.beat("wifi", armed=True, sequence=100)
    air.wait(1)
    air.beat("radio")
    assert air.drives is TRUE
    air.wait(0.3)
    air.beat("wifi", sequence=101)
    assert air.drives is FALSE


def test_a_vehicle_on_two_channels_that_is_stopped_is_live_until_both_say_so() -> None:
    air = Air()
    air.beat("radio", armed=True)
    air.beat("wifi", armed=True, sequence=100)
    air.wait(0.5)
    air.beat("radio", armed=True, state=8)
    assert (air.status.e_stopped, air.drives) == (UNKNOWN, TRUE)
    air.wait(0.3)
    air.beat("wifi", armed=True, state=8, sequence=101)
    assert (air.status.e_stopped, air.drives) == (TRUE, FALSE)
    assert 9002 not in air.codes


def test_what_one_speaker_said_of_its_stop_is_not_what_the_other_one_says() -> None:
    """The two may be two vehicles: nothing shows that they are one."""
    air = Air()
    for _ in range(3):
        air.beat("wifi", armed=True)
        air.beat("radio", armed=True)
        air.wait(1.0)
    air.text("wifi", "RC7: MotorEStop HIGH")
    assert (air.status.e_stopped, air.drives) == (UNKNOWN, TRUE)
    for _ in range(60):
        air.wait(1.0)
        air.beat("radio", armed=True)
    assert (air.status.e_stopped, air.drives, air.status.motion_possible) == (UNKNOWN, TRUE, TRUE)


def test_a_vehicle_whose_clock_is_the_same_on_two_channels_is_stopped_by_what_it_says_on_one() -> None:
    air = Air()
    for second in range(8):
        for channel in ("wifi", "radio"):
            air.beat(channel, armed=True)
            air.attitude(channel, 60_000 + 1000 * second)
        air.wait(1.0)
    assert len(air.belief.speakers) == 1
    air.text("wifi", "RC7: MotorEStop HIGH")
    assert air.status.e_stopped is TRUE
    for second in range(3):
        air.wait(1.0)
        air.beat("radio", armed=True)
        air.attitude("radio", 68_000 + 1000 * second)
    assert (air.status.e_stopped, air.drives) == (TRUE, FALSE)


def test_a_copy_of_a_heartbeat_on_another_channel_is_no_claim_however_late() -> None:
    air = Air()
    for number in range(8):
        air.beat("radio", armed=True, sequence=number)
        air.beat("wifi", armed=True, sequence=number)
        air.wait(1)
    air.beat("radio", sequence=8)
    assert air.drives is FALSE
    air.beat("wifi", armed=True, sequence=7)
    air.wait(0.1)
    assert (air.drives, len(air.belief.speakers)) == (FALSE, 1)


def test_the_same_words_with_another_count_are_a_claim() -> None:
    air = Air()
    for number in range(3):
        air.beat("radio", armed=True, sequence=number)
        air.wait(1)
    air.beat("radio", sequence=3)
    air.beat("wifi", armed=True, sequence=77)
    assert air.drives is TRUE


def test_a_channel_of_copies_may_later_bring_news_of_the_same_speaker() -> None:
    air = Air()
    for number in range(4):
        air.beat("radio", armed=True, sequence=number)
        air.beat("cable", armed=True, sequence=number)
        air.wait(1)
    air.beat("cable", sequence=4)
    assert (air.drives, len(air.belief.speakers)) == (FALSE, 1)


# -- conflicts ---------------------------------------------------------------------------------------------------------


def test_a_disagreement_that_lasts_is_a_conflict_until_some_time_after_one_is_silent(
    caplog: pytest.LogCaptureFixture,
) -> None:
    air = Air()
    for second in range(8):
        air.beat("radio")
        air.beat("wifi", armed=True)
        assert (air.drives, air.codes) == (TRUE, [9002] if second > 5 else [])
        air.wait(1)
    assert "two autopilots use the ids 1.1: radio and wifi (armed and disarmed at the same time)" in caplog.text
    for second in range(14):
        air.beat("radio")
        assert air.drives is (TRUE if second < 3 else UNKNOWN if second < STANDS else FALSE), second
        assert air.codes == ([9002] if second < HOLD else []), second
        air.wait(1)


@pytest.mark.parametrize("armed", [False, True])
def test_another_type_that_speaks_on_is_a_conflict_and_what_both_say_counts(armed: bool) -> None:
    air = Air()
    for _ in range(8):
        air.beat("radio", armed=armed)
        air.beat("wifi", armed=armed, vehicle_type=10)
        air.wait(1)
    assert (air.codes, air.drives, air.status.e_stopped) == ([9002], TRUE if armed else FALSE, UNKNOWN)


@pytest.mark.parametrize(("apart", "speakers", "conflict"), [(1_500, 1, False), (9_000, 2, False), (APART_MS, 2, True)])
def test_clocks_on_two_channels_distinguish_a_late_one_from_another_vehicle(
    apart: int, speakers: int, conflict: bool
) -> None:
    air = Air()
    for tenth in range(80):
        air.attitude("radio", 1_000_000 + tenth * 100)
        air.attitude("wifi", 1_000_000 + tenth * 100 - apart)
        if tenth % 10 == 0:
            air.beat("radio")
            air.beat("wifi")
        air.wait(0.1)
    assert len(air.belief.speakers) == speakers
    assert (air.status.error_code == 9002) == conflict


def test_a_reboot_seen_on_two_channels_is_not_a_conflict() -> None:
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


def test_two_counts_on_one_channel_are_two_speakers_and_never_stopped() -> None:
    air = Air()
    for number in range(12):
        air.beat(sequence=number)
        air.wait(0.5)
        air.beat(armed=True, sequence=number + 100)
        assert air.drives is TRUE
        air.wait(0.5)
    assert air.codes == [9002]
    assert len(air.belief.speakers) == 2


def test_two_vehicles_in_one_count_are_unknown_for_a_while() -> None:
    air = Air()
    for number in range(8):
        air.beat(armed=number % 2 == 0, sequence=number)
        air.wait(0.5)
    assert air.is_unknown()
    assert (air.codes, air.inhibits) == ([9002], {"SENDER_UNCERTAIN"})
    for number in range(8, 24):
        air.beat(sequence=number)
        air.wait(1)
    assert (air.drives, air.codes) == (FALSE, [])


def test_clocks_in_turn_in_one_count_are_a_conflict_and_no_reboots() -> None:
    air = Air()
    for number in range(24):
        if number % 8 == 0:
            air.beat(sequence=2 * number)
        air.attitude("radio", (60_000 if number % 2 else APART_MS) + 250 * number, sequence=2 * number + 1)
        air.wait(0.25)
    assert air.vehicle.boots == 0
    assert air.codes == [9002]


# -- another vehicle ---------------------------------------------------------------------------------------------------


def test_another_type_after_a_loss_starts_with_a_new_state() -> None:
    air = Air()
    air.beat("radio")
    air.text("radio", "Crash: Disarming: AngErr=42")
    assert air.codes == [4001]
    air.wait(5)
    air.beat("wifi", vehicle_type=10)
    assert (air.codes, air.detail.vehicle.type) == ([], "GROUND_ROVER")


def test_a_vehicle_that_has_run_for_longer_is_another_one() -> None:
    air = Air()
    air.beat("radio")
    air.attitude("radio", 10_000)
    air.text("radio", "Crash: Disarming: AngErr=42")
    air.wait(5)
    air.beat("radio", sequence=100)
    assert air.codes == []
    for sample in range(3):
        air.attitude("radio", APART_MS + 500 * sample, sequence=101 + sample)
        air.wait(0.5)
    assert (air.codes, air.status.error_code) == ([], 0)


def test_a_boot_that_the_heartbeat_says_is_one_boot_although_the_clock_shows_it_too() -> None:
    air = Air()
    for second in range(4):
        air.beat("radio", armed=True, sequence=40 + 2 * second)
        air.attitude("radio", 60_000 + 1000 * second, sequence=41 + 2 * second)
        air.wait(1)
    air.send(mav.Heartbeat(3, 2, 3, 89, 1, 3), "radio", sequence=0)
    for second in range(4):
        air.attitude("radio", 500 + 1000 * second, sequence=1 + 2 * second)
        air.beat("radio", sequence=2 + 2 * second)
        air.wait(1)
    assert (air.vehicle.boots, len(air.belief.speakers)) == (1, 1)
    assert air.codes == [5004]


# -- places and links --------------------------------------------------------------------------------------------------


def test_component_one_takes_the_handle_of_its_system_from_another_component() -> None:
    air = Air((ExpectedVehicle(1),))
    assert air.beat("forger", ids=(1, 77))
    assert air.beat("radio", armed=True)
    assert [tracked.ids for tracked in air.hw.vehicles] == [(1, 1)]
    assert air.drives is TRUE
    assert not air.beat("forger", ids=(1, 77))


def test_a_forged_component_one_cannot_say_disarmed_of_a_live_armed_component() -> None:
    air = Air((ExpectedVehicle(1),))
    air.beat("radio", armed=True, ids=(1, 77))
    for _ in range(12):
        air.beat("forger", ids=(1, 1))
        assert (air.vehicle.ids, air.drives) == ((1, 77), TRUE)
        air.wait(0.5)
        air.beat("radio", armed=True, ids=(1, 77))


def test_another_component_never_gets_the_handle_of_an_autopilot_that_was_there() -> None:
    air = Air((ExpectedVehicle(1),))
    for _ in range(8):
        air.beat("radio")
        air.wait(1)
    for _ in range(60):
        air.wait(1)
        assert not air.beat("forger", ids=(1, 77))


def test_a_link_that_is_closed_does_not_take_back_that_its_vehicle_is_armed() -> None:
    air = Air()
    for _ in range(3):
        air.beat("radio", armed=True)
        air.beat("wifi")
        air.wait(1.0)
    air.beat("radio", armed=True)
    air.belief.keep(lambda channel: channel == "wifi")
    air.wait(0.1)
    air.beat("wifi")
    assert air.drives is not FALSE


def test_a_vehicle_without_a_remaining_channel_is_forgotten() -> None:
    air = Air()
    air.beat("radio")
    air.belief.keep(lambda channel: channel == "cable")
    assert (air.belief.channel, air.belief.speakers) == (None, [])


def test_a_speaker_that_is_not_heard_again_on_a_new_connection_is_forgotten() -> None:
    air = Air()
    air.beat("radio")
    air.beat("cable", armed=True)
    air.belief.reconnected(lambda channel: channel == "cable")
    for _ in range(30):
        air.wait(1)
        air.beat("radio")
    assert (air.drives, len(air.belief.speakers)) == (FALSE, 1)


def test_what_was_said_once_on_a_connection_is_in_doubt_some_time_after_a_new_one() -> None:
    air = Air()
    air.beat(armed=True)
    air.text("radio", "RC7: MotorEStop HIGH")
    air.belief.reconnected(lambda channel: channel == "radio")
    for _ in range(8):
        air.wait(1)
        air.beat(armed=True)
    assert air.status.e_stopped is UNKNOWN
    assert air.drives is not FALSE


BEATS = st.tuples(st.integers(0, 20), st.booleans(), st.integers(0, 255), st.sampled_from([0.0, 0.3, 1.6, 4.0]))


@given(st.lists(BEATS, max_size=60))
def test_any_number_of_senders_uses_bounded_memory(beats: list[tuple[int, bool, int, float]]) -> None:
    air = Air()
    for channel, armed, sequence, pause in beats:
        air.beat(channel, armed=armed, sequence=sequence)
        air.attitude(channel, sequence * 1000)
        air.wait(pause)
        assert len(air.belief.speakers) <= MOST_SPEAKERS


def test_an_armed_claim_is_not_pushed_out_by_many_disarmed_ones() -> None:
    air = Air()
    air.beat("radio")
    air.beat("wifi", armed=True, sequence=100)
    for number in range(3 * MOST_SPEAKERS):
        air.beat(number, sequence=number)
    assert air.drives is TRUE
