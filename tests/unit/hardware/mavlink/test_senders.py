from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.senders import Sender, Strangers, senders, strangers
from mav_robot_status.mavlink.definitions import Heartbeat, SystemTime
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Parser

START = Instant(100.0, 1_800_000_000_000_000)
ROVER, ARMED, COPTER = Heartbeat(0, 10, 3, 65, 4, 3), Heartbeat(0, 10, 3, 193, 4, 3), Heartbeat(0, 2, 3, 81, 3, 3)


class Port:
    """A channel, as the gateway has one for each address."""

    def __init__(self, address: str | None) -> None:
        self.address = address
        self.trusted = address is None
        self.named = None if address is None else f"udp:0.0.0.0:14550?from={address.split(':')[0]}"

    def __str__(self) -> str:
        return "/dev/ttyAMA0" if self.address is None else f"{self.address}, listening on 0.0.0.0:14550/udp"


HOME, AWAY, CABLE = Port("10.0.0.5:14550"), Port("10.0.0.9:4555"), Port(None)


class Ears:
    """A hardware interface that hears vehicle 1.1 on several channels."""

    def __init__(self) -> None:
        self.hw = MavlinkRobotHW()
        self.now = START
        self._next = {"": 0}

    def hear(self, at: float, *messages: Any, channel: Port = HOME, count: str = "", first: int = 0) -> None:
        """Messages with the next numbers of a count, seconds after the start."""
        self.now = later(START, at)
        for message in messages:
            number = self._next.setdefault(count, first)
            self._next[count] = number + 1
            (frame,) = Parser(None).feed(encode(message, system=1, component=1, sequence=number % 256))
            self.hw.on_frame(frame, self.now, channel)
        self.hw.read(self.now)

    @property
    def senders(self) -> tuple[Sender, ...]:
        (tracked,) = self.hw.vehicles
        return senders(tracked.belief, self.now.mono)

    @property
    def strangers(self) -> Strangers | None:
        (tracked,) = self.hw.vehicles
        return strangers(tracked.belief, self.now.mono, 3.5)


@pytest.fixture
def ears() -> Ears:
    return Ears()


def clock(seconds: float) -> SystemTime:
    return SystemTime(0, round(seconds * 1000))


def test_one_sender_that_is_not_late_is_not_listed(ears: Ears) -> None:
    for at in range(5):
        ears.hear(at, ROVER, clock(at + 60))
    assert (ears.senders, ears.strangers) == ((), None)


def test_each_of_two_senders_is_listed_with_what_is_known_of_it(ears: Ears) -> None:
    for at in range(5):
        ears.hear(at, ROVER)
        ears.hear(at, ARMED, channel=AWAY, count="other", first=100)
    main, other = ears.senders
    assert main == Sender(str(HOME), 1, 0.0, "first heard", "GROUND_ROVER", False, 4.0)
    assert other == Sender(str(AWAY), 1, 0.0, "not proven", "GROUND_ROVER", True, 4.0)
    assert other.words == (
        "10.0.0.9:4555, listening on 0.0.0.0:14550/udp: GROUND_ROVER, armed, 1 count of sequence numbers, "
        "not proven, claims the ids for 4.0 s"
    )
    assert ears.strangers == Strangers(
        "10.0.0.5:14550 and 10.0.0.9:4555 (armed and disarmed at the same time)", "udp:0.0.0.0:14550?from=10.0.0.5"
    )


def test_another_type_is_a_stranger_at_once_and_one_of_the_same_kind_after_some_time(ears: Ears) -> None:
    ears.hear(0, ROVER)
    ears.hear(0.1, ROVER, channel=AWAY, count="same", first=100)
    assert ears.strangers is None
    ears.hear(0.2, COPTER, channel=AWAY, count="other", first=200)
    ears.hear(0.3, ROVER)
    assert ears.strangers is not None
    assert "HEARTBEAT.type and autopilot differ" in ears.strangers.who


def test_two_senders_on_one_computer_cannot_be_named(ears: Ears) -> None:
    for at in range(5):
        ears.hear(at, ROVER)
        ears.hear(at, ROVER, channel=Port("10.0.0.5:4555"), count="other", first=100)
    assert ears.strangers == Strangers("10.0.0.5:14550 and 10.0.0.5:4555", None)


@pytest.mark.parametrize(("channel", "who"), [(HOME, "two on 10.0.0.5:14550"), (CABLE, "two on /dev/ttyAMA0")])
def test_two_senders_behind_one_router_cannot_be_named(ears: Ears, channel: Port, who: str) -> None:
    for at in range(5):
        ears.hear(at, ROVER, channel=channel)
        ears.hear(at + 0.1, ROVER, channel=channel, count="other", first=120)
    assert ears.strangers == Strangers(who, None)


def test_a_second_way_of_one_vehicle_is_proven_by_its_frames_or_by_its_clock(ears: Ears) -> None:
    for at in range(6):
        ears.hear(at, ROVER, clock(at + 60))
        ears.hear(at, ROVER, clock(at + 60), channel=AWAY, count="other", first=100)
    (tracked,) = ears.hw.vehicles
    assert [(one.proof, len(one.counts)) for one in tracked.belief.speakers] == [("the same boot time", 2)]
    assert (ears.senders, ears.strangers) == ((), None)


def test_a_late_sender_is_listed_with_its_lag(ears: Ears) -> None:
    for at in range(4):
        ears.hear(at, ROVER, clock(at + 60))
    for at in range(11, 15):
        ears.hear(at, ROVER, clock(at + 53))
    (late,) = ears.senders
    assert late.lag == 7.0
    assert "7.0 s late" in late.words
    assert ears.strangers is None


def test_a_stranger_claims_nothing_beside_a_trusted_link(ears: Ears) -> None:
    for at in range(8):
        ears.hear(at, ARMED, channel=CABLE)
        ears.hear(at, COPTER, channel=AWAY, count="other", first=100)
    (tracked,) = ears.hw.vehicles
    assert ears.strangers is None
    assert tracked.handle.status.drives_powered.value == 1
    assert tracked.handle.status.error_code == 0
    assert [sender.address for sender in ears.senders] == [str(CABLE), str(AWAY)]


def test_another_speaker_that_goes_on_has_the_age_of_its_own_heartbeat(ears: Ears) -> None:
    for at in range(4):
        ears.hear(at, ROVER)
    for at in range(2, 9):
        ears.hear(at, ARMED, channel=AWAY, count="other", first=100)
    (tracked,) = ears.hw.vehicles
    assert tracked.handle.heard_at == ears.now.mono
    assert [sender.proof for sender in ears.senders] == ["heard when the one before was lost", "first heard"]


def test_two_vehicles_in_one_count_are_told_until_the_end_of_a_log(ears: Ears) -> None:
    for at in range(4):
        ears.hear(at, ROVER)
        ears.hear(at + 0.5, COPTER)
    assert ears.strangers == Strangers("two types in turn", None)
    ears.hear(20, ROVER)
    assert ears.strangers is not None
    assert ears.strangers.who.startswith("two types in turn, until ")
