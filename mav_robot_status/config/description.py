"""What a configuration means, for `check-config`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

from ..hardware.mavlink.options import HardwareOptions
from ..interface import DEFAULT_HANDLE_NAME
from ..links import url
from .model import Config, ControllerConfig, GroupConfig, HardwareConfig, LinkConfig, SigningConfig, VehicleConfig
from .reader import OUR_TYPES


def describe(config: Config) -> list[str]:
    """What a configuration means, one line per part."""
    return [
        *(f"link: {_link(link)}" for link in config.links),
        *([] if config.links or config.interfaces else ["link: none in the file; give one on the command line"]),
        *(f"out: {_link(out)}" for out in config.outs),
        *(f"vehicle: {_vehicle(vehicle)}" for vehicle in config.vehicles),
        *([_EVERY_VEHICLE] if config.hears_mavlink and not config.vehicles else []),
        *(f"name: {_who(*ids)} is called '{name}'" for ids, name in config.names.items()),
        *(f"hardware: {_interface(interface)}" for interface in config.interfaces),
        *(f"group: {_group(name, group)}" for name, group in config.groups.items()),
        f"identity: {_identity(config)}",
        *_options(config.hardware),
        f"requests: {_REQUESTS[config.requests]}",
        *([f"signing: {_signing(config.signing)}"] if config.signing else []),
        *([f"coalesce: input gathers for {config.coalesce * 1000:g} ms before it is read"] if config.coalesce else []),
        *([f"max_gap: {_GAP % config.max_gap}"] if config.max_gap != Config().max_gap else []),
        *(["forward: every frame between the links and the outs"] if config.forward else []),
        *([f"record: everything received and sent, to {config.record}"] if config.record else []),
        *(f"controller {controller.name}: {_controller(controller)}" for controller in config.controllers),
        *([] if config.controllers else ["controller: the default one for each handle"]),
        *config.without_effect,
    ]


_EVERY_VEHICLE = "vehicle: every autopilot that is heard, each with a handle of its own"
_REQUESTS = {
    "missing": "messages that a status needs and that do not arrive",
    "none": "nothing is requested from the autopilot",
}
_UNSIGNED = {
    "none": "nothing is accepted unsigned",
    "radio_status": "nothing but RADIO_STATUS is accepted unsigned",
    "all": "everything is accepted unsigned, so nothing received is protected",
}
_GAP = "a longer silence of a log than %g s, after the link is lost, gives one line"
_ROBOT_STATUS = {None: (), True: ("ROBOT_STATUS is sent there",), False: ("ROBOT_STATUS is not sent there",)}


def _link(link: LinkConfig) -> str:
    timeout, limit = link.heartbeat_timeout, link.speech_limit
    notes = [
        *(["passive: nothing is sent there"] if link.passive else []),
        *_ROBOT_STATUS[link.robot_status],
        *(
            []
            if limit is None
            else [f"at most {limit:g} B/s are sent unasked" if limit else "no limit on what is sent"]
        ),
        *([] if timeout is None else [f"a vehicle there is lost after {timeout:g} s without a heartbeat"]),
    ]
    return url.parse(link.url).words() + (f" ({'; '.join(notes)})" if notes else "")


def _vehicle(vehicle: VehicleConfig) -> str:
    who = (
        f"system {vehicle.system}" if vehicle.system is not None else "the first system heard that no other entry names"
    )
    called = "" if vehicle.name is None else f", called '{vehicle.name}'"
    return f"{who}, {_which(vehicle.component)} -> handle '{vehicle.handle}'{called}"


def _who(system: int, component: int | None) -> str:
    return f"system {system}, {_which(component)}"


def _which(component: int | None) -> str:
    return "any autopilot component" if component is None else f"component {component}"


def _interface(interface: HardwareConfig) -> str:
    options = ", ".join(f"{key}: {_value(value)}" for key, value in interface.options.items()) or "no options"
    return f"'{interface.name}' of type {interface.type} ({options})"


def _group(name: str, group: GroupConfig) -> str:
    members = ", ".join(f"'{handle}'" for handle in group.handles) or "every handle"
    rules = [f"{field}: {rule.of or rule.logic.value}" for field, rule in group.fields.items()]
    return f"'{name}' of {members}" + (f" ({', '.join(rules)})" if rules else "")


def _identity(config: Config) -> str:
    identity = config.identity
    system = f"system {identity.system}" if identity.system is not None else "the vehicle's own system"
    heartbeat = "with" if identity.heartbeat else "without"
    return f"{system}, component {identity.component}, {heartbeat} a HEARTBEAT of its own"


def _signing(signing: SigningConfig) -> str:
    return (
        f"with the key in {signing.key_file}, link ids from {signing.link_id} on; {_UNSIGNED[signing.accept_unsigned]}"
    )


def _options(options: HardwareOptions) -> Iterator[str]:
    """The options that differ from their defaults."""
    default = HardwareOptions()
    for option in fields(options):
        value, usual = getattr(options, option.name), getattr(default, option.name)
        if value != usual:
            yield f"hardware: {option.name} = {_value(value)} (default {_value(usual)})"


def _value(value: object) -> str:
    if isinstance(value, dict):
        return (
            ", ".join(
                f"{key}: {{{_value(item)}}}" if isinstance(item, dict) else f"{key}: {_value(item)}"
                for key, item in value.items()
            )
            or "none"
        )
    if isinstance(value, frozenset):
        return ", ".join(sorted(value)) or "none"
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    return getattr(value, "name", None) or str(value)


def _controller(controller: ControllerConfig) -> str:
    if controller.type not in OUR_TYPES:
        return f"type {controller.type}, which checks its own parameters ({', '.join(controller.parameters) or 'none'})"
    rate = controller.parameters.get("publish_rate", 10)
    when = [f"at {rate} Hz"] if isinstance(rate, int | float) and rate > 0 else []
    when += ["on change"] if controller.parameters.get("publish_on_change", True) else []
    outputs = (
        "the default publisher" if controller.publishers is None else ", ".join(p.type for p in controller.publishers)
    )
    handle = controller.parameters.get("handle_name", DEFAULT_HANDLE_NAME)
    return f"handle '{handle}' {' and '.join(when) or 'never'} to {outputs or 'nobody'}"
