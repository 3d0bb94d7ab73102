"""Third-party controllers and publishers for the gateway tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.controller import IndustrialRobotStatusController
from mav_robot_status.gateway import plugins
from mav_robot_status.interface import InterfaceManager, Publisher, PublisherContext, RobotStatusMsg


class FaultyController(IndustrialRobotStatusController):
    def update(self, time: Instant, period: float) -> None:
        raise ZeroDivisionError("as third parties do")


class ImpossibleController(IndustrialRobotStatusController):
    def init(self, hw: InterfaceManager, parameters: Mapping[str, object], publishers: Sequence[Publisher]) -> None:
        raise KeyError("gripper")


class Collecting:
    """Stores its messages. An option makes it fail at the first one."""

    periodic = True

    def __init__(self, context: PublisherContext) -> None:
        self.faulty = bool(context.options.get("faulty"))
        self.messages: list[RobotStatusMsg] = []
        self.closed = False
        MADE.append(self)

    def busy(self) -> bool:
        return False

    def publish(self, msg: RobotStatusMsg) -> None:
        if self.faulty:
            raise RuntimeError("as third parties do")
        self.messages.append(msg)

    def service(self, now: Instant) -> float | None:
        return None

    def close(self) -> None:
        self.closed = True


class LiveOnly(Collecting):
    """A third-party publisher that a replay skips."""

    live_only = True


class OneHandle(Collecting):
    """A third-party publisher whose receivers cannot tell whose status they get."""

    one_handle = True


class Durable(Collecting):
    """A durable third-party publisher."""

    durable = True

    def publish(self, msg: RobotStatusMsg) -> None:
        super().publish(msg)
        ORDER.append("durable")


class Shown(Collecting):
    def publish(self, msg: RobotStatusMsg) -> None:
        super().publish(msg)
        ORDER.append("shown")


MADE: list[Collecting] = []
ORDER: list[str] = []
"""The types of the publishers above, in the order of their messages."""


class Point:
    """The part of importlib.metadata.EntryPoint that the tests need."""

    def __init__(self, name: str, loaded: Any) -> None:
        self.name, self._loaded = name, loaded
        self.value = f"third_party:{name}"

    def load(self) -> Any:
        if isinstance(self._loaded, Exception):
            raise self._loaded
        return self._loaded


POINTS = {
    plugins.CONTROLLERS: [
        Point("third_party/Faulty", FaultyController),
        Point("third_party/Impossible", ImpossibleController),
        Point("third_party/Absent", ImportError("no module named numpy")),
    ],
    plugins.PUBLISHERS: [
        Point("collecting", Collecting),
        Point("live only", LiveOnly),
        Point("one handle", OneHandle),
        Point("durable", Durable),
        Point("shown", Shown),
    ],
}


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> list[Collecting]:
    """Simulate an installed third-party distribution. Returns the created publishers."""
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: POINTS[group])
    MADE.clear()
    ORDER.clear()
    return MADE
