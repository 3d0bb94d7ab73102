"""The table of events from a file that may come from anybody."""

from __future__ import annotations

import json
import lzma
from struct import pack
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.px4_events.parsing import (
    MOST_BYTES,
    MOST_EVENTS,
    MOST_MESSAGE,
    MOST_UNPACKED,
    TableError,
    parse,
)

from ..px4_reports import LOITER, NO_FIX, RC_LOSS, document, event, table


def test_json_and_xz_give_the_same_table() -> None:
    plain = json.dumps(document()).encode()
    for data in (plain, lzma.compress(plain)):
        read = parse(data)
        assert read.message(event(NO_FIX, 1, 1, pack("<IBB", 8, 3, 2))) == "GPS 2 has no fix"
        assert read.mode_groups[LOITER] == 4


def test_an_event_has_its_message_and_its_description() -> None:
    found = event(NO_FIX, 1, 1, pack("<IBB", 8, 3, 1))
    assert table().message(found) == "GPS 1 has no fix"
    assert table().description(found) == "Wait. See EKF2_GPS_CHECK"
    assert table().message(event(0x1234567, 1, 1)) is None


def test_an_enumeration_is_shown_by_its_words() -> None:
    assert table().message(event(RC_LOSS, 1, 1, pack("<IBB", 0, 6, 1))) == "Sticks lost: action 6"
    assert table().message(event(RC_LOSS, 1, 1, pack("<IBB", 0, 6, 9))) == "9: action 6"


def test_a_bit_field_is_shown_by_the_words_of_its_bits() -> None:
    given = document()
    arguments = [{"type": "navigation_mode_group_t"}]
    events = given["components"]["1"]["event_groups"]["default"]["events"]
    events["5"] = {"name": "bits", "message": "{1}", "arguments": arguments}
    read = parse(json.dumps(given).encode())
    assert read.message(event(1 << 24 | 5, 1, 1, pack("<I", 0b10010001))) == "Manual|loiter|128"
    assert read.message(event(1 << 24 | 5, 1, 1)) == "none"


def test_arguments_beyond_the_payload_are_not_known() -> None:
    given = document()
    events = given["components"]["1"]["event_groups"]["default"]["events"]
    events["5"] = {"name": "wide", "message": "{5} {6}", "arguments": [{"type": "uint64_t"}] * 6}
    assert parse(json.dumps(given).encode()).message(event(1 << 24 | 5, 1, 1)) == "0 ?"


def test_a_file_of_another_kind_is_refused_in_one_line() -> None:
    for data in (b"", b"{}", b"[]", b"null", b"nonsense", b"\xff\xfe", b"\xfd7zXZ\x00 torn", b'{"components": []}'):
        with pytest.raises(TableError) as error:
            parse(data)
        assert "\n" not in str(error.value)


def _changed(*path: str, to: Any) -> bytes:
    given = document()
    at: Any = given
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = to
    return json.dumps(given).encode()


_ENUM = ("components", "1", "enums", "cause_t")
_EVENTS = ("components", "1", "event_groups", "default", "events")


@pytest.mark.parametrize(
    "data",
    [
        _changed("components", to=[]),
        _changed("components", "1", to=None),
        _changed("components", "one", to={}),
        _changed("components", "1", "namespace", to=7),
        _changed("components", "1", "enums", to=[1]),
        _changed(*_ENUM, "type", to="float"),
        _changed(*_ENUM, "entries", to=[1]),
        _changed(*_ENUM, "entries", "1", to=None),
        _changed(*_ENUM, "entries", "-1", to={}),
        _changed(*_ENUM, "entries", to={str(number): {} for number in range(1001)}),
        _changed(*_EVENTS, to=7),
        _changed(*_EVENTS, "x", to={}),
        _changed(*_EVENTS, "9", to=[]),
        _changed(*_EVENTS, "9", to={"message": 7}),
        _changed(*_EVENTS, "9", to={"message": "x" * (MOST_MESSAGE + 1)}),
        _changed(*_EVENTS, "9", to={"arguments": {}}),
        _changed(*_EVENTS, "9", to={"arguments": [7]}),
        _changed(*_EVENTS, "9", to={"arguments": [{"type": "unknown_t"}]}),
        _changed(*_EVENTS, "9", to={"arguments": [{"type": "uint8_t"}] * 41}),
        _changed(*_EVENTS, to={str(number): {} for number in range(MOST_EVENTS + 1)}),
        _changed("components", "1", "navigation_mode_groups", to=[]),
        _changed("components", "1", "navigation_mode_groups", "groups", to={"64": [1]}),
        _changed("components", "1", "navigation_mode_groups", "groups", to={"1": 1}),
        _changed("components", "1", "navigation_mode_groups", "groups", to={"1": [True]}),
        _changed("components", "1", "navigation_mode_groups", "groups", to={"1": [2**32]}),
        _changed("components", "1", "navigation_mode_groups", "groups", to={"1": list(range(2000))}),
    ],
    ids=range(26),
)
def test_a_part_of_the_wrong_type_or_size_is_refused(data: bytes) -> None:
    with pytest.raises(TableError):
        parse(data)


@pytest.mark.parametrize(
    "data",
    [
        b"[" * 200_000,
        b'{"a":' * 200_000,
        b"[" + b"1," * 400_000,
        b"9" * 900_000,
        b'{"version": NaN}',
        b'{"version": 1e999999}',
        lzma.compress(b" " * (MOST_UNPACKED + 2)),
        lzma.compress(json.dumps(document()).encode())[:-20],
        b" " * (MOST_BYTES + 1),
    ],
    ids=["brackets", "braces", "values", "digits", "NaN", "exponent", "xz bomb", "torn xz", "large file"],
)
def test_a_hostile_file_is_refused(data: bytes) -> None:
    with pytest.raises(TableError):
        parse(data)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4),
    max_leaves=20,
)


def _paths(value: Any, at: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    items = value.items() if isinstance(value, dict) else ()
    inner = [path for key, item in items for path in _paths(item, (*at, key))]
    return [at, *inner] if at else inner


@settings(max_examples=80)
@given(st.sampled_from(_paths(document())), JSON)
def test_any_value_at_any_place_gives_a_table_or_a_table_error(path: tuple[str, ...], value: Any) -> None:
    data = _changed(*path, to=value)
    try:
        read = parse(data)
    except TableError:
        return
    for number in read.events:
        read.message(event(number, 1, 1, bytes(range(40))))
        read.description(event(number, 1, 1, bytes([255] * 40)))


@given(st.binary(max_size=200))
def test_any_bytes_give_a_table_error(data: bytes) -> None:
    for file in (data, b"\xfd7zXZ\x00" + data):
        with pytest.raises(TableError):
            parse(file)
