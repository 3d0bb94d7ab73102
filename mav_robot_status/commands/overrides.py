"""The command line overrides the configuration."""

from __future__ import annotations

import dataclasses
import logging
from argparse import Namespace
from collections.abc import Sequence
from typing import Final

from ..config import Config, ControllerConfig, LinkConfig, PublisherConfig, SigningConfig, VehicleConfig
from ..config import load as load_config
from ..config.model import NO_EFFECT
from ..errors import UsageError
from ..interface import DEFAULT_HANDLE_NAME
from ..links.url import parse
from ..publishers.json_lines import JsonOptions
from . import PROGRAM
from .arms import with_arms
from .options import WITH_ARGUMENTS, given, value_of

log = logging.getLogger(__name__)

BESIDE_MAVLINK: Final = ("run", "watch", "explain", "doctor")
"""Commands that need no connection if the configuration has a hardware interface other than MAVLink."""


def loaded(options: Namespace) -> Config:
    """The configuration of the file, or the default one, with names and PX4's table of events. Raises ConfigError.

    The log names what has no effect any more.
    """
    config = load_config(options.config) if options.config else Config()
    old = [NO_EFFECT["kernel_filter"].format("--no-kernel-filter")] if value_of(options, "--no-kernel-filter") else []
    for line in (*config.without_effect, *old):
        log.warning("%s", line)
    if names := value_of(options, "--name"):
        config = dataclasses.replace(config, names={**config.names, **_once(names)})
    table = value_of(options, "--px4-events")
    if table is None:
        return config
    return dataclasses.replace(config, hardware=dataclasses.replace(config.hardware, px4_events=table))


def _once(names: Sequence[tuple[tuple[int, int | None], str]]) -> dict[tuple[int, int | None], str]:
    """The names of the command line by ids. Raises UsageError if a vehicle has two."""
    found = dict(names)
    for (system, component), name in names:
        if found[system, component] != name:
            who = f"{system}" if component is None else f"{system}.{component}"
            raise UsageError(f"--name {who}= is given twice: one vehicle has one name")
    return found


def configured(options: Namespace) -> Config:
    """The configuration of a command that needs connections, overridden. Raises UsageError if there are none."""
    config = with_arms(overridden(loaded(options), options), value_of(options, "--arm") or ())
    asks_ros2 = options.command == "doctor" and options.ros2 is not None
    if not config.links and not asks_ros2 and not (config.interfaces and options.command in BESIDE_MAVLINK):
        asked = PROGRAM if options.command == "run" else f"{PROGRAM} {options.command}"
        raise UsageError(f"no connection given; write for example {asked} udp:127.0.0.1:14550")
    return config


def overridden(config: Config, options: Namespace) -> Config:
    """The configuration with the options of the command line."""
    if options.system is not None:
        config = only(config, options.system)
    controllers = _controllers(config, options)
    for kind in sorted(WITH_ARGUMENTS):
        controllers = with_publisher(kind, controllers, options)
    record = value_of(options, "--record")
    max_gap = value_of(options, "--max-gap")
    return dataclasses.replace(
        config,
        links=_links(config, options),
        outs=_outs(config, options),
        controllers=controllers,
        signing=_signing(config.signing, options.signing_key),
        record=config.record if record is None else record,
        max_gap=config.max_gap if max_gap is None else max_gap,
        forward=config.forward or bool(value_of(options, "--forward")),
    )


def only(config: Config, system: int) -> Config:
    """The configuration for one vehicle; the controllers of the others are left out."""
    vehicles = tuple(v for v in config.vehicles if v.system == system) or (VehicleConfig(system=system),)
    others = {v.handle for v in config.vehicles} - {v.handle for v in vehicles}
    controllers = tuple(
        c for c in config.controllers if c.parameters.get("handle_name", DEFAULT_HANDLE_NAME) not in others
    )
    return dataclasses.replace(config, vehicles=vehicles, controllers=controllers)


def with_publisher(
    kind: str, controllers: tuple[ControllerConfig, ...], options: Namespace
) -> tuple[ControllerConfig, ...]:
    """The controllers with the publisher of the command line, which replaces those of its type.

    The first flag of its options enables it. Raises UsageError if another of its flags is given without the first.
    """
    declaration = WITH_ARGUMENTS[kind]
    first, *others = (one.option for one in declaration.declared() if one.option.flag is not None)
    asked = given(options, declaration)
    if value_of(options, str(first.flag)) is not None:
        return _with(controllers, PublisherConfig(kind, asked))
    for option in others:
        if value_of(options, str(option.flag)):
            raise UsageError(f"{option.flag} needs {first.flag} {first.metavar}: {first.help}")
    return controllers


def _links(config: Config, options: Namespace) -> tuple[LinkConfig, ...]:
    links = tuple(LinkConfig(url) for url in options.connections) or config.links
    if options.passive:
        links = tuple(dataclasses.replace(link, passive=True) for link in links)
    if options.baud is not None:
        links = tuple(dataclasses.replace(link, url=_with_baud(link.url, options.baud)) for link in links)
    return links


def _with_baud(url: str, baud: int) -> str:
    parsed = parse(url, baud)
    return f"{parsed.device},{parsed.baud}" if parsed.kind.is_serial else url


def _outs(config: Config, options: Namespace) -> tuple[LinkConfig, ...]:
    urls = value_of(options, "--out")
    outs = tuple(LinkConfig(url) for url in urls) if urls else config.outs
    for out in outs:
        if parse(out.url).kind.is_log:
            raise UsageError(f"{out.url!r} is a log, and an out needs a receiver: write udpout:192.168.1.20:14550")
    return outs


def _signing(section: SigningConfig | None, key_file: str | None) -> SigningConfig | None:
    if key_file is None:
        return section
    return SigningConfig(key_file) if section is None else dataclasses.replace(section, key_file=key_file)


def _controllers(config: Config, options: Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the rate and the JSON options of the command line."""
    json_options = given(options, JsonOptions)
    path = json_options.get("path")
    if path == "none":
        del json_options["path"]
    hertz = value_of(options, "--rate")
    rate = {} if hertz is None else {"publish_rate": hertz}
    if not (rate or json_options or path == "none"):
        return config.controllers
    from ..gateway.controller_config import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

    changed = []
    for controller in config.controllers or (DEFAULT_CONTROLLER,):
        publishers = controller.publishers if controller.publishers is not None else DEFAULT_PUBLISHERS
        changed.append(
            dataclasses.replace(
                controller,
                parameters={**controller.parameters, **rate},
                publishers=tuple(
                    PublisherConfig(p.type, {**p.options, **json_options}) if p.type == "json" else p
                    for p in publishers
                    if p.type != "json" or path != "none"
                ),
            )
        )
    if path not in (None, "none") and not any(p.type == "json" for c in changed for p in c.publishers or ()):
        asked = PublisherConfig("json", json_options)
        return tuple(dataclasses.replace(c, publishers=(asked, *(c.publishers or ()))) for c in changed)
    return tuple(changed)


def _with(controllers: tuple[ControllerConfig, ...], asked: PublisherConfig) -> tuple[ControllerConfig, ...]:
    """The controllers with a publisher that replaces those of its type."""
    from ..gateway.controller_config import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

    return tuple(
        dataclasses.replace(
            c,
            publishers=(
                *(p for p in (DEFAULT_PUBLISHERS if c.publishers is None else c.publishers) if p.type != asked.type),
                asked,
            ),
        )
        for c in controllers or (DEFAULT_CONTROLLER,)
    )
