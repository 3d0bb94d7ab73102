"""Makes an `EventTable` from the bytes of a file: JSON, or JSON in xz, as PX4 publishes them (`all_events.json.xz`).

The file may come from anybody: everything is bounded and checked before it is used. TableError is the only exception.
Source of the format: mavlink/libevents, validation/schema.json.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from struct import Struct
from types import MappingProxyType
from typing import Final

from ....json_object import JsonMapping
from .ids import component_name
from .table import ARGUMENT_BYTES, CODES, Definition, EventTable, Names
from .template import compiled

MOST_BYTES: Final = 1 << 20
"""Of the file."""
MOST_UNPACKED: Final = 8 << 20
"""Bytes of the JSON."""
MOST_MEMORY: Final = 80 << 20
"""Bytes that the decompression may use: xz with its strongest preset asks for 65 MiB."""
MOST_PARTS: Final = 300_000
"""Brackets, braces and commas of the JSON, which bound its values. PX4's table has 9000."""
MOST_EVENTS: Final = 5000
MOST_ENUMERATIONS: Final = 500
MOST_ENTRIES: Final = 1000
"""Of one enumeration, and of the modes of all groups."""
MOST_ARGUMENTS: Final = 40
MOST_DIGITS: Final = 20
MOST_NAME, MOST_MESSAGE = 200, 4000
"""Characters."""
MOST_GROUPS: Final = 64
"""Bits of a mask of mode groups."""
XZ: Final = b"\xfd7zXZ\x00"


class TableError(ValueError):
    """Bytes that are not a table of events. The message is one line."""


def parse(data: bytes) -> EventTable:
    """The table in the bytes of a file. Raises TableError."""
    if len(data) > MOST_BYTES:
        raise TableError(f"the table has {len(data)} bytes, the limit is {MOST_BYTES}")
    components = _entries(_mapping(_json(_unpacked(data)), "the table"), "components")
    numbered = [(_number(key, "a component"), _mapping(found, f"component {key}")) for key, found in components]
    names = _all_names(numbered)
    events = _all_events(numbered, names)
    if not events:
        raise TableError("the table has no event: give the file all_events.json or all_events.json.xz of PX4")
    groups = [pair for _, component in numbered for pair in _mode_groups(component)]
    if len(groups) > MOST_ENTRIES:
        raise TableError(f"the table has {len(groups)} modes in groups, the limit is {MOST_ENTRIES}")
    return EventTable(
        MappingProxyType(events),
        MappingProxyType(dict(groups)),
        MappingProxyType(_by_bit(names, "health_component_t")),
        MappingProxyType(_by_bit(names, "navigation_mode_group_t")),
    )


def _unpacked(data: bytes) -> bytes:
    """The JSON, from xz if it is packed."""
    if not data.startswith(XZ):
        return data
    try:
        import lzma  # a Python may be built without it
    except ImportError:
        raise TableError("this Python cannot read xz: give the table as JSON") from None
    unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ, MOST_MEMORY)
    try:
        unpacked = unpacker.decompress(data, MOST_UNPACKED + 1)
    except (lzma.LZMAError, EOFError, MemoryError) as error:
        raise TableError(f"the table is not valid xz: {error}") from None
    if len(unpacked) > MOST_UNPACKED:
        raise TableError(f"the table has more than {MOST_UNPACKED} bytes unpacked")
    if not unpacker.eof:
        raise TableError("the table ends in the middle of its xz data")
    return unpacked


def _json(data: bytes) -> object:
    """The document. Its size is checked before it is built."""
    if sum(data.count(part) for part in (b"{", b"[", b",")) > MOST_PARTS:
        raise TableError(f"the table has more than {MOST_PARTS} values")
    try:
        return json.loads(data.decode(), parse_int=_integer, parse_constant=_no_constant)
    except TableError:
        raise
    except RecursionError:
        raise TableError("the table is nested too deeply") from None
    except UnicodeDecodeError:
        raise TableError("the table is neither JSON in UTF-8 nor xz") from None
    except json.JSONDecodeError as error:
        raise TableError(f"the table is not JSON: {error.msg} in line {error.lineno}") from None


def _integer(digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        raise TableError(f"the table has a number of {len(digits)} digits")
    return int(digits)


def _no_constant(name: str) -> object:
    raise TableError(f"the table is not JSON: {name} is not a JSON number")


def _mapping(value: object, what: str) -> JsonMapping:
    if not isinstance(value, dict):
        raise TableError(f"{what} is not a mapping")
    return value


def _list(value: object, what: str) -> list[object]:
    if not isinstance(value, list):
        raise TableError(f"{what} is not a list")
    return value


def _entries(mapping: JsonMapping, key: str) -> Iterator[tuple[str, object]]:
    """The entries of a mapping in a mapping; none if it is absent."""
    return iter(_mapping(mapping.get(key, {}), f"'{key}'").items())


def _text(mapping: JsonMapping, key: str, most: int = MOST_NAME) -> str:
    """A text; empty if it is absent."""
    value = mapping.get(key, "")
    if not isinstance(value, str) or len(value) > most:
        raise TableError(f"'{key}' is not a text of at most {most} characters")
    return value


def _number(text: str, what: str) -> int:
    """A number that is a key."""
    if not (text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS):
        raise TableError(f"{what} must have a number as its key, not {text[:20]!r}")
    return int(text)


NamesOf = dict[tuple[str, str], tuple[str, Names]]
"""By name space and name: the type of an enumeration, and its words."""


def _all_names(components: list[tuple[int, JsonMapping]]) -> NamesOf:
    found: NamesOf = {}
    for _, component in components:
        space = _text(component, "namespace")
        for name, enumeration in _entries(component, "enums"):
            if len(found) >= MOST_ENUMERATIONS:
                raise TableError(f"the table has more than {MOST_ENUMERATIONS} enumerations")
            found[space, name] = _names(_mapping(enumeration, f"the enumeration {name[:50]!r}"))
    return found


def _names(enumeration: JsonMapping) -> tuple[str, Names]:
    kind = _text(enumeration, "type")
    if kind not in CODES or kind == "float":
        raise TableError(f"an enumeration has the type {kind[:20]!r}, which is not an integer")
    entries: dict[int, str] = {}
    for key, entry in _entries(enumeration, "entries"):
        fields = _mapping(entry, "an entry of an enumeration")
        entries[_number(key, "an entry of an enumeration")] = _words(fields)
    if len(entries) > MOST_ENTRIES:
        raise TableError(f"an enumeration has {len(entries)} entries, the limit is {MOST_ENTRIES}")
    return kind, Names(enumeration.get("is_bitfield") is True, MappingProxyType(entries))


def _words(entry: JsonMapping) -> str:
    """The description of an entry, else its name, in one line."""
    words = " ".join(_text(entry, "description").split()) or " ".join(_text(entry, "name").split())
    return "".join(c for c in words if c.isprintable())


def _all_events(components: list[tuple[int, JsonMapping]], names: NamesOf) -> dict[int, Definition]:
    found: dict[int, Definition] = {}
    for number, component in components:
        space = _text(component, "namespace")
        for group, content in _entries(component, "event_groups"):
            for key, event in _entries(_mapping(content, f"the group {group[:50]!r}"), "events"):
                if len(found) >= MOST_EVENTS:
                    raise TableError(f"the table has more than {MOST_EVENTS} events")
                fields = _mapping(event, f"the event {key[:20]}")
                identifier = (number & 0xFF) << 24 | _number(key, "an event") & 0xFFFFFF
                found[identifier] = _definition(fields, group, space, names)
    return found


def _definition(event: JsonMapping, group: str, space: str, names: NamesOf) -> Definition:
    arguments = _list(event.get("arguments", []), "'arguments'")
    if len(arguments) > MOST_ARGUMENTS:
        raise TableError(f"an event has {len(arguments)} arguments, the limit is {MOST_ARGUMENTS}")
    types = [_type(_text(_mapping(argument, "an argument"), "type"), space, names) for argument in arguments]
    return Definition(
        _text(event, "name"),
        group[:MOST_NAME],
        _text(event, "type") == "summary",
        _layout([code for code, _ in types]),
        tuple(enumeration for _, enumeration in types),
        compiled(_text(event, "message", MOST_MESSAGE), len(types)),
        compiled(_text(event, "description", MOST_MESSAGE), len(types)),
    )


def _type(name: str, space: str, names: NamesOf) -> tuple[str, Names | None]:
    """The `struct` code of an argument, and its enumeration: `px4::name`, or a name of the same name space."""
    if name in CODES:
        return CODES[name], None
    of_space, _, last = name.rpartition("::")
    found = names.get((of_space or space, last)) or names.get(("common", last))
    if found is None:
        raise TableError(f"an argument has the unknown type {name[:50]!r}")
    return CODES[found[0]], found[1]


def _layout(codes: list[str]) -> Struct:
    """The arguments that fit into an EVENT."""
    while Struct("<" + "".join(codes)).size > ARGUMENT_BYTES:
        codes.pop()
    return Struct("<" + "".join(codes))


def _mode_groups(component: JsonMapping) -> Iterator[tuple[int, int]]:
    """Each custom_mode with the number of its group."""
    section = _mapping(component.get("navigation_mode_groups", {}), "'navigation_mode_groups'")
    for key, modes in _entries(section, "groups"):
        group = _number(key, "a group of modes")
        if group >= MOST_GROUPS:
            raise TableError(f"a group of modes has the number {group}, the limit is {MOST_GROUPS - 1}")
        for mode in _list(modes, "a group of modes"):
            if type(mode) is not int or not 0 <= mode < 1 << 32:
                raise TableError("a group of modes has a custom_mode that is not a number of 32 bits")
            yield mode, group


def _by_bit(names: NamesOf, name: str) -> dict[int, str]:
    """The words of a bit field by the number of the bit, of any name space."""
    found = next((names_of for (_, last), (_, names_of) in names.items() if last == name), None)
    if found is None:
        return {}
    return {bit.bit_length() - 1: words or component_name(0) for bit, words in sorted(found.entries.items()) if bit}
