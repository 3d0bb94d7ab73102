"""A third party's controllers and publisher, as the tests of the gateway load them."""

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
    """Keeps its messages; an option makes it fail at the first."""

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


MADE: list[Collecting] = []


class Point:
    """What is needed of an importlib.metadata.EntryPoint."""

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
    plugins.PUBLISHERS: [Point("collecting", Collecting)],
}


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> list[Collecting]:
    """As if a third party's distribution were installed; the publishers that are made."""
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: POINTS[group])
    MADE.clear()
    return MADE
