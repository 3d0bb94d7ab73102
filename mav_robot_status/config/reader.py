"""Reads the sections of a configuration file, and checks conditions across sections."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Annotated, Any, Final, get_type_hints

from ..errors import UsageError
from ..hardware.mavlink.options import BELOW, Within
from ..interface import DEFAULT_HANDLE_NAME
from ..links import url
from ..links.tlog_file import check_name
from ..mavlink.component import GROUND_STATION
from .document import Node, load_document, quoted
from .model import NO_EFFECT, Config, ControllerConfig, HardwareConfig, NameConfig, PublisherConfig, VehicleConfig
from .values import did_you_mean, entries, read

OUR_TYPES: Final = (
    "mav_robot_status/IndustrialRobotStatusController",
    "industrial_robot_status_controller/IndustrialRobotStatusController",
)
MAVLINK: Final = "mavlink"
"""The type of the MAVLink hardware interface in a list."""
PARAMETERS: Final[dict[str, Any]] = {
    "handle_name": str,
    "publish_rate": Annotated[float, Within(-math.inf, 1000.0, "Hz")],  # 0 or less: nothing periodically
    "publish_on_change": bool,
    "publishers": tuple[PublisherConfig, ...],
}
"""The parameters of our controller. Another type checks its own, except for `publishers`."""
SHARED: Final = frozenset({"publishers"})


def load(path: str | os.PathLike[str]) -> Config:
    """Read and check a configuration file.

    Raises ConfigError: `file:line:column: what is wrong and what would be right`.
    """
    return build(load_document(path))


def build(document: Node) -> Config:
    """The configuration that a file holds. Raises ConfigError."""
    sections = get_type_hints(Config, include_extras=True)
    del sections["controllers"], sections["interfaces"], sections["names"], sections["without_effect"]
    given, without_effect = _without_effect(entries(document))
    given, interfaces = _hardware(given)
    given, names = _names(given)
    read_sections = {key: read(sections[key], node) for key, node in given.items() if key in sections}
    stanzas = [_controller(key, node, sections) for key, node in given.items() if key not in sections]
    config = Config(
        **read_sections,
        names=names,
        interfaces=interfaces,
        controllers=tuple(stanzas),
        without_effect=without_effect,
    )
    _check_hysteresis(config, given)
    _check_outs(config, given)
    _check_record(config.record, given)
    _check_vehicles(config.vehicles, given)
    _check_identity(config, given)
    _check_handles(config, given)
    _check_groups(config, given)
    return config


def _without_effect(given: dict[str, Node]) -> tuple[dict[str, Node], tuple[str, ...]]:
    """Split the keys that have no effect any more. Their values are not checked."""
    old = {key: node for key, node in given.items() if key in NO_EFFECT}
    lines = tuple(f"{(node.key or node).at}: {NO_EFFECT[key].format(key)}" for key, node in old.items())
    return {key: node for key, node in given.items() if key not in old}, lines


def _hardware(given: dict[str, Node]) -> tuple[dict[str, Node], tuple[HardwareConfig, ...]]:
    """Split the list `hardware`: the entries with MAVLink's options as a mapping, and the other interfaces."""
    section = given.get("hardware")
    if section is None or not isinstance(section.value, list):
        return given, ()
    given = {key: node for key, node in given.items() if key != "hardware"}
    others: dict[str, HardwareConfig] = {}
    for node in section.value:
        kind, name, options = _typed(node)
        if kind == MAVLINK:
            if "hardware" in given:
                raise node.fault("two MAVLink hardware interfaces: keep one, and write all its links below 'links'")
            given["hardware"] = node._replace(value=options)
        elif name in others:
            raise node.fault(f"two hardware interfaces are named {quoted(name)}: give each its own 'name'")
        else:
            plain = {key: option.plain() for key, option in options.items()}
            others[name] = HardwareConfig(kind, name, plain, node.at)
    return given, tuple(others.values())


def _names(given: dict[str, Node]) -> tuple[dict[str, Node], dict[tuple[int, int | None], str]]:
    """Split the list `vehicles`: the expected vehicles, and the entries that give a name and no handle."""
    section = given.get("vehicles")
    if section is None or not isinstance(section.value, list):
        return given, {}
    expected = [node for node in section.value if not _is_only_named(node)]
    names: dict[tuple[int, int | None], str] = {}
    for node in filter(_is_only_named, section.value):
        if expected:
            raise node.fault(
                f"{node.name} has a name and no 'handle', and would be ignored: {expected[0].name} makes the list the "
                "only vehicles; write its 'handle'"
            )
        entry: NameConfig = read(NameConfig, node)
        if (entry.system, entry.component) in names:
            raise node.fault(f"system {entry.system} is given twice: one vehicle has one name")
        names[entry.system, entry.component] = entry.name
    return {**given, "vehicles": section._replace(value=expected)}, names


def _is_only_named(node: Node) -> bool:
    return isinstance(node.value, dict) and "name" in node.value and "handle" not in node.value


def _typed(node: Node) -> tuple[str, str, dict[str, Node]]:
    """The type, the name and the options of one hardware interface. The default name is the type."""
    options = dict(entries(node))
    if "type" not in options:
        raise node.fault(f"{node.name} has no 'type': write {{type: mavlink}}, or {{type: ..., name: ...}}")
    kind = read(str, options.pop("type"))
    name = read(str, options.pop("name")) if "name" in options else kind
    return kind, name, options


def _controller(name: str, node: Node, sections: Mapping[str, Any]) -> ControllerConfig:
    if not isinstance(node.value, dict) or "type" not in node.value:
        hint = did_you_mean(name, sections)
        raise node.key_fault(f"{quoted(name)} is neither a section nor a controller, which has a 'type': {hint}")
    parameters = {key: value for key, value in node.value.items() if key != "type"}
    kind = read(str, node.value["type"])
    if kind in OUR_TYPES:
        entries(node._replace(value=parameters), PARAMETERS)
    known = {key: read(PARAMETERS[key], parameters[key]) for key in parameters if key in SHARED or kind in OUR_TYPES}
    plain = {key: value.plain() for key, value in parameters.items()}
    return ControllerConfig(name, kind, plain, (node.key or node).at, known.get("publishers"))


def _check_hysteresis(config: Config, given: dict[str, Node]) -> None:
    for lower, upper in BELOW.items():
        low, high = getattr(config.hardware, lower), getattr(config.hardware, upper)
        if low >= high:
            written = entries(given["hardware"])
            fault = (written.get(lower) or written[upper]).fault
            raise fault(f"{lower} ({low:g} m/s) must be less than {upper} ({high:g} m/s)")


def _check_identity(config: Config, given: dict[str, Node]) -> None:
    if config.identity.system == GROUND_STATION:
        raise entries(given["identity"])["system"].fault(
            f"our system id cannot be {GROUND_STATION}: autopilots take it for the id of their ground station "
            "(SYSID_MYGCS), and would not notice the loss of that station; write auto, or another number"
        )


def _check_outs(config: Config, given: dict[str, Node]) -> None:
    for out, node in zip(config.outs, _items(given, "outs"), strict=True):
        if url.parse(out.url).kind.is_log:
            raise node.fault(
                f"{quoted(out.url)} is a log, and an out needs a receiver: write one like udpout:192.168.1.20:14550"
            )
        if out.passive:
            raise entries(node)["passive"].key_fault("an out cannot be passive: remove 'passive'")
        if out.heartbeat_timeout is not None:
            raise entries(node)["heartbeat_timeout"].key_fault(
                "no vehicle is heard on an out: write 'heartbeat_timeout' under a link"
            )


def _check_record(path: str | None, given: dict[str, Node]) -> None:
    if path is not None:
        try:
            check_name(path)
        except UsageError as error:
            raise given["record"].fault(str(error)) from None


def _check_vehicles(vehicles: tuple[VehicleConfig, ...], given: dict[str, Node]) -> None:
    handles: set[str] = set()
    systems: set[tuple[int, int | None]] = set()
    for vehicle, node in zip(vehicles, _items(given, "vehicles"), strict=True):
        if vehicle.handle in handles:
            raise node.fault(f"two vehicles have the handle {quoted(vehicle.handle)}: give each its own 'handle'")
        handles.add(vehicle.handle)
        if vehicle.system is not None:
            if (vehicle.system, vehicle.component) in systems:
                raise node.fault(f"system {vehicle.system} is given twice: one vehicle has one handle")
            systems.add((vehicle.system, vehicle.component))


def _check_handles(config: Config, given: dict[str, Node]) -> None:
    if config.interfaces:  # they register their handles when they open
        return
    handles = {vehicle.handle: None for vehicle in config.vehicles}
    if handles:
        handles |= dict.fromkeys(config.groups)
    for controller in config.controllers:
        wanted = controller.parameters.get("handle_name", DEFAULT_HANDLE_NAME)
        if handles and controller.type in OUR_TYPES and wanted not in handles:
            stanza = given[controller.name]
            at = entries(stanza).get("handle_name", stanza.key or stanza)
            raise at.fault(f"there is no handle {quoted(str(wanted))}; the vehicles have: {', '.join(handles)}")


def _check_groups(config: Config, given: dict[str, Node]) -> None:
    others = {interface.name for interface in config.interfaces} | {vehicle.handle for vehicle in config.vehicles}
    for name, group in config.groups.items():
        node = entries(given["groups"])[name]
        if name in others:
            raise node.key_fault(f"a group cannot have the handle {quoted(name)}: a robot has it; choose another name")
        written = entries(node)
        for handle, item in zip(group.handles, _items(written, "handles"), strict=True):
            if handle in config.groups:
                raise item.fault(f"{quoted(handle)} is a group: a group has robots as members; name those")
            if group.handles.count(handle) > 1:
                raise item.fault(f"{quoted(handle)} is given twice: one member counts once")
        for field, rule in group.fields.items():
            if rule.of is not None and group.handles and rule.of not in group.handles:
                raise entries(written["fields"])[field].fault(
                    f"{quoted(rule.of)} is not a member: {did_you_mean(rule.of, group.handles)}"
                )


def _items(given: dict[str, Node], section: str) -> list[Node]:
    node = given.get(section)
    return node.value if node is not None and isinstance(node.value, list) else []
