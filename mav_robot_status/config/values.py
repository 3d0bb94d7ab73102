"""Converts a node of the file to a checked value of a type: `read(int, node)`, `read(LinkConfig, node)`.

The types are those of the fields in `model` and `hardware.options`, so a new option needs no change here. A new kind
of value is one small function and one line in a table.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping
from enum import EnumMeta
from typing import Annotated, Any, Final, Literal, cast, get_args, get_origin, get_type_hints

from ..errors import ConfigError, UsageError
from ..hardware.group import Rule
from ..hardware.join import Logic
from ..hardware.mavlink.autopilots import mode_numbers
from ..hardware.mavlink.options import CustomMode, ModeOverrides, OneOf, Or, Within
from ..interface import RobotMode
from ..links import url
from ..links.senders import sender
from .document import Node, quoted, short
from .model import LONGEST_NAME, LinkConfig, PublisherConfig, VehicleName, is_vehicle_name

MAX_TEXT: Final = 1000
"""Characters of a name or a connection string."""
FROM: Final = "from"
"""The key of a link with the addresses that it hears. They become a part of `LinkConfig.url`."""
_SECONDS: Final = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?(ms|s)", re.ASCII)


def read(hint: Any, node: Node) -> Any:
    """The node as a value of that type. Raises ConfigError with the place, the fault and the remedy."""
    if hint in _KINDS:
        return _KINDS[hint](node)
    if dataclasses.is_dataclass(hint):
        return read_fields(hint, node)
    if isinstance(hint, EnumMeta):
        return hint[_one_of(node.text, hint.__members__, node)]
    return _GENERIC[get_origin(hint)](hint, node)


def read_fields(cls: Any, node: Node) -> Any:
    """A mapping as a dataclass. A missing key gets the default of its field."""
    hints = get_type_hints(cls, include_extras=True)
    given = entries(node, hints)
    for field in dataclasses.fields(cls):
        if field.name not in given and field.default is field.default_factory:  # both are MISSING
            raise node.fault(f"{node.name} has no '{field.name}', and must have one")
    return cls(**{key: read(hints[key], value) for key, value in given.items()})


def entries(node: Node, known: Iterable[str] | None = None) -> dict[str, Node]:
    """The entries of a mapping; none for an empty value. Refuses unknown keys."""
    if node.value is None:
        return {}
    if not isinstance(node.value, dict):
        keys = f" with the keys {', '.join(known)}" if known else ""
        raise node.fault(f"{node.name} must be a mapping{keys}, not {node.shown()}")
    for key, value in node.value.items():
        if known is not None and key not in known:
            raise value.key_fault(f"{node.name} has no key {quoted(key)}: {did_you_mean(key, known)}")
    return node.value


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The nearest of the known words, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(short(word), known, 1)
    return f"did you mean '{near[0]}'?" if near else f"it is one of: {', '.join(known)}"


def must_be(what: str, node: Node) -> ConfigError:
    """The error for a value that is not what it must be."""
    return node.fault(f"{node.name} must be {what}, not {node.shown()}")


def _one_of(word: str, known: Iterable[str], node: Node) -> str:
    known = list(known)
    if word not in known:
        raise node.fault(f"{node.name} cannot be {node.shown()}: {did_you_mean(word, known)}")
    return word


def _bool(node: Node) -> bool:
    if not isinstance(node.value, bool):
        raise must_be("true or false", node)
    return node.value


def _text(node: Node) -> str:
    if not isinstance(node.value, str):
        raise must_be("a text (in quotes if it looks like something else)", node)
    if not 0 < len(node.value) <= MAX_TEXT or not node.value.isprintable():
        raise node.fault(f"{node.name} must be a text of one line, 1 to {MAX_TEXT} characters")
    return node.value


def _vehicle_name(node: Node) -> str:
    if isinstance(node.value, str) and not is_vehicle_name(node.value):
        raise node.fault(f"{node.name} must be a text of 1 to {LONGEST_NAME} printable characters")
    return _text(node)


def _number(kind: type[int | float], node: Node, within: Within | None = None, word: Or | None = None) -> int | float:
    value: Any = _seconds(node.value) if within and within.unit == "s" else node.value
    if type(value) in (int, kind) and math.isfinite(value) and (not within or within.low <= value <= within.high):
        return kind(value)
    what = "a whole number" if kind is int else "a number"
    lowest = f"from {within.low:.10g} to" if within and within.low > -math.inf else "of at most"
    bounds = f" {lowest} {within.high:.10g} {within.unit}".rstrip() if within else ""
    raise must_be(what + bounds + (f" or '{word.word}'" if word else ""), node)


def _seconds(value: object) -> object:
    """`10 ms` and `3.5 s` as seconds; anything else as it is."""
    match = _SECONDS.fullmatch(value) if isinstance(value, str) else None
    return float(match[1]) / (1000 if match[2] == "ms" else 1) if match else value


def _annotated(hint: Any, node: Node) -> Any:
    base, *rules = get_args(hint)
    by_type = {type(rule): rule for rule in rules}
    if (word := by_type.get(Or)) is not None:
        # `base` is `kind | None`; the file writes the word for None
        if node.text == word.word:
            return None
        base = next(kind for kind in get_args(base) if kind is not type(None))
    if (names := by_type.get(OneOf)) is not None:
        return _one_of(node.text, names.names, node)
    if dataclasses.is_dataclass(base):
        return read_fields(base, node)
    if base in (bool, str, VehicleName):
        return _KINDS[base](node)
    return _number(base, node, by_type.get(Within), word)


def _literal(hint: Any, node: Node) -> str:
    # compare the text: YAML reads `false` as a bool
    return _one_of(node.text, get_args(hint), node)


def _list(hint: Any, node: Node) -> Any:
    if node.value is None:
        return get_origin(hint)()
    if not isinstance(node.value, list):
        raise must_be("a list ('- ' before each item, or [in brackets])", node)
    return get_origin(hint)(read(get_args(hint)[0], item) for item in node.value)


def _mapping(hint: Any, node: Node) -> dict[Any, Any]:
    key_hint, value_hint = get_args(hint)
    return {read(key_hint, value.key or value): read(value_hint, value) for value in entries(node).values()}


def _link(node: Node) -> LinkConfig:
    given = node.value if isinstance(node.value, dict) else {"url": node}
    if "url" not in given:
        raise node.fault(f"{node.name} has no 'url': write a connection like udp:127.0.0.1:14550, or {{url: ...}}")
    entries(node._replace(value=given), (*get_type_hints(LinkConfig), FROM))
    text = _text(given["url"])
    _check_url(text, given["url"])
    plain = {key: value for key, value in given.items() if key != FROM}
    link: LinkConfig = read_fields(LinkConfig, node._replace(value=plain))
    return dataclasses.replace(link, url=_with_senders(text, given[FROM])) if FROM in given else link


def _check_url(text: str, node: Node) -> None:
    try:
        url.parse(text)
    except UsageError as error:
        raise node.fault(str(error)) from None


def _with_senders(text: str, node: Node) -> str:
    """The connection string with the addresses of the list `from`."""
    if not (senders := _list(tuple[str, ...], node)):
        raise node.fault("from names nobody: write the addresses that are heard, or remove it")
    for one, item in zip(senders, cast("list[Node]", node.value), strict=True):
        try:
            sender(one)
        except UsageError as error:
            raise item.fault(str(error)) from None
    if "?" in text:
        raise node.key_fault("the url names its senders already: write them there or here")
    text = f"{text}?{FROM}={','.join(senders)}"
    _check_url(text, node)
    return text


def _publisher(node: Node) -> PublisherConfig:
    given = dict(node.value) if isinstance(node.value, dict) else {"type": node}
    if "type" not in given:
        raise node.fault(f"{node.name} has no 'type': write a publisher's name, or {{type: ..., with its options}}")
    name = _text(given.pop("type"))
    return PublisherConfig(name, {key: option.plain() for key, option in given.items()}, node.at)


def _rule(node: Node) -> Rule:
    """A rule of a group: `any`, `all`, or `{of: HANDLE}`."""
    if isinstance(node.value, dict):
        given = entries(node, ("of",))
        if "of" not in given:
            raise node.fault(f"{node.name} has no 'of': write {{of: HANDLE}}, any or all")
        return Rule(Logic.ANY, _text(given["of"]))
    return Rule(Logic(_one_of(node.text, [logic.value for logic in Logic], node)))


def _mode_overrides(node: Node) -> dict[int, RobotMode]:
    """The modes to publish, by custom_mode. The key of the node is the vehicle family, which gives the mode names."""
    family = node.key.text if node.key else ""
    known = mode_numbers(family)
    found: dict[int, RobotMode] = {}
    for name, value in entries(node).items():
        key = value.key or value
        number = known.get(name.upper())
        if number is None and not isinstance(key.value, int):
            raise key.fault(_no_mode(family, key, known))
        number = read(CustomMode, key) if number is None else number
        if number in found:
            raise key.fault(f"mode {number} of {family} is given twice, as {quoted(name)} and with another name")
        found[number] = read(RobotMode, value)
    return found


def _no_mode(family: str, key: Node, known: Mapping[str, int]) -> str:
    if not known:
        return f"the modes of {quoted(family)} have no names here: write the number, custom_mode, not {key.shown()}"
    return f"{family} has no mode {key.shown()} (a name or a custom_mode): {did_you_mean(key.text.upper(), known)}"


_KINDS: Final[dict[Any, Callable[[Node], Any]]] = {
    bool: _bool,
    str: _text,
    VehicleName: _vehicle_name,
    ModeOverrides: _mode_overrides,
    float: lambda node: _number(float, node),
    LinkConfig: _link,
    Rule: _rule,
    PublisherConfig: _publisher,
}
_GENERIC: Final[dict[Any, Callable[[Any, Node], Any]]] = {
    Annotated: _annotated,
    Literal: _literal,
    tuple: _list,
    frozenset: _list,
    Mapping: _mapping,
}
