"""Tables, options, paths and pictures in the documents match the code."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any, get_args, get_type_hints

import pytest

from mav_robot_status.commands import COMMANDS
from mav_robot_status.config import Config, IdentityConfig, LinkConfig, SigningConfig, VehicleConfig
from mav_robot_status.config.reader import PARAMETERS
from mav_robot_status.controller import DEFAULT_PUBLISH_RATE
from mav_robot_status.gateway.controller_config import DEFAULT_PUBLISHERS
from mav_robot_status.hardware.group import NOT_POSSIBLE
from mav_robot_status.hardware.mavlink.faults.causes import CAUSES
from mav_robot_status.hardware.mavlink.options import HardwareOptions, Or, Within
from mav_robot_status.hardware.mavlink.readiness.rule import INHIBITS
from mav_robot_status.hardware.simple_message.interface import SimpleMessageHardwareOptions
from mav_robot_status.hardware.simple_message.status import NO_CODE
from mav_robot_status.hardware.ur.interface import UrOptions
from mav_robot_status.hardware.ur.status import NOT_RUNNING, STOPS
from mav_robot_status.interface import DEFAULT_HANDLE_NAME, Detail, Options, RobotStatus
from mav_robot_status.interface.options import Declared
from mav_robot_status.links.url import KINDS
from mav_robot_status.publishers import metrics
from mav_robot_status.publishers.json_lines import native_body

from .documents import DOCUMENTS, ROOT, blocks, links, name_of, prose, table

OTHER_TOOLS = {"--dialect", "--check", "--reference", "--packages-select"}  # of MAVProxy, ruff, chown and colcon
NO_KEYS = ("controllers", "interfaces", "names", "without_effect")
"""Fields of a configuration that are no keys: other keys at the top, parts of two lists, keys of former versions."""


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
        if field.name not in NO_KEYS
    ]
    assert [row[:3] for row in table("docs/reference/configuration.md", "key", heading)] == expected


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
    rows = table("docs/reference/configuration.md", "key", "## A controller")
    assert [row[0] for row in rows] == list(PARAMETERS)
    defaults = [DEFAULT_HANDLE_NAME, f"{DEFAULT_PUBLISH_RATE:g}", "true", ", ".join(p.type for p in DEFAULT_PUBLISHERS)]
    assert [row[1] for row in rows] == defaults


def test_the_members_of_a_line() -> None:
    body = native_body("", RobotStatus(), Detail(members=("arm",)))
    members = re.findall(r'"(\w+)": ', re.sub(r"\{[^}]*\}?|\[[^]]*\]", "{}", body))
    assert [row[0] for row in table("docs/reference/json.md", "member")] == ["stamp", "boot_s", "seq", *members]


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
    rows = [(name, kind, words) for name, kind, _, words in table("docs/reference/metrics.md", of)]
    assert rows == [(metrics.PREFIX + family.name, family.kind, family.help) for family in families]


def test_the_fields_of_the_readme() -> None:
    assert [row[0] for row in table("README.md", "field")] == list(RobotStatus._fields[:-1])


def test_the_reasons_in_the_order_of_their_bits() -> None:
    assert [row[0] for row in table("docs/reference/json.md", "name")] == INHIBITS


def test_the_kinds_of_error_codes() -> None:
    kinds = {code // 1000 for code in CAUSES} | {NO_CODE // 1000}
    assert [int(row[0]) for row in table("docs/reference/json.md", "code / 1000")] == sorted(kinds)


@pytest.mark.parametrize(
    ("heading", "kind"), [("### `type: ur`", UrOptions), ("### `type: simple_message`", SimpleMessageHardwareOptions)]
)
def test_the_options_of_an_arm_with_their_defaults(heading: str, kind: type[Options]) -> None:
    expected = [[one.name, *_default_and_bounds(one)] for one in kind.declared()]
    assert [row[:3] for row in table("docs/reference/configuration.md", "key", heading)] == expected


def _default_and_bounds(one: Declared) -> tuple[str, str]:
    bounds = f"{one.option.low:g} to {one.option.high:g}" if one.kind is float else ""
    if one.default is dataclasses.MISSING:
        return "", bounds
    return f"{one.default:g}" if isinstance(one.default, int | float) else str(one.default), bounds


def test_the_error_codes_of_arms() -> None:
    codes = {stop.code: stop.name for stop in STOPS if stop.code} | {NO_CODE: "CONTROLLER_ERROR"}
    rows = table("docs/reference/arms.md", "code", "## Error codes")
    assert [(int(code), name) for code, name, _ in rows] == sorted(codes.items())


def test_the_inhibits_of_arms() -> None:
    names = [stop.name for stop in STOPS] + [name for name, _ in NOT_RUNNING.values()]
    others = ["NOT_RUNNING", "CONTROLLER_ERROR", NOT_POSSIBLE, "LINK_STALE"]
    listed = [row[0] for row in table("docs/reference/arms.md", "name", "## Inhibits: why motion is not possible")]
    assert listed == list(dict.fromkeys([*names, *others]))


def test_the_fields_of_an_arm() -> None:
    fields = [row[0] for row in table("docs/reference/arms.md", "field")]
    assert fields == list(RobotStatus._fields[:-1])


def test_the_fields_of_robot_status_with_their_types() -> None:
    message = ET.parse(ROOT / "dialects" / "mav_robot_status.xml").getroot().find(".//message[@name='ROBOT_STATUS']")
    assert message is not None
    assert message.get("id") == "59900"
    fields = [[field.get("name"), field.get("type")] for field in message.iter("field")]
    assert [row[:2] for row in table("docs/reference/mavlink.md", "field")] == fields


def test_the_connections_are_those_of_the_table_of_kinds() -> None:
    assert [row[0] for row in table("README.md", "connection")] == [kind.example for kind in KINDS]


def test_every_deviation_from_the_original_controller_is_listed() -> None:
    package = ROOT / "mav_robot_status"
    in_code = sorted(
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        for _ in re.findall(r"ORIGINAL: \w", path.read_text())
    )
    places = [row[0].split(",")[0] for row in table("docs/explanation/controller.md", "where")]
    listed = sorted(place for place in places if place.endswith(".py"))
    assert listed == in_code


def _help(*module: str) -> str:
    command = [sys.executable, "-m", *module, "--help"]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=True, cwd=ROOT).stdout


def test_every_option_that_is_mentioned_exists() -> None:
    command = ["mav_robot_status.cli"]
    helps = [_help(*command), *(_help(*command, name) for name in COMMANDS)]
    helps += [_help("fuzz"), _help("bench"), _help("bench.guard")]
    for document in DOCUMENTS:
        mentioned = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", document.read_text()))
        assert mentioned - OTHER_TOOLS <= set(re.findall(r"--[a-z-]+", "".join(helps))), name_of(document)


def test_every_path_that_is_mentioned_exists() -> None:
    for document in DOCUMENTS:
        for path in re.findall(r"`((?:mav_robot_status|tests|dialects|config|docs|\.ci)/[^`\s]*)`", prose(document)):
            assert (ROOT / path).exists(), f"{name_of(document)}: {path}"


def test_the_seven_places_where_a_change_goes_exist() -> None:
    rows = table("CONTRIBUTING.md", "a new ...")
    assert len(rows) == 7
    folders = "hardware|links|publishers|interface|gateway|testing|mavlink|data"
    for row in rows:
        places = re.findall(rf"(?<![/\w])(?:{folders})/[^\s,;<]*", row[1])
        assert places, row[0]
        for place in places:
            assert (ROOT / "mav_robot_status" / place).exists(), place


def test_the_tables_that_a_change_extends_exist_in_the_modules_that_are_named() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text()
    named = re.findall(r"`([A-Z]\w+)` in `((?:hardware|links|gateway|interface)/[^`<]*\.py)`", text)
    assert {"KINDS", "OURS", "RobotStatus", "CAUSES"} <= {name for name, _ in named}
    for name, module in named:
        code = (ROOT / "mav_robot_status" / module).read_text()
        assert re.search(rf"^(class )?{name}\b", code, re.MULTILINE), f"{name} in {module}"


@pytest.mark.parametrize("folder", ["", "decisions", "semantics"])
def test_an_index_lists_every_page_of_its_folder(folder: str) -> None:
    index = ROOT / "docs" / folder / "index.md"
    own = ROOT / "docs" / "decisions", ROOT / "docs" / "semantics"
    pages = set(index.parent.rglob("*.md")) - {index}
    if not folder:
        pages = {page for page in pages if page.parent not in own or page.name == "index.md"}
    listed = {(index.parent / link.partition("#")[0]).resolve() for link in links(index)}
    assert sorted(pages - listed) == []


def test_the_picture_of_the_architecture_shows_every_room_and_no_other() -> None:
    package = ROOT / "mav_robot_status"
    picture = next(
        b for b in blocks("text") if b.document.name == "architecture.md" and b.code.startswith(package.name)
    )
    path = [package]
    drawn = set()
    for line in picture.code.splitlines()[1:]:
        found = re.match(r"((?:[│ ]   )*)[├└]── (\S+)/ +\S", line)
        assert found, line
        depth = len(found[1]) // 4
        path[depth + 1 :] = [path[depth] / found[2]]
        drawn.add(path[-1])
    rooms = {p.parent for p in package.rglob("__init__.py")} - {package}
    small = {package / "testing" / name for name in ("conformance", "scenarios")}
    assert drawn == rooms - small | {package / "data"}


def test_the_rooms_are_drawn_in_the_order_of_their_imports() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    layers = text.partition("layers = [")[2].partition("]")[0]
    order = [
        name for name in re.findall(r"mav_robot_status\.(\w+)", layers) if (ROOT / "mav_robot_status" / name).is_dir()
    ]
    picture = next(b for b in blocks("text") if b.code.startswith("mav_robot_status/"))
    assert re.findall(r"^[├└]── (\w+)/", picture.code, re.MULTILINE) == [*order, "data"]


def test_every_source_that_the_semantics_cite_is_listed() -> None:
    listed = set(re.findall(r"^- \*\*(S\d+)\*\* ", (ROOT / "docs/semantics/sources.md").read_text(), re.MULTILINE))
    for page in (ROOT / "docs" / "semantics").glob("*.md"):
        cited = set(re.findall(r"\[(S\d+)b?c?\]", page.read_text()))
        assert sorted(cited - listed) == [], name_of(page)


def test_every_anchor_of_a_link_is_a_heading() -> None:
    for document in DOCUMENTS:
        for link in links(document):
            path, _, anchor = link.partition("#")
            if anchor:
                target = document.parent / path if path else document
                headings = re.findall(r"^#+ (.*)$", prose(target), re.MULTILINE)
                assert anchor in {_anchor(heading) for heading in headings}, f"{name_of(document)}: {link}"


def _anchor(heading: str) -> str:
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def test_each_test_that_the_threat_model_names_exists() -> None:
    text = (ROOT / "docs" / "explanation" / "threat-model.md").read_text("utf-8")
    named = re.findall(r"`(test_\w+\.py)`: ((?:`test_\w+`(?:, )?)+)", text)
    assert len(named) > 30
    for file, names in named:
        places = (ROOT / "tests" / folder / file for folder in ("system", "unit/gateway", "unit/hardware/mavlink"))
        source = next(place for place in places if place.exists()).read_text("utf-8")
        assert [name for name in re.findall(r"`(\w+)`", names) if f"def {name}(" not in source] == []


@pytest.mark.parametrize("first", ["parameter", "where"])
def test_each_line_about_the_original_controller_names_its_test(first: str) -> None:
    tests = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    for row in table("docs/explanation/controller.md", first):
        assert f"def {row[-1]}(" in tests, row
