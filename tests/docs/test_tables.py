"""What the documents list is what there is: tables, options, paths and pictures cannot drift from the code."""

from __future__ import annotations

import dataclasses
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any, get_args, get_type_hints

import pytest

from mav_robot_status.commands import COMMANDS
from mav_robot_status.config import Config, IdentityConfig, LinkConfig, SigningConfig, VehicleConfig
from mav_robot_status.config.model import Or
from mav_robot_status.config.reader import PARAMETERS
from mav_robot_status.controller import DEFAULT_PUBLISH_RATE
from mav_robot_status.gateway.plant import DEFAULT_PUBLISHERS
from mav_robot_status.hardware.causes import CAUSES
from mav_robot_status.hardware.fields.inhibits import INHIBITS
from mav_robot_status.hardware.options import HardwareOptions, Within
from mav_robot_status.interface import DEFAULT_HANDLE_NAME, Detail, RobotStatus
from mav_robot_status.link.url import KINDS
from mav_robot_status.publishers import metrics
from mav_robot_status.publishers.json_lines import native_body

from .documents import DOCUMENTS, ROOT, blocks, prose, table

WHOLE = ("gateway", "views", "hardware", "publishers", "interface")
"""Folders of which the picture of the house shows every part."""
OTHER_TOOLS = {"--dialect", "--check", "--reference"}  # options of MAVProxy, ruff and chown


@pytest.mark.parametrize(
    ("heading", "kind"),
    [
        ("## Sections", Config),
        ("## A link", LinkConfig),
        ("## A vehicle", VehicleConfig),
        ("## `identity`", IdentityConfig),
        ("## `signing`", SigningConfig),
        ("## `hardware`", HardwareOptions),
    ],
)
def test_the_keys_of_a_section_with_defaults_and_units(heading: str, kind: Any) -> None:
    hints = get_type_hints(kind, include_extras=True)
    expected = [
        [field.name, _default(field, get_args(hints[field.name])), _unit(get_args(hints[field.name]))]
        for field in dataclasses.fields(kind)
        if field.name != "controllers"  # every other key at the top
    ]
    assert [row[:3] for row in table("docs/configuration.md", "key", heading)] == expected


def _default(field: dataclasses.Field[Any], rules: tuple[Any, ...]) -> str:
    if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
        return ""
    value = field.default_factory() if field.default_factory is not dataclasses.MISSING else field.default
    if dataclasses.is_dataclass(value):
        return "see below"
    if value is None:
        return next(str(rule.word) for rule in rules if isinstance(rule, Or))
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping | frozenset | tuple):
        assert not value
        return "none"
    return value if isinstance(value, str) else f"{value:g}"


def _unit(rules: tuple[Any, ...]) -> str:
    within = next((rule for rule in rules if isinstance(rule, Within)), None)
    if within is None or (within.unit == "" and within.high > 255):
        return ""
    return f"{within.unit}, {within.low:g} to {within.high:g}".removeprefix(", ")


def test_the_parameters_of_a_controller_with_their_defaults() -> None:
    rows = table("docs/configuration.md", "key", "## A controller")
    assert [row[0] for row in rows] == list(PARAMETERS)
    defaults = [DEFAULT_HANDLE_NAME, f"{DEFAULT_PUBLISH_RATE:g}", "true", ", ".join(p.type for p in DEFAULT_PUBLISHERS)]
    assert [row[1] for row in rows] == defaults


def test_the_members_of_a_line() -> None:
    body = native_body("", RobotStatus(), Detail())
    members = re.findall(r'"(\w+)": ', re.sub(r"\{[^}]*\}?", "{}", body))
    assert [row[0] for row in table("docs/json.md", "member")] == ["stamp", "seq", *members]


@pytest.mark.parametrize(
    ("of", "families"),
    [
        ("of a vehicle", metrics.VEHICLE),
        ("of a connection", metrics.CONNECTION),
        ("of a publisher", metrics.PUBLISHER),
        ("of the gateway", metrics.GATEWAY),
    ],
)
def test_the_metrics_with_their_kinds(of: str, families: tuple[metrics.Family, ...]) -> None:
    rows = [(name, kind, words) for name, kind, _, words in table("docs/metrics.md", of)]
    assert rows == [(metrics.PREFIX + family.name, family.kind, family.help) for family in families]


def test_the_fields_of_the_readme() -> None:
    assert [row[0] for row in table("README.md", "field")] == list(RobotStatus._fields[:-1])


def test_the_reasons_in_the_order_of_their_bits() -> None:
    assert [row[0] for row in table("docs/json.md", "name")] == INHIBITS


def test_the_kinds_of_error_codes() -> None:
    kinds = {code // 1000 for code in CAUSES}
    assert [int(row[0]) for row in table("docs/json.md", "code / 1000")] == sorted(kinds)


def test_the_fields_of_robot_status_with_their_types() -> None:
    message = ET.parse(ROOT / "dialects" / "mav_robot_status.xml").getroot().find(".//message[@name='ROBOT_STATUS']")
    assert message is not None
    assert message.get("id") == "59900"
    fields = [[field.get("name"), field.get("type")] for field in message.iter("field")]
    assert [row[:2] for row in table("docs/mavlink.md", "field")] == fields


def test_the_connections_are_those_of_the_table_of_kinds() -> None:
    assert [row[0] for row in table("README.md", "connection")] == [kind.example for kind in KINDS]


def test_every_deviation_from_the_original_controller_is_listed() -> None:
    package = ROOT / "mav_robot_status"
    in_code = sorted(
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        for _ in re.findall(r"ORIGINAL: \w", path.read_text())
    )
    listed = sorted(row[0].split(",")[0] for row in table("docs/controller.md", "where"))
    assert listed == in_code


def _help(*module: str) -> str:
    command = [sys.executable, "-m", *module, "--help"]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=True, cwd=ROOT).stdout


def test_every_option_that_is_mentioned_exists() -> None:
    command = ["mav_robot_status.cli"]
    helps = [_help(*command, name) for name in COMMANDS] + [_help("fuzz"), _help("bench"), _help("bench.guard")]
    for document in DOCUMENTS:
        mentioned = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", document.read_text()))
        assert mentioned - OTHER_TOOLS <= set(re.findall(r"--[a-z-]+", "".join(helps))), document.name


def test_every_path_that_is_mentioned_exists() -> None:
    for document in DOCUMENTS:
        for path in re.findall(r"`((?:mav_robot_status|tests|dialects|config|docs|\.ci)/[^`\s]*)`", prose(document)):
            assert (ROOT / path).exists(), f"{document.name}: {path}"


def test_the_index_lists_every_document() -> None:
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} - {"index.md"}
    text = (ROOT / "docs" / "index.md").read_text()
    assert {page for page in pages if f"]({page})" in text} == pages


def test_the_picture_of_the_house_shows_what_there_is() -> None:
    picture = next(block for block in blocks("text") if block.document.name == "architecture.md").code
    folder: pathlib.Path | None = None
    top = set()
    drawn: dict[str, str] = {}
    for line in picture.splitlines()[1:]:
        found = re.match(r"(│   )?[├└]── (\S+)", line)
        assert found, line
        if found[1]:
            assert folder is not None
            path = folder / found[2]
        else:
            path = folder = ROOT / "mav_robot_status" / found[2]
            top.add(found[2].rstrip("/"))
        assert path.exists(), line
        drawn[folder.name] = drawn.get(folder.name, "") + line
        for file in re.findall(r"\b\w+\.py\b", line.partition(found[2])[2]):
            assert (folder / file).exists() or (ROOT / "dialects" / file).exists(), line
    there_is = {p.name for p in (ROOT / "mav_robot_status").iterdir() if p.suffix in ("", ".py") and p.name[0] != "_"}
    assert top == there_is
    for name in WHOLE:
        parts = {p.name for p in (ROOT / "mav_robot_status" / name).iterdir() if p.name[0] != "_"} - {"assets"}
        assert {part for part in parts if part not in drawn[name]} == set(), name
