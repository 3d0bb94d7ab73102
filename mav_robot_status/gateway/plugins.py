"""Controllers and publishers by name, from entry points.

`OURS` repeats our own entry points in pyproject.toml; a test compares the two. A gateway that uses only these starts
without a scan of all installed packages.
"""

from __future__ import annotations

import importlib
from typing import Any, Final

from ..errors import ConfigError

CONTROLLERS: Final = "mav_robot_status.controllers"
HARDWARE: Final = "mav_robot_status.hardware"
PUBLISHERS: Final = "mav_robot_status.publishers"

MAVLINK: Final = "mavlink"
"""The type of the MAVLink hardware interface. It has no entry point, because it needs the links of a gateway."""

OURS: Final[dict[str, dict[str, str]]] = {
    HARDWARE: {
        "simple_message": "mav_robot_status.hardware.simple_message.interface:SimpleMessageRobotHW",
        "ur": "mav_robot_status.hardware.ur.interface:UrRobotHW",
    },
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
        "mcap": "mav_robot_status.publishers.mcap.publisher:McapPublisher",
        "mirror": "mav_robot_status.publishers.named_value:NamedValuePublisher",
        "mqtt": "mav_robot_status.publishers.mqtt.publisher:MqttPublisher",
        "queue": "mav_robot_status.publishers.queue:QueuePublisher",
        "simple_message": "mav_robot_status.publishers.simple_message.publisher:SimpleMessagePublisher",
        "ros2": "mav_robot_status.publishers.ros.publisher:Ros2Publisher",
    },
}


def load(group: str, name: str, where: str) -> Any:
    """The class that is registered under `name`. Raises ConfigError, which lists the registered names."""
    target = OURS[group].get(name)
    if target is not None:
        module, _, attribute = target.partition(":")
        return getattr(importlib.import_module(module), attribute)
    from importlib.metadata import entry_points

    found = {point.name: point for point in entry_points(group=group)}
    if name in found:
        try:
            return found[name].load()
        except Exception as error:  # a third party's module may raise anything on import
            raise ConfigError(f"{where}: cannot load '{name}' ({found[name].value}): {error}") from error
    import difflib

    names = sorted({*found, *OURS[group], *([MAVLINK] if group == HARDWARE else [])})
    near = difflib.get_close_matches(name, names, 1)
    hint = f"did you mean '{near[0]}'?" if near else "registered: " + ", ".join(f"'{n}'" for n in names)
    raise ConfigError(f"{where}: nothing is registered as '{name}' in {group}; {hint}")


def declares(made: object, attribute: str) -> bool:
    """Whether a publisher class sets a flag: `live_only`, `durable` or `one_handle`. The default is False."""
    return bool(getattr(made, attribute, False))


def is_part_of_this_package(part: object) -> bool:
    """Whether a part is ours. The gateway catches all exceptions of third-party parts."""
    return type(part).__module__.partition(".")[0] == __name__.partition(".")[0]
