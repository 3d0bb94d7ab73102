"""What the command line says instead of the configuration."""

from __future__ import annotations

import dataclasses
from argparse import Namespace
from typing import Final

from ..config import Config, ControllerConfig, LinkConfig, PublisherConfig, SigningConfig, VehicleConfig
from ..config import load as load_config
from ..errors import UsageError
from ..interface import DEFAULT_HANDLE_NAME
from ..link.url import parse
from . import PROGRAM

OF_PAGE: Final = ("token_file", "open")
"""Options of `--http`."""
OF_BROKER: Final = ("user", "password_file", "ca", "cert", "key", "version", "keepalive")
"""Options of `--mqtt` that the board has too."""
OF_MQTT: Final = (*OF_BROKER, "robot", "spool")
OF_RUN: Final = (
    "out", "rate", "changes_only", "json", "format", "record", "forward",
    "http", *(f"http_{name}" for name in OF_PAGE), "mqtt", *(f"mqtt_{name}" for name in OF_MQTT),
)  # fmt: skip
"""Options that only `run` has of those that override the configuration."""


def loaded(options: Namespace) -> Config:
    """The configuration of the file; without one what is in force then. Raises ConfigError."""
    return load_config(options.config) if options.config else Config()


def configured(options: Namespace) -> Config:
    """The configuration of a command that needs connections, overridden. Raises UsageError if there are none."""
    config = overridden(loaded(options), options)
    if not config.links:
        asked = PROGRAM if options.command == "run" else f"{PROGRAM} {options.command}"
        raise UsageError(f"no connection given; write for example {asked} udp:127.0.0.1:14550")
    return config


def overridden(config: Config, options: Namespace) -> Config:
    """The configuration with what the command line says instead."""
    options = Namespace(**{**dict.fromkeys(OF_RUN), **vars(options)})
    if options.system is not None:
        config = only(config, options.system)
    return dataclasses.replace(
        config,
        links=_links(config, options),
        outs=_outs(config, options),
        controllers=_with_mqtt(with_page(_controllers(config, options), options), options),
        signing=_signing(config.signing, options.signing_key),
        record=config.record if options.record is None else options.record,
        forward=config.forward or bool(options.forward),
    )


def only(config: Config, system: int) -> Config:
    """The configuration for one vehicle; the controllers of the others are left out."""
    vehicles = tuple(v for v in config.vehicles if v.system == system) or (VehicleConfig(system=system),)
    others = {v.handle for v in config.vehicles} - {v.handle for v in vehicles}
    controllers = tuple(
        c for c in config.controllers if c.parameters.get("handle_name", DEFAULT_HANDLE_NAME) not in others
    )
    return dataclasses.replace(config, vehicles=vehicles, controllers=controllers)


def with_page(controllers: tuple[ControllerConfig, ...], options: Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the web page of the command line, instead of one in the configuration."""
    if options.http is None:
        _refuse("http", OF_PAGE, options, "is for a web page: add --http 127.0.0.1:8765")
        return controllers
    return _with(controllers, PublisherConfig("http", page_options(options)))


def page_options(options: Namespace) -> dict[str, object]:
    """The options of an http publisher, as the configuration writes them."""
    given = {name: getattr(options, f"http_{name}") for name in OF_PAGE}
    return {"listen": options.http, **{name: value for name, value in given.items() if value}}


def mqtt_options(options: Namespace, url: str, names: tuple[str, ...] = OF_MQTT) -> dict[str, object]:
    """The options of an mqtt publisher, as the configuration writes them."""
    given = {name: getattr(options, f"mqtt_{name}") for name in names}
    return {"url": url, **{name: value for name, value in given.items() if value is not None}}


def _links(config: Config, options: Namespace) -> tuple[LinkConfig, ...]:
    links = tuple(LinkConfig(url) for url in options.connections) or config.links
    if options.passive:
        links = tuple(dataclasses.replace(link, passive=True) for link in links)
    if options.baud is not None:
        links = tuple(dataclasses.replace(link, url=_with_baud(link.url, options.baud)) for link in links)
    return links


def _with_baud(url: str, baud: int) -> str:
    parsed = parse(url, baud)
    return f"{parsed.device},{parsed.baud}" if parsed.kind == "serial" else url


def _outs(config: Config, options: Namespace) -> tuple[LinkConfig, ...]:
    outs = tuple(LinkConfig(url) for url in options.out) if options.out else config.outs
    for out in outs:
        if parse(out.url).kind == "log":
            raise UsageError(f"{out.url!r} is a log, and an out is sent to: write one like udpout:192.168.1.20:14550")
    return outs


def _signing(section: SigningConfig | None, key_file: str | None) -> SigningConfig | None:
    if key_file is None:
        return section
    return SigningConfig(key_file) if section is None else dataclasses.replace(section, key_file=key_file)


def _controllers(config: Config, options: Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the command line's rate and JSON options; none if nothing differs from the default."""
    json_options: dict[str, object] = {}
    if options.json not in (None, "none"):
        json_options["path"] = options.json
    if options.format is not None:
        json_options["format"] = options.format
    if options.changes_only:
        json_options["changes_only"] = True
    rate = {} if options.rate is None else {"publish_rate": options.rate}
    if not (rate or json_options or options.json == "none"):
        return config.controllers
    from ..gateway.plant import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

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
                    if p.type != "json" or options.json != "none"
                ),
            )
        )
    if options.json not in (None, "none") and not any(p.type == "json" for c in changed for p in c.publishers or ()):
        asked = PublisherConfig("json", json_options)
        return tuple(dataclasses.replace(c, publishers=(asked, *(c.publishers or ()))) for c in changed)
    return tuple(changed)


def _with_mqtt(controllers: tuple[ControllerConfig, ...], options: Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the broker of the command line, instead of one in the configuration."""
    if options.mqtt is None:
        _refuse("mqtt", OF_MQTT, options, "is for a broker: add --mqtt mqtts://broker/prefix")
        return controllers
    return _with(controllers, PublisherConfig("mqtt", mqtt_options(options, options.mqtt)))


def _refuse(of: str, names: tuple[str, ...], options: Namespace, why: str) -> None:
    """An option of a publisher that is not asked for."""
    for name in names:
        if getattr(options, f"{of}_{name}"):
            raise UsageError(f"--{of}-{name.replace('_', '-')} {why}")


def _with(controllers: tuple[ControllerConfig, ...], asked: PublisherConfig) -> tuple[ControllerConfig, ...]:
    """The controllers with a publisher, instead of one of its type."""
    from ..gateway.plant import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

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
