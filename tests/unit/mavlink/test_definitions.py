"""The generated files are the output of dialects/generate.py, and other generators accept our XML."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
from types import ModuleType

import pytest
from pymavlink import dialects
from pymavlink.generator import mavgen

from mav_robot_status.mavlink.definitions import CRC_EXTRA, MESSAGES, RobotStatus
from mav_robot_status.mavlink.encode import encode

ROOT = pathlib.Path(__file__).parents[3]
PYMAVLINK = importlib.metadata.version("pymavlink")
PIN = re.search(r'"pymavlink==([\d.]+)"', (ROOT / "pyproject.toml").read_text())


def test_the_files_are_the_output_of_the_generator(tmp_path: pathlib.Path) -> None:
    assert PIN, "pyproject.toml pins pymavlink in the dev extra"
    if PIN[1] != PYMAVLINK:
        pytest.skip(f"the files are generated with pymavlink {PIN[1]}, here is {PYMAVLINK}")
    subprocess.run([sys.executable, ROOT / "dialects" / "generate.py", tmp_path], check=True, timeout=120)
    for name in ("mavlink/definitions.py", "mavlink/enumerations.py"):
        committed = (ROOT / "mav_robot_status" / name).read_bytes()
        assert (tmp_path / name).read_bytes() == committed, f"{name} differs: run dialects/generate.py"


def test_every_message_we_use_can_be_checked() -> None:
    assert MESSAGES.keys() <= CRC_EXTRA.keys()
    assert all(d.id == key for key, d in MESSAGES.items())


@pytest.fixture(scope="module")
def full_dialect(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A dialect that a user generates from our XML and the public files."""
    folder = tmp_path_factory.mktemp("dialect")
    public = pathlib.Path(dialects.__file__ or "").parent / "v20"
    for name in ("common", "standard", "minimal"):
        shutil.copy(public / f"{name}.xml", folder)
    source = shutil.copy(ROOT / "dialects" / "mav_robot_status.xml", folder)
    target = folder / "mav_robot_status_dialect.py"
    options = mavgen.Opts(str(target), wire_protocol="2.0", language="Python3", validate=False)
    mavgen.mavgen(options, [str(source)])
    spec = importlib.util.spec_from_file_location(target.stem, target)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_dialect_can_be_generated_from_our_xml_and_the_public_files(full_dialect: ModuleType) -> None:
    assert full_dialect.mavlink_map[59900].crc_extra == CRC_EXTRA[59900]
    assert full_dialect.mavlink_map[0].msgname == "HEARTBEAT"


def test_a_dialect_of_our_xml_reads_our_frames(full_dialect: ModuleType) -> None:
    status = RobotStatus(
        time_usec=1795200547123456,
        error_code=-7,
        inhibit_flags=0x80000001,
        subject_system=1,
        subject_component=2,
        mode=-1,
        e_stopped=-1,
        drives_powered=1,
        motion_possible=0,
        in_motion=-1,
        in_error=-1,
    )
    frame = encode(status, system=1, component=191, sequence=3)
    (message,) = full_dialect.MAVLink(None).parse_buffer(frame)
    assert message.get_type() == "ROBOT_STATUS"
    assert {name: getattr(message, name) for name in status._fields} == status._asdict()
