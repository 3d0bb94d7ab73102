"""The table of targets is the output of dialects/generate_targets.py and agrees with pymavlink's modules."""

from __future__ import annotations

import importlib.metadata
import pathlib
import re
import struct
import subprocess
import sys
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as every_dialect

from mav_robot_status.mavlink.definitions import CRC_EXTRA, MESSAGES
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.mavlink.targets import TARGETS

ROOT = pathlib.Path(__file__).parents[3]
PYMAVLINK = importlib.metadata.version("pymavlink")
PIN = re.search(r'"pymavlink==([\d.]+)"', (ROOT / "pyproject.toml").read_text())
UPSTREAM_ONLY = {19, 80, 400, 401, 412, 413}


def test_the_file_is_the_output_of_the_generator(tmp_path: pathlib.Path) -> None:
    assert PIN, "pyproject.toml pins pymavlink in the dev extra"
    if PIN[1] != PYMAVLINK:
        pytest.skip(f"the file is generated with pymavlink {PIN[1]}, here is {PYMAVLINK}")
    subprocess.run([sys.executable, ROOT / "dialects" / "generate_targets.py", tmp_path], check=True, timeout=120)
    committed = (ROOT / "mav_robot_status" / "mavlink" / "targets.py").read_bytes()
    assert (tmp_path / "targets.py").read_bytes() == committed, "targets.py differs: run dialects/generate_targets.py"


def test_every_message_with_a_target_can_be_checked() -> None:
    assert TARGETS.keys() <= CRC_EXTRA.keys()
    assert len(TARGETS) > 100


def test_offsets_fit_a_payload() -> None:
    for system_at, component_at in TARGETS.values():
        assert 0 <= system_at < 255
        assert -1 <= component_at < 255
        assert system_at != component_at


def offset(message: Any, field: str) -> int:
    """The offset of a field, from the struct layout in pymavlink's generated module; -1: no such field."""
    if field not in message.ordered_fieldnames:
        return -1
    codes = re.findall(r"\d*[a-zA-Z]", message.unpacker.format)  # one for each field
    return struct.calcsize("<" + "".join(codes[: message.ordered_fieldnames.index(field)]))


def test_the_table_agrees_with_pymavlinks_modules() -> None:
    compared = set()
    for message_id, message in every_dialect.mavlink_map.items():
        if CRC_EXTRA.get(message_id) != message.crc_extra or message.msgname == "MANUAL_CONTROL":
            continue
        system_at, component_at = offset(message, "target_system"), offset(message, "target_component")
        assert TARGETS.get(message_id, (-1, -1)) == (system_at, component_at), message.msgname
        compared.add(message_id)
    if PIN and PIN[1] == PYMAVLINK:
        assert TARGETS.keys() - compared == UPSTREAM_ONLY | {69}


def test_manual_control_has_a_target_field_of_another_name() -> None:
    assert TARGETS[69] == (offset(every_dialect.mavlink_map[69], "target"), -1)


@pytest.mark.parametrize("version", [1, 2])
def test_the_targets_of_our_own_frames_are_found(version: int) -> None:
    found = 0
    for definition in MESSAGES.values():
        fields = definition.type._fields
        if "target_system" not in fields:
            assert definition.id not in TARGETS
            continue
        if version == 1 and definition.id > 255:  # MAVLink 1 has one byte for it
            continue
        zeros = dict(zip(fields, definition.layout.unpack(bytes(definition.layout.size)), strict=True))
        target = {name: value for name, value in (("target_system", 7), ("target_component", 9)) if name in fields}
        message = definition.type(**zeros | target)
        (frame,) = Parser(None).feed(encode(message, system=1, component=1, sequence=0, version=version))
        assert [frame.payload[at] for at in TARGETS[definition.id] if at >= 0] == list(target.values())
        found += 1
    assert found >= 5
