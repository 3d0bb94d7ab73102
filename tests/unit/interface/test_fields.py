"""The table of fields: each output format has the fields that the table defines."""

from __future__ import annotations

import json
import pathlib
import re
import xml.etree.ElementTree as ET
from importlib.resources import files

import pytest

from mav_robot_status.interface import FIELDS, STATES, TRI_STATES, Kind, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink.definitions import RobotStatus as RobotStatusMessage
from mav_robot_status.publishers import named_value
from mav_robot_status.publishers.json_lines import native_body
from mav_robot_status.publishers.mavlink import INHIBITS, message_of
from mav_robot_status.publishers.mqtt.lines import UNKNOWN
from mav_robot_status.views.terminal.columns import COLUMNS, TITLES, column_of
from mav_robot_status.views.timeline import TRACKS

from ..publishers.port import SEEN, msg

ROOT = pathlib.Path(__file__).parents[3]
NAMES = [field.name for field in FIELDS]
DIALECT = ET.parse(ROOT / "dialects" / "mav_robot_status.xml").getroot()
ADDRESS = {"time_usec", "inhibit_flags", "subject_system", "subject_component"}
"""The members of ROBOT_STATUS that are not in the table."""


def asset(package: str, name: str) -> str:
    return (files(package) / "assets" / name).read_text("utf-8")


def test_every_row_has_a_one_line_meaning() -> None:
    assert all(re.fullmatch(r"[A-Z].{10,78}\.", field.row.meaning) for field in FIELDS)


def test_the_kind_of_a_field_follows_from_its_default() -> None:
    kinds = {RobotMode: Kind.MODE, TriState: Kind.TRI_STATE, int: Kind.CODE}
    assert [field.kind for field in FIELDS] == [kinds[type(value)] for value in RobotStatus()]


def test_every_field_is_a_state_or_a_code() -> None:
    assert [*STATES, *(field for field in FIELDS if field.kind is Kind.CODE)] == list(FIELDS)
    assert set(TRI_STATES) < set(STATES)


@pytest.mark.parametrize(
    ("name", "value", "plain", "word"),
    [
        ("mode", RobotMode.AUTO, "AUTO", "AUTO"),
        ("mode", RobotMode.UNKNOWN, "UNKNOWN", "UNKNOWN"),
        ("in_motion", TriState.TRUE, True, "TRUE"),
        ("in_motion", TriState.FALSE, False, "FALSE"),
        ("in_motion", TriState.UNKNOWN, None, "UNKNOWN"),
        ("error_code", 4001, 4001, "4001"),
    ],
)
def test_every_value_has_a_json_form_and_a_display_text(name: str, value: int, plain: object, word: str) -> None:
    field = FIELDS[NAMES.index(name)]
    assert (field.plain(value), field.word(value)) == (plain, word)


def test_a_json_line_has_every_field_in_the_order_of_the_table() -> None:
    line = json.loads("{" + native_body("robot", RobotStatus(), SEEN) + "}}")
    assert [name for name in line if name in NAMES] == NAMES
    assert {name: line[name] for name in NAMES} == {
        f.name: f.plain(v) for f, v in zip(FIELDS, RobotStatus(), strict=True)
    }


def test_the_schema_requires_every_field_with_its_kind() -> None:
    schema = json.loads(files("mav_robot_status").joinpath("data/robot_status.schema.json").read_text("utf-8"))
    forms = {
        Kind.MODE: ("enum", ["MANUAL", "AUTO", "UNKNOWN"]),
        Kind.TRI_STATE: ("$ref", "#/$defs/tristate"),
        Kind.CODE: ("type", "integer"),
    }
    for field in FIELDS:
        assert field.name in schema["required"]
        assert forms[field.kind] in schema["properties"][field.name].items()


def test_the_mqtt_line_of_a_robot_without_a_gateway_has_every_field() -> None:
    assert [name for name in UNKNOWN if name in NAMES] == NAMES


def test_robot_status_has_the_fields_that_the_table_gives_it() -> None:
    carried = {field.row.mavlink for field in FIELDS if field.row.mavlink is not None}
    message = DIALECT.find(".//message[@name='ROBOT_STATUS']")
    assert message is not None
    assert {field.get("name") for field in message.iter("field")} == carried | ADDRESS
    assert set(RobotStatusMessage._fields) == carried | ADDRESS


def test_robot_status_carries_each_value_under_its_name() -> None:
    for field in FIELDS:
        if field.row.mavlink is not None:
            status = RobotStatus._make(int(one is field) for one in FIELDS)
            assert getattr(message_of(msg(status)), field.row.mavlink) == 1


def test_the_bits_of_the_inhibits_are_those_of_the_dialect() -> None:
    enum = DIALECT.find(".//enum[@name='ROBOT_STATUS_INHIBIT']")
    assert enum is not None
    entries = {int(entry.get("value", "0")): str(entry.get("name")) for entry in enum.iter("entry")}
    assert entries == {1 << bit: f"ROBOT_STATUS_INHIBIT_{name}" for bit, name in enumerate(INHIBITS)}


def test_each_field_has_two_separate_bits_in_rs_state() -> None:
    bits = [bits for _, bits in named_value.PACKED]
    assert sorted(bits) == list(range(0, 2 * len(bits), 2))
    assert bits[-1] < 30  # NAMED_VALUE_INT is an int32


def test_the_table_of_the_terminal_has_a_column_for_every_state() -> None:
    assert set(TITLES) <= {field.name for field in STATES}
    assert {field.name for field in STATES} <= {column.name for column in COLUMNS}


def test_a_field_without_a_title_uses_its_name() -> None:
    assert column_of("battery_low")[:3] == ("battery_low", "battery_low", 12)


def test_a_report_has_a_track_for_every_state() -> None:
    assert TRACKS[-len(STATES) :] == tuple(field.name for field in STATES)


def test_the_script_of_the_report_knows_no_field_that_the_table_lacks() -> None:
    (listed,) = re.findall(r"const FIELDS = \[(.*?)\];", asset("mav_robot_status.views", "report.js"), re.S)
    drawn = set(re.findall(r'"(\w+)"', listed)) - {"armed", "flight_mode", "link"}
    assert drawn
    assert drawn <= {field.name for field in STATES}
