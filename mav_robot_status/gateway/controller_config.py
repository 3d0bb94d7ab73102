"""What a configuration means for controllers and publishers: the defaults and the checks. No I/O."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from ..config import ControllerConfig, PublisherConfig
from ..errors import ConfigError, UsageError
from ..interface import DEFAULT_HANDLE_NAME
from . import plugins
from .port_check import Taken, check_taken, of_links

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from ..config import Config, HardwareConfig
    from ..interface import Options

DEFAULT_PUBLISHERS: Final = (PublisherConfig("json"), PublisherConfig("mavlink"), PublisherConfig("mirror"))
_OF_VEHICLE: Final = re.compile(rf"{DEFAULT_HANDLE_NAME}/([1-9][0-9]{{0,2}})\.([1-9][0-9]{{0,2}})", re.ASCII)
DEFAULT_CONTROLLER: Final = ControllerConfig(
    "robot_status_controller", "mav_robot_status/IndustrialRobotStatusController", {}, "default"
)
"""Runs on every handle if the configuration names no controllers."""


def check(config: Config) -> None:
    """Raise ConfigError for an unknown controller, publisher or handle, and for an unknown option of a publisher.

    Raises UsageError for a port that is given twice.
    """
    for interface in config.interfaces:
        _check_options(plugins.load(plugins.HARDWARE, interface.type, interface.where), interface)
    for controller in config.controllers:
        plugins.load(plugins.CONTROLLERS, controller.type, controller.where)
        for publisher in publishers_of(controller):
            _check_publisher(publisher, publisher.where or controller.where)
    check_taken([*of_links(config), *_of_publishers(config)])
    if not config.interfaces:  # other hardware interfaces register their handles when they open
        check_handles(config, ())


def _of_publishers(config: Config) -> Iterator[Taken]:
    """The TCP ports of publishers that say where they listen. Controllers share equal publishers."""
    every = {
        publisher_key(one): (one, controller.where)
        for controller in config.controllers
        for one in publishers_of(controller)
    }
    for publisher, where in every.values():
        listens_on = getattr(plugins.load(plugins.PUBLISHERS, publisher.type, where), "listens_on", None)
        if listens_on is not None:
            host, port = listens_on(publisher.options)
            if port:
                yield Taken("tcp", host, port, "", f"{publisher.type} {host}:{port}")


def check_handles(config: Config, registered: Iterable[str]) -> None:
    """Raise ConfigError for a controller of a handle that is not registered."""
    expected = [v.handle for v in config.vehicles] or ([DEFAULT_HANDLE_NAME] if config.hears_mavlink else [])
    handles = list(dict.fromkeys([*expected, *config.groups, *registered]))
    _check_members(config, handles)
    for controller in config.controllers:
        name = handle_name(controller)
        if name not in handles and not is_default(controller) and not _may_appear(name, config):
            there_are = f"there is no handle '{name}'; registered: " + ", ".join(f"'{h}'" for h in handles)
            hint = "" if config.vehicles or config.interfaces else f". Write `vehicles: [{{handle: {name}}}]`"
            raise ConfigError(f"{controller.where}: {there_are}{hint}{' to register it' if hint else ''}")


def _check_members(config: Config, handles: Iterable[str]) -> None:
    """Raise ConfigError for a group with a member that no robot can register."""
    for name, group in config.groups.items():
        for member in group.handles:
            if member not in handles and not _may_appear(member, config):
                there_are = ", ".join(f"'{handle}'" for handle in handles if handle not in config.groups)
                raise ConfigError(f"group '{name}': there is no handle '{member}'; registered: {there_are}")


def _may_appear(name: str, config: Config) -> bool:
    """Whether a vehicle with a handle of this name may be heard. Vehicle 1.1 has the default name."""
    ids = _OF_VEHICLE.fullmatch(name) if config.hears_mavlink and not config.vehicles else None
    return ids is not None and all(1 <= int(one) <= 255 for one in ids.groups()) and ids.groups() != ("1", "1")


def _check_publisher(publisher: PublisherConfig, where: str) -> None:
    _check_options(plugins.load(plugins.PUBLISHERS, publisher.type, where), publisher)


def _check_options(made: object, part: PublisherConfig | HardwareConfig) -> None:
    """Let a class check its options, if it can. The error gives the place in the file."""
    options_type: type[Options] | None = getattr(made, "options_type", None)
    check_options: Callable[[Mapping[str, object]], object] | None = getattr(made, "check_options", None)
    try:
        if options_type is not None:
            options_type.read(part.type, part.options)
        if check_options is not None:
            check_options(part.options)
    except UsageError as error:
        raise ConfigError(f"{part.where}: {error}") if part.where else error from None


def handle_name(controller: ControllerConfig) -> str:
    """The handle that a controller of the configuration reads."""
    return str(controller.parameters.get("handle_name", DEFAULT_HANDLE_NAME))


def is_default(controller: ControllerConfig) -> bool:
    """True for the default controller, also with options of the command line. Each handle gets its own."""
    return controller.where == DEFAULT_CONTROLLER.where


def publishers_of(controller: ControllerConfig) -> tuple[PublisherConfig, ...]:
    """The publishers that a controller of the configuration names, or the default ones."""
    return DEFAULT_PUBLISHERS if controller.publishers is None else controller.publishers


def is_durable(publisher: PublisherConfig, where: str) -> bool:
    """Whether a publisher stores each change before `publish` returns."""
    return plugins.declares(plugins.load(plugins.PUBLISHERS, publisher.type, where), "durable")


def is_live_only(publisher: PublisherConfig, where: str) -> bool:
    """Whether a replay runs without a publisher."""
    return plugins.declares(plugins.load(plugins.PUBLISHERS, publisher.type, where), "live_only")


def has_no_durable_publisher(controller: ControllerConfig) -> bool:
    """The sort key of controllers: those with a durable publisher run first."""
    return not any(is_durable(publisher, controller.where) for publisher in publishers_of(controller))


def publishes(config: Config, kind: str) -> bool:
    """Whether a controller of this configuration has a publisher of this type."""
    controllers = config.controllers or (DEFAULT_CONTROLLER,)
    return any(publisher.type == kind for controller in controllers for publisher in publishers_of(controller))


def publisher_key(config: PublisherConfig) -> tuple[str, str]:
    """Controllers share a publisher: there is one for each type and set of options."""
    return config.type, repr(sorted(config.options.items()))
