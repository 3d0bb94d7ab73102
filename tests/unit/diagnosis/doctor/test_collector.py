from __future__ import annotations

import math
from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.diagnosis.doctor.collector import HEAD, MOST_SOURCES, MOST_SPEAKERS, Collector
from mav_robot_status.diagnosis.doctor.findings import AppletReport, Findings
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.definitions import Attitude, Heartbeat, NamedValueFloat, SystemTime
from mav_robot_status.mavlink.encode import encode

START = Instant(100.0, 1_800_000_000_000_000)
ROVER, COPTER, GIMBAL = Heartbeat(0, 10, 3, 65, 4, 3), Heartbeat(0, 2, 3, 81, 3, 3), Heartbeat(0, 26, 8, 0, 4, 3)
A, B = ("10.0.0.1", 14550), ("10.0.0.2", 14550)


class Ear:
    """A collector that receives messages."""

    def __init__(self) -> None:
        self.collector = Collector()
        self._sequence = 0

    def hear(self, message: Any, at: float = 0.0, source: Any = A, **options: Any) -> None:
        frame = encode(message, **{"system": 1, "component": 1, "sequence": self._sequence % 256, **options})
        self._sequence += 1
        self.collector.on_data(frame, source, later(START, at))

    @property
    def found(self) -> Findings:
        return self.collector.findings(Findings(parse("udp:127.0.0.1:1"), ""), {})


@pytest.fixture
def ear() -> Ear:
    return Ear()


def attitude(boot_ms: float) -> Attitude:
    return Attitude(round(boot_ms), 0.0, 0.0, 0.0)


def test_senders_messages_and_rates_are_counted(ear: Ear) -> None:
    for beat in range(5):
        ear.hear(ROVER, beat)
        ear.hear(GIMBAL, beat, component=154, version=1)
    ear.hear(attitude(0), 4)
    rover, gimbal = ear.found.speakers
    assert (rover.pilot, rover.autopilot, rover.type, rover.frames, rover.frames_v1) == (True, 3, 10, 6, 0)
    assert (rover.counts, rover.rates) == ({0: 5, 30: 1}, {0: 1.0})
    assert (gimbal.pilot, gimbal.type, gimbal.frames_v1) == (False, 26, 5)
    assert ear.found.sources == ("10.0.0.1:14550",)
    assert ear.found.counters.frames == 11


def test_a_split_frame_is_reassembled_for_each_sender(ear: Ear) -> None:
    frame = encode(ROVER, system=1, component=1, sequence=0)
    for part in (frame[:9], frame[9:]):
        for source in (A, B):
            ear.collector.on_data(part, source, START)
    assert ear.found.counters.frames == 2
    assert ear.collector.has_heartbeat()


def test_an_unverifiable_frame_is_counted_without_a_sender(ear: Ear) -> None:
    frame = bytearray(encode(ROVER, system=9, component=9, sequence=0))
    frame[7:10] = (40_000).to_bytes(3, "little")
    ear.collector.on_data(bytes(frame) * 2, A, START)
    assert ear.found.counters.unknown == {40_000: 2}
    assert ear.found.speakers == ()


def test_a_flood_uses_bounded_memory(ear: Ear) -> None:
    for number in range(MOST_SPEAKERS * 2):
        ear.hear(ROVER, source=("10.0.0.1", number), system=number % 256, component=1 + number // 256)
    ear.hear(ROVER, source="late", system=1, component=1)
    assert len(ear.found.speakers) == MOST_SPEAKERS
    assert len(ear.collector._parsers) <= MOST_SOURCES + 1
    assert len(ear.found.head) == HEAD
    assert ear.found.counters.frames == MOST_SPEAKERS * 2 + 1


def test_a_component_that_is_an_autopilot_in_one_heartbeat_is_one(ear: Ear) -> None:
    for message in (GIMBAL, ROVER, GIMBAL):
        ear.hear(message)
    ear.hear(GIMBAL, system=2)
    assert [speaker.pilot for speaker in ear.found.speakers] == [True, False]


def test_a_clock_counts_only_if_its_time_is_set(ear: Ear) -> None:
    ear.hear(SystemTime(0, 5))
    assert ear.found.speakers[0].clock_off is None
    ear.hear(SystemTime(START.unix_us + 90_000_000, 5))
    assert ear.found.speakers[0].clock_off == 90.0


def report(value: float, name: bytes = b"RS_STOP") -> NamedValueFloat:
    return NamedValueFloat(0, value, name)


def test_the_last_report_of_the_applet_is_kept_with_its_age(ear: Ear) -> None:
    for at, message in enumerate((ROVER, report(0), report(3), ROVER, ROVER)):
        ear.hear(message, at)
    assert ear.found.speakers[0].applet == AppletReport(3, 2.0)
    assert ear.found.speakers[0].applet.fresh
    ear.hear(ROVER, 5.5)
    assert not ear.found.speakers[0].applet.fresh


@pytest.mark.parametrize("other", [report(4), report(-1), report(0.5), report(math.nan), report(math.inf)])
def test_a_value_that_the_applet_never_sends_is_no_report(ear: Ear, other: NamedValueFloat) -> None:
    ear.hear(ROVER)
    ear.hear(other)
    assert ear.found.speakers[0].applet is None


def test_a_value_of_another_name_is_no_report_and_a_report_is_of_its_sender(ear: Ear) -> None:
    ear.hear(ROVER)
    ear.hear(report(1, b"RS_STOP_2"))
    ear.hear(report(1), component=191)
    assert [s.applet is None for s in ear.found.speakers] == [True, False]
