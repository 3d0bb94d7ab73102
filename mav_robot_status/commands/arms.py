"""`--arm TYPE:HOST[:PORT]`: an arm beside the vehicle, and the group of everything that is heard."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from typing import Final

from ..config import Config, GroupConfig, HardwareConfig
from ..errors import UsageError

TYPES: Final = ("ur", "simple_message")
"""The hardware interfaces that need nothing but an address."""
FORM: Final = f"{{{','.join(TYPES)}}}:HOST[:PORT]"
EXAMPLE: Final = "ur:192.168.1.30"
NAME: Final = "arm"
"""The handle of the first arm. The others are `arm2`, `arm3`, ..."""
GROUP: Final = "robot"
LAST_PORT: Final = 65535

_ADDRESS: Final = re.compile(r"(?:\[([0-9A-Fa-f:.]+(?:%[\w.-]+)?)\]|([\w.-]+))(?::([0-9]{1,5}))?", re.ASCII)


def with_arms(config: Config, texts: Sequence[str]) -> Config:
    """The configuration with these arms, and a group if it has none. Raises UsageError for a wrong text."""
    if not texts:
        return config
    interfaces = config.interfaces
    for text in texts:
        interfaces += (_interface(text, {interface.name for interface in interfaces} | _handles(config)),)
    if len(set(texts)) < len(texts):
        twice = next(text for text in texts if texts.count(text) > 1)
        raise UsageError(f"--arm {twice} is given twice: one arm has one handle")
    return dataclasses.replace(config, interfaces=interfaces, groups=config.groups or _group(config))


def _group(config: Config) -> dict[str, GroupConfig]:
    if GROUP in _handles(config) | {interface.name for interface in config.interfaces}:
        raise UsageError(
            f"--arm makes the group '{GROUP}', but a robot of the configuration has this handle: "
            "write the section 'groups' in the configuration"
        )
    return {GROUP: GroupConfig()}


def _handles(config: Config) -> set[str]:
    return {vehicle.handle for vehicle in config.vehicles} | set(config.groups)


def _interface(text: str, taken: set[str]) -> HardwareConfig:
    kind, colon, rest = text.partition(":")
    if kind not in TYPES or not colon:
        known = " and ".join(f"{one}:" for one in TYPES)
        raise UsageError(f"--arm {text}: the types of arms are {known}; write for example --arm {EXAMPLE}")
    found = _ADDRESS.fullmatch(rest)
    if found is None:
        raise UsageError(f"--arm {text}: {_fault(rest)}; write for example --arm {kind}:{_example(rest)}")
    options: dict[str, object] = {"host": found[1] or found[2]}
    if found[3] is not None:
        options["port"] = _port(text, int(found[3]))
    return HardwareConfig(kind, _free(taken), options, f"--arm {text}")


def _fault(rest: str) -> str:
    if not rest:
        return "has no host"
    return "an IPv6 address needs brackets" if _is_ipv6(rest) else "this is not HOST or HOST:PORT"


def _example(rest: str) -> str:
    return f"[{rest}]" if _is_ipv6(rest) else EXAMPLE.partition(":")[2]


def _is_ipv6(rest: str) -> bool:
    return rest.count(":") > 1 and re.fullmatch(r"[0-9A-Fa-f:.]+", rest) is not None


def _port(text: str, port: int) -> int:
    if not 1 <= port <= LAST_PORT:
        raise UsageError(f"--arm {text}: a port is a number from 1 to {LAST_PORT}, not {port}")
    return port


def _free(taken: set[str]) -> str:
    """The first free name of `arm`, `arm2`, `arm3`, ..."""
    number = 1
    while (name := NAME if number == 1 else f"{NAME}{number}") in taken:
        number += 1
    return name
