"""The readers of onboard logs: any cut, any damage, no exception, no unbounded memory."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.hardware.onboard_log.dataflash import DataFlashReader
from mav_robot_status.hardware.onboard_log.dataflash_text import TextReader
from mav_robot_status.hardware.onboard_log.record import Reader, Record
from mav_robot_status.hardware.onboard_log.ulog import ULogReader
from tests.onboard_logs import dataflash, formats, message, record, ulog

from .logs import at

EVERY = dict.fromkeys(("ARM", "EV", "MSG", "GPS", "actuator_armed", "message"), 0.0)
STORY = [(1 + n / 10, "EV", n % 200) for n in range(100)]
BINARY = dataflash(*STORY)
ULOG = ulog(*((1 + n / 10, "actuator_armed", True, False, False, bool(n % 2)) for n in range(100)), start=1)
READERS: dict[str, tuple[type[DataFlashReader] | type[ULogReader], bytes]] = {
    "dataflash": (DataFlashReader, BINARY),
    "ulog": (ULogReader, ULOG),
}


def read(reader: Reader, data: bytes, piece: int = 1 << 18) -> list[Record]:
    found = [one for start in range(0, len(data), piece) for one in reader.feed(data[start : start + piece])]
    return [one for one in (*found, *reader.finish()) if one.name not in ("", "information")]


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("piece", [1, 7, 4096])
def test_records_are_the_same_however_the_log_is_cut_into_pieces(name: str, piece: int) -> None:
    make, data = READERS[name]
    assert read(make(EVERY), data, piece) == read(make(EVERY), data)
    assert len(read(make(EVERY), data)) == 100


@pytest.mark.parametrize("name", READERS)
def test_what_follows_damage_is_read(name: str) -> None:
    make, data = READERS[name]
    noise = random.Random(3).randbytes(3000)
    middle = len(data) - (len(data) // 3)
    reader = make(EVERY)
    found = read(reader, data[:middle] + noise + data[middle:])
    assert 90 <= len(found) <= 100
    assert reader.counts.bad_bytes >= 2900


@pytest.mark.parametrize("name", READERS)
@settings(max_examples=60)
@given(st.data())
def test_any_bytes_are_read_in_bounded_memory(name: str, data: st.DataObject) -> None:
    make, log = READERS[name]
    cut = data.draw(st.integers(0, len(log)))
    reader = make(EVERY)
    assert read(reader, log[:cut] + data.draw(st.binary(max_size=300)) + log[cut:], 97) is not None
    assert reader.pending == 0


def test_a_time_that_leaps_counts_only_if_it_is_continued() -> None:
    wild = record("EV", 10**15, 54)
    assert [one.us for one in read(DataFlashReader(EVERY), formats() + wild.join(_events(1, 2, 3)))] == [1, 2, 3]
    later = [one.us for one in read(DataFlashReader(EVERY), formats() + b"".join(_events(1, 10**9, 10**9 + 1)))]
    assert later == [1, 10**9, 10**9 + 1]


def _events(*times: int) -> list[bytes]:
    return [record("EV", us, 10) for us in times]


def test_an_unknown_type_of_value_is_skipped_by_its_length() -> None:
    strange = record("FMT", 99, 8, "ODD", "w", "X") + b"\xa3\x95" + bytes([99]) + b"12345"
    assert len(read(DataFlashReader(EVERY), formats() + strange + record("EV", 5, 10))) == 1


def test_a_definition_with_fewer_types_than_columns_is_skipped() -> None:
    strange = record("FMT", 99, 11, "ODD", "Q", "TimeUS,I") + b"\xa3\x95" + bytes([99]) + bytes(8)
    assert len(read(DataFlashReader(EVERY), formats() + strange + record("EV", 5, 10))) == 1


def test_only_the_first_sensor_is_read() -> None:
    data = dataflash(*((1 + n / 5, "GPS", n % 2, 6, 0, 2446, 1.0, 0.0) for n in range(10)))
    assert {one.values["I"] for one in read(DataFlashReader(EVERY), data)} == {0}


def test_text_with_commas_and_broken_lines() -> None:
    data = b"FMT, 5, 75, MSG, QZ, TimeUS,Message\nMSG, 1000, Hello, you\nMSG, nothing\nNONE, 1\nMSG, 2000, End"
    reader = TextReader({"MSG": 0.0})
    assert [one.values["Message"] for one in read(reader, data, 5)] == ["Hello, you", "End"]
    assert reader.counts.bad_bytes > 0


def test_a_format_that_contains_itself_is_not_followed_for_ever() -> None:
    data = b"ULog\x01\x12\x35\x01" + bytes(8) + message(b"F", b"a:uint64_t timestamp;a[9] b;")
    data += message(b"A", b"\0\0\0a") + message(b"D", b"\0\0" + bytes(100))
    assert read(ULogReader({"a": 0.0}), data) == []


def test_a_part_of_the_format_that_is_not_known_is_named() -> None:
    reader = ULogReader(EVERY)
    read(reader, b"ULog\x01\x12\x35\x01" + bytes(8) + message(b"B", bytes(8) + b"\x02" + bytes(31)))
    assert reader.refused is not None


def test_dropouts_are_counted() -> None:
    reader = ULogReader(EVERY)
    read(reader, ulog((1, "O", 30), (2, "O", 5)))
    assert reader.counts.dropouts == 2


def test_an_old_text_log_has_the_time_in_its_gps_records() -> None:
    data = b"""FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format
FMT, 130, 45, GPS, BIHf, Status,TimeMS,Week,Spd
FMT, 130, 45, GPS, BIHfI, Status,TimeMS,Week,Spd,T
FMT, 132, 67, MSG, Z, Message
FMT, 3, 6, MODE, Mh, Mode,ThrCrs
FMT, 13, 4, EV, B, Id
GPS, 3, 1000, 1774, 0.1, 66000
MSG, ArduCopter V3.1 (5c6503e2)
MODE, STABILIZE, 352
EV, 10
GPS, 3, 1200, 1774, 0.1, 66200
"""
    found = read(TextReader({"GPS": 0.0, "MODE": 0.0, "EV": 0.0}), data)
    assert [(one.name, one.us) for one in found] == [
        ("GPS", 66_000_000), ("MODE", 66_000_000), ("EV", 66_000_000), ("GPS", 66_200_000),
    ]  # fmt: skip
    (said,) = at(data, 66.1)
    assert (said.detail.vehicle.flight_mode, said.status.drives_powered) == ("STABILIZE", 1)
