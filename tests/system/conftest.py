"""Fixtures of the system tests: gateways, wires and fake autopilots that stop at the end of a test."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.testing import DEMO, FakeAutopilot, Scenario
from mav_robot_status.testing.vehicle_model import VehicleModel

from .gateway_process import Gateway
from .wire import Wire


@pytest.fixture
def ended() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as stack:
        yield stack


@pytest.fixture
def gateway(ended: contextlib.ExitStack) -> Callable[..., Gateway]:
    """Start a gateway."""
    return lambda *arguments, **options: ended.enter_context(contextlib.closing(Gateway(*arguments, **options)))


@pytest.fixture
def wire(ended: contextlib.ExitStack) -> Callable[..., Wire]:
    """Open a wire."""
    return lambda *arguments, **options: ended.enter_context(contextlib.closing(Wire(*arguments, **options)))


@pytest.fixture
def autopilot(ended: contextlib.ExitStack) -> Callable[..., FakeAutopilot]:
    """Start a fake autopilot that sends to an address."""
    return lambda scenario, to, **options: ended.enter_context(FakeAutopilot(scenario, to=to, **options))


@pytest.fixture(scope="session")
def validate() -> Callable[[Any], None]:
    """Raises if a line does not match the schema of the package."""
    schema = json.loads((files("mav_robot_status") / "data" / "robot_status.schema.json").read_text("utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    validator: Callable[[Any], None] = jsonschema.Draft202012Validator(schema).validate
    return validator


def record(scenario: Scenario, seconds: float) -> bytes:
    """The messages of a fake autopilot within `seconds`, as a recorded log."""
    start = Instant(0.0, 1_800_000_000_000_000)
    model = VehicleModel(scenario, start.mono)
    log = b""
    for tick in range(round(seconds * 50)):
        now = later(start, tick / 50)
        for outgoing in model.run(now):
            log += now.unix_us.to_bytes(8, "big") + outgoing.frame()
    return log


@pytest.fixture(scope="session")
def demo_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo as a recorded log."""
    path = tmp_path_factory.mktemp("logs") / "demo.tlog"
    path.write_bytes(record(DEMO, DEMO.duration))
    return path
