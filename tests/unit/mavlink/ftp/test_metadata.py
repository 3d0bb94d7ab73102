from __future__ import annotations

import json
import lzma
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.mavlink.ftp.download import Failure
from mav_robot_status.mavlink.ftp.metadata import Place, crc32, has_crc, place, table_place, unpacked
from mav_robot_status.testing.event_table import GENERAL, PATH, event_files, event_id


def general(*entries: Any) -> bytes:
    return json.dumps({"version": 1, "metadataTypes": entries}).encode()


def test_the_checksum_is_that_of_mavlink() -> None:
    """The check value of CRC-32/JAMCRC is that of a start with ones; MAVLink starts with zero."""
    table = []
    for number in range(256):
        value = number
        for _ in range(8):
            value = value >> 1 ^ (0xEDB88320 if value & 1 else 0)
        table.append(value)
    crc = 0
    for byte in b"123456789":
        crc = crc >> 8 ^ table[(crc ^ byte) & 0xFF]
    assert crc32(b"123456789") == crc == 0x2DFD2D88


@pytest.mark.parametrize(
    ("uri", "found"),
    [
        ("mftp://etc/extras/a.json.xz", Place("etc/extras/a.json.xz", None, 5)),
        ("mftp://[;comp=1]etc/a.json", Place("etc/a.json", 1, 5)),
        ("mftp:///fs/microsd/a", Place("/fs/microsd/a", None, 5)),
    ],
)
def test_an_address_of_mavlink_ftp_is_a_place(uri: str, found: Place) -> None:
    assert place(uri, 5) == found


@pytest.mark.parametrize(
    "uri", ["", "mftp://", "mftp://a b", "mftp://\u202e", "ftp://a", "mftp://" + "a" * 300, "etc/a"]
)
def test_any_other_address_is_refused(uri: str) -> None:
    assert isinstance(place(uri), Failure)


def test_an_address_of_the_internet_is_named() -> None:
    found = place("https://artifacts.px4.io/all_events.json.xz")
    assert isinstance(found, Failure)
    assert "https://artifacts.px4.io/all_events.json.xz" in found.reason


def test_the_general_file_names_the_table() -> None:
    files = event_files().files
    assert table_place(files[GENERAL]) == Place(PATH, None, crc32(files[PATH]))
    assert table_place(general({"type": 1, "uri": "mftp://a"}, {"type": 4, "uri": "mftp://b"})) == Place("b")


def test_the_fallback_on_the_vehicle_is_used_before_an_address_of_the_internet() -> None:
    entry = {"type": 4, "uri": "https://a.b/c", "uriFallback": "mftp://d", "fileCrc": 7}
    assert table_place(general(entry)) == Place("d", None, 7)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"[]",
        b"null",
        b"\xff",
        b"[" * 20_000,
        b'{"metadataTypes": 3}',
        general(3),
        general({"type": 1}),
        general({"type": 4}),
        general({"type": 4, "uri": ["x"]}),
        general({"uri": "mftp://a"}),
        b"\xfd7zXZ\0 and so on",
        lzma.compress(b" " * 100_000),
        lzma.compress(b"{}")[:-4],
    ],
)
def test_any_other_general_file_is_refused(data: bytes) -> None:
    assert isinstance(table_place(data), Failure)


@given(
    st.binary(max_size=200) | st.recursive(st.none() | st.integers() | st.text(), st.lists).map(repr).map(str.encode)
)
def test_no_general_file_raises(data: bytes) -> None:
    assert isinstance(table_place(data), Place | Failure)
    assert isinstance(table_place(lzma.compress(data, preset=0)), Place | Failure)


def test_unpacking_is_bounded() -> None:
    bomb = lzma.compress(bytes(5_000_000))
    assert len(bomb) < 2000
    with pytest.raises(ValueError, match="longer than 1000 bytes"):
        unpacked(bomb, 1000)
    assert unpacked(lzma.compress(b"x" * 1000), 1000) == b"x" * 1000
    assert unpacked(lzma.compress(b"x", preset=9), 10) == b"x"  # as PX4 packs
    assert unpacked(b"plain", 10) == b"plain"


def test_the_checksum_may_be_that_of_the_packed_or_of_the_unpacked_file() -> None:
    data = lzma.compress(b"table")
    assert has_crc(data, crc32(data), 100)
    assert has_crc(data, crc32(b"table"), 100)
    assert has_crc(data, None, 100)
    assert not has_crc(data, 1, 100)
    assert not has_crc(data[:-1], crc32(b"table"), 100)


def test_the_ids_of_the_fake_table_are_those_of_px4() -> None:
    assert event_id("commander_arming_check_summary") == 0xA893E0
    assert event_id("commander_health_summary") == 0x1D3727
    assert event_id("commander_failsafe_enter") == 0x94CA8A
