"""The table of events: what each event of a firmware means, in words. `parsing` makes it of a file.

Everything here is a frozen value, made of checked parts: decoding an event never fails.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from struct import Struct
from typing import TYPE_CHECKING, Final, NamedTuple

from .ids import CHECK, SUMMARY, component_name
from .template import Template, filled

if TYPE_CHECKING:
    from ....mavlink.definitions import Event

ARGUMENT_BYTES: Final = 40
"""The bytes of an EVENT's arguments. Arguments of a definition that lie beyond them do not arrive."""
CODES: Final = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
}
"""The types of arguments, as `struct` names them."""
MOST_DESCRIPTION: Final = 1000
"""Characters of a filled description."""
CHECK_GROUPS: Final = frozenset({"arming_check", "health"})
"""The groups of the events in a report of the arming checks."""

Value = int | float | str | None


class Names(NamedTuple):
    """An enumeration: the words for its values."""

    is_bitfield: bool
    entries: Mapping[int, str]

    def of(self, value: int) -> str:
        """The words for a value; those of all its bits, if it is a bit field."""
        if not self.is_bitfield:
            return self.entries.get(value, str(value))
        bits = [1 << i for i in range(value.bit_length()) if value >> i & 1] if value > 0 else []
        return "|".join(self.entries.get(bit, str(bit)) for bit in bits) or "none"


class Definition(NamedTuple):
    """One event of the table."""

    name: str
    group: str
    is_summary: bool
    layout: Struct
    """The arguments that fit into an EVENT."""
    names: tuple[Names | None, ...]
    """The enumeration of each argument; None for a number. Also of those that do not fit."""
    message: Template
    description: Template

    @property
    def is_check(self) -> bool:
        """Whether it is a failing check of a report."""
        return self.group in CHECK_GROUPS and not self.is_summary

    def numbers(self, raw: bytes) -> tuple[int | float, ...]:
        """The arguments as numbers."""
        return self.layout.unpack_from(raw.ljust(ARGUMENT_BYTES, b"\0"))

    def values(self, raw: bytes) -> tuple[Value, ...]:
        """The arguments: numbers, and the words of enumerations. None for one that did not fit."""
        numbers = self.numbers(raw)
        known = tuple(
            value if names is None or isinstance(value, float) else names.of(value)
            for value, names in zip(numbers, self.names, strict=False)
        )
        return known + (None,) * (len(self.names) - len(known))


@dataclass(frozen=True, slots=True)
class EventTable:
    """The events of one firmware."""

    events: Mapping[int, Definition]
    """By event id."""
    mode_groups: Mapping[int, int]
    """The mode group of a custom_mode, as the number of its bit."""
    components: Mapping[int, str]
    """The words for a health component, by its index."""
    groups: Mapping[int, str]
    """The words for a mode group, by its bit."""

    def message(self, event: Event) -> str | None:
        """What an event says; None if the table lacks it."""
        found = self.events.get(event.id)
        return None if found is None else filled(found.message, found.values(event.arguments)) or None

    def description(self, event: Event) -> str | None:
        """What a person can do about it; None if the table does not say it."""
        found = self.events.get(event.id)
        if found is None:
            return None
        return filled(found.description, found.values(event.arguments), MOST_DESCRIPTION) or None

    def modes_of(self, mask: int) -> tuple[str, ...]:
        """The words for the mode groups in a mask."""
        return tuple(name for bit, name in self.groups.items() if mask >> bit & 1)


def component_words(table: EventTable | None, index: int) -> str:
    """The words for a health component: the table's, else its name."""
    return component_name(index) if table is None else table.components.get(index, component_name(index))


def summary_numbers(table: EventTable | None, event: Event) -> tuple[int, ...]:
    """The arguments of a summary. A table gives the widths of its version; without one they are those of 1.14."""
    found = None if table is None else table.events.get(event.id)
    numbers = SUMMARY.unpack_from(event.arguments.ljust(ARGUMENT_BYTES, b"\0"))
    if found is not None and len(given := found.numbers(event.arguments)) >= 4:
        numbers = given
    return tuple(int(n) for n in numbers) if all(isinstance(n, int) for n in numbers) else (0, 0, 0, 0, 0)


def check_numbers(table: EventTable | None, event: Event) -> tuple[int, int]:
    """The mask of mode groups and the index of the health component of a failing check."""
    found = None if table is None else table.events.get(event.id)
    if found is not None:
        given = found.numbers(event.arguments)
        if len(given) >= 2 and isinstance(given[0], int) and isinstance(given[1], int):
            return given[0], given[1]
    modes, component = CHECK.unpack_from(event.arguments.ljust(ARGUMENT_BYTES, b"\0"))
    return modes, component
