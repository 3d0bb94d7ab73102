"""Controllers and publishers by name: ours from a table, a third party's from entry points.

The table holds the same as our own entry points in pyproject.toml (a test compares); it spares the start of the gateway
the search through all installed packages.
"""

from __future__ import annotations

import difflib
import importlib
from typing import Any, Final

from ..errors import ConfigError

CONTROLLERS: Final = "mav_robot_status.controllers"
PUBLISHERS: Final = "mav_robot_status.publishers"

OURS: Final[dict[str, dict[str, str]]] = {
    CONTROLLERS: {
        "mav_robot_status/IndustrialRobotStatusController": (
            "mav_robot_status.controller:IndustrialRobotStatusController"
        ),
        "industrial_robot_status_controller/IndustrialRobotStatusController": (
            "mav_robot_status.controller:IndustrialRobotStatusController"
        ),
    },
    PUBLISHERS: {
        "board": "mav_robot_status.publishers.board:BoardPublisher",
        "http": "mav_robot_status.publishers.web.publisher:HttpPublisher",
        "json": "mav_robot_status.publishers.json_lines:JsonLinesPublisher",
        "mavlink": "mav_robot_status.publishers.mavlink:MavlinkPublisher",
        "mirror": "mav_robot_status.publishers.mirror:MirrorPublisher",
        "mqtt": "mav_robot_status.publishers.mqtt.publisher:MqttPublisher",
    },
}


def load(group: str, name: str, where: str) -> Any:
    """The class that is registered under `name`. Raises ConfigError, which lists what there is."""
    target = OURS[group].get(name)
    if target is not None:
        module, _, attribute = target.partition(":")
        return getattr(importlib.import_module(module), attribute)
    from importlib.metadata import entry_points

    found = {point.name: point for point in entry_points(group=group)}
    if name in found:
        try:
            return found[name].load()
        except Exception as error:  # whatever a third party's module raises when it is imported
            raise ConfigError(f"{where}: cannot load '{name}' ({found[name].value}): {error}") from error
    names = sorted({*found, *OURS[group]})
    near = difflib.get_close_matches(name, names, 1)
    hint = f"did you mean '{near[0]}'?" if near else "there are " + ", ".join(f"'{n}'" for n in names)
    raise ConfigError(f"{where}: nothing is registered as '{name}' in {group}; {hint}")
