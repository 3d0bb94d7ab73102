"""Every number of a configuration has bounds: an absurd one is one line, with its place, and never hangs anything."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mav_robot_status.cli import main
from mav_robot_status.config import Config, load
from mav_robot_status.config.model import IdentityConfig, LinkConfig, SigningConfig, VehicleConfig
from mav_robot_status.gateway.plugins import OURS
from mav_robot_status.hardware.mavlink.options import HardwareOptions, Within
from mav_robot_status.interface.options import Options
from mav_robot_status.publishers.json_lines import JsonOptions
from mav_robot_status.publishers.mqtt.settings import MqttOptions
from mav_robot_status.publishers.web.settings import HttpOptions

STANZA = "c: {{type: mav_robot_status/IndustrialRobotStatusController, {}}}\n"
SECTIONS: list[tuple[type, str]] = [
    (Config, "{}: VALUE\n"),
    (IdentityConfig, "identity: {{{}: VALUE}}\n"),
    (SigningConfig, "signing: {{key_file: key, {}: VALUE}}\n"),
    (VehicleConfig, "vehicles: [{{{}: VALUE}}]\n"),
    (LinkConfig, "links: [{{url: 'udp:127.0.0.1:14550', {}: VALUE}}]\n"),
    (HardwareOptions, "hardware: {{{}: VALUE}}\n"),
]
PUBLISHERS: list[tuple[str, type[Options], str]] = [
    ("json", JsonOptions, ""),
    ("http", HttpOptions, ""),
    ("mqtt", MqttOptions, "url: 'mqtt://broker/robots', "),
]
OTHERS = [
    STANZA.format("publish_rate: VALUE"),
    "hardware: {mode_overrides: {rover: {VALUE: AUTO}}}\n",
    "links: ['udp:127.0.0.1:VALUE']\n",
    "links: ['/dev/ttyS9,VALUE']\n",
    "outs: ['tcp:127.0.0.1:VALUE']\n",
    STANZA.format("publishers: [{type: mqtt, url: 'mqtt://broker:VALUE/robots'}]"),
    STANZA.format("publishers: [{type: http, listen: '127.0.0.1:VALUE'}]"),
]
ABSURD = ["-1", "0", ".nan", ".inf", "-.inf", "1e308", "-1e308", "1e-320", "1e999", "9" * 30, "9" * 5000]
ABSURD += ["0x7fffffffffff", "''", "abc", "[1]", "{a: 1}", "true", "~", "1_000_000_000_000", "1:30:00", "1 year"]


def is_number(hint: Any) -> bool:
    return get_origin(hint) is Annotated and any(isinstance(rule, Within) for rule in get_args(hint))


def numeric_keys() -> Iterator[str]:
    """A configuration for each numeric key, with VALUE in place of the number."""
    for section, form in SECTIONS:
        hints = get_type_hints(section, include_extras=True)
        yield from (form.format(name) for name, hint in hints.items() if is_number(hint))
    for name, options, first in PUBLISHERS:
        for one in options.declared():
            if one.kind is float:
                yield STANZA.format(f"publishers: [{{type: {name}, {first}{one.name}: VALUE}}]")
    yield from OTHERS


KEYS = list(numeric_keys())


def answer(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str | None:
    """The one line of `check-config`, or None if it accepts the file."""
    file = folder / "c.yaml"
    file.write_text(text)
    code = main(["check-config", str(file)])
    said = capsys.readouterr()
    if code == 0:
        assert not said.err
        return None
    assert code == 2
    assert said.err.startswith(f"mav-robot-status: {file}:")
    assert said.err.count("\n") == 1
    assert len(said.err) < 600
    return said.err


def test_every_section_and_publisher_is_in_the_table() -> None:
    assert len(KEYS) > 20
    hints = get_type_hints(Config, include_extras=True)
    nested = {kind for kind in map(_dataclass_of, hints.values()) if kind is not None}
    assert {kind for kind in nested if any(map(is_number, get_type_hints(kind, include_extras=True).values()))} <= {
        section for section, _ in SECTIONS
    }
    assert {name for name, _, _ in PUBLISHERS} >= {"json", "http", "mqtt"} & set(OURS)


def _dataclass_of(hint: Any) -> type | None:
    """The dataclass in a hint like `Annotated[X | None, ...]` or `tuple[X, ...]`."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return hint
    return next((found for part in get_args(hint) if (found := _dataclass_of(part)) is not None), None)


@pytest.mark.parametrize("text", KEYS, ids=[key.strip()[-50:] for key in KEYS])
def test_an_absurd_number_is_one_line_with_its_place(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused = [value for value in ABSURD if answer(text.replace("VALUE", value), tmp_path, capsys) is not None]
    negative = set() if "publish_rate" in text else {"-1"}
    assert {".nan", "1e308", "9" * 30, "abc"} | negative <= set(refused)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    text=st.sampled_from(KEYS),
    value=st.one_of(st.floats(), st.integers(), st.text(alphabet="0123456789+-.eE_xn{}:>'\" \n", max_size=12)),
)
def test_any_value_of_a_number_is_refused_in_one_line_or_finite(
    text: str, value: float | str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if answer(text.replace("VALUE", str(value)), tmp_path, capsys) is None:
        config = load(tmp_path / "c.yaml")
        assert 0.0 <= config.coalesce <= 1.0
        rates = [float(str(c.parameters.get("publish_rate", 10))) for c in config.controllers]
        assert all(rate <= 1000.0 and math.isfinite(rate) for rate in rates)
