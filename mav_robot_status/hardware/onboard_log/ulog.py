"""ULog files of PX4 (.ulg): messages that the log itself describes with its format definitions. No meaning.

Specification: docs.px4.io, "ULog File Format". A message is its size, its type, and its bytes. Topics become records
of their name; `L` becomes the record `message`, `P` the record `parameter`, `I` the record `information`.
"""

from __future__ import annotations

import re
from struct import Struct
from typing import TYPE_CHECKING, Final, NamedTuple

from .record import LIFE_US, SIGN_OF_LIFE, Clock, Counts, Record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .record import Value

MAGIC: Final = b"ULog\x01\x12\x35"
HEADER_SIZE: Final = 16
HEAD: Final = Struct("<HB")
SYNC: Final = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12"
"""A message of synchronisation."""
DEFINITIONS: Final = rb"..F[a-z]\w+:|..A...[a-z]\w{3}"
"""How the definition of a format and a subscription begin, as a regular expression."""
CODES: Final = {
    "int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q",
    "uint64_t": "Q", "float": "f", "double": "d", "bool": "?", "char": "s",
}  # fmt: skip
"""The types of values, as `struct` names them."""
DEPTH: Final = 6
"""How deep formats may be nested."""
MOST: Final = 4096
"""The limit of formats, and of the values of one format."""
TIME: Final = Struct("<Q")
DATA, DROPOUT, LOGGING, TAGGED = (ord(letter) for letter in "DOLC")
LONGEST: Final = {
    **dict.fromkeys(b"ORS", 8), **dict.fromkeys(b"LCAPQB", 1024), **dict.fromkeys(b"FIMD", 65535)
}  # fmt: skip
"""The most bytes of a message, by its type."""
_ARRAY: Final = re.compile(r"(\w+)(?:\[(\d{1,4})\])?")


class Topic(NamedTuple):
    """A subscription: one instance of a topic."""

    name: str
    instance: int
    size: int
    """Bytes of its data, at least."""
    layout: Struct
    members: tuple[tuple[str, int], ...]
    """Names with the number of their values; 0: a single one."""
    every_us: int
    """The least time between two records that are given."""


class ULogReader:
    """Reads a log in blocks."""

    def __init__(self, wanted: Mapping[str, float]) -> None:
        """`wanted`: the least seconds between two records of a topic that are given; 0 gives all."""
        self.counts = Counts()
        self.refused: str | None = None
        """Why the log cannot be read."""
        self._wanted = wanted
        self._formats: dict[str, str] = {}
        self._topics: dict[int, Topic | None] = {}
        """By their number in the log. None: not wanted."""
        self._sizes: dict[int, range] = {}
        """The bytes of the data of each topic."""
        self._names: set[str] = set()
        self._begins: re.Pattern[bytes] | None = None
        """How messages begin; None: to be made."""
        self._due: dict[int, int] = {}
        self._life_due = 0
        self._clock = Clock()
        self._rest = b""
        self._begun = False

    @property
    def pending(self) -> int:
        """Bytes of an incomplete record."""
        return len(self._rest)

    def names(self) -> frozenset[str]:
        """The topics that the log announces."""
        return frozenset(self._names)

    def feed(self, data: bytes) -> Sequence[Record]:
        """The wanted records that are complete."""
        data = self._rest + data if self._rest else data
        out: list[Record] = []
        position = 0
        if not self._begun:
            if len(data) < HEADER_SIZE:
                self._rest = data
                return out
            self._begun, position = True, HEADER_SIZE
            self._clock.us = TIME.unpack_from(data, 8)[0]
        end, head = len(data), HEAD.unpack_from
        while position + 3 <= end:
            size, kind = head(data, position)
            after = position + 3 + size
            if not 0 < size <= LONGEST.get(kind, 0) or (kind == DATA and not self._fits(data, position, size)):
                position = self._skip(data, position)
                continue
            if after + 3 > end:
                break
            if data[after + 2] in LONGEST:
                self._take(kind, data, position + 3, size, out)
                position = after
            else:
                position = self._skip(data, position)
        self._rest = data[position:]
        return out

    def finish(self) -> Sequence[Record]:
        """The last message, if it is complete."""
        out: list[Record] = []
        rest, self._rest = self._rest, b""
        if len(rest) >= 3 and len(rest) == 3 + HEAD.unpack_from(rest)[0]:
            self._take(rest[2], rest, 3, len(rest) - 3, out)
        else:
            self.counts.bad_bytes += len(rest)
        return out + self._clock.finish()

    def _fits(self, data: bytes, position: int, size: int) -> bool:
        """Whether this may be the data of a topic."""
        if position + 5 > len(data):
            return True
        return size - 2 in self._sizes.get(data[position + 3] | data[position + 4] << 8, ())

    def _skip(self, data: bytes, position: int) -> int:
        """Where the next message may begin: a definition, a synchronisation, or the data of a topic."""
        last = max(position + 1, len(data) - 4)
        is_empty = not data[position:].strip(b"\0")  # a file that was cut off by a loss of power ends in zeros
        found = None if is_empty else self._pattern().search(data, position + 1)
        after = found.start() if found else last
        self.counts.bad_bytes += after - position
        return after

    def _pattern(self) -> re.Pattern[bytes]:
        if self._begins is None:
            known = [
                (sizes[-1] + 2).to_bytes(3, "little")[:2] + b"D" + number.to_bytes(2, "little")
                for number, sizes in self._sizes.items()
            ] + [
                (sizes[0] + 2).to_bytes(3, "little")[:2] + b"D" + number.to_bytes(2, "little")
                for number, sizes in self._sizes.items()
            ]
            fixed = b"|".join(re.escape(one) for one in dict.fromkeys([SYNC, *known]))
            self._begins = re.compile(fixed + b"|" + DEFINITIONS, re.DOTALL)
        return self._begins

    def _take(self, kind: int, data: bytes, start: int, size: int, out: list[Record]) -> None:
        self.counts.records += 1
        if kind == DATA:
            self._data(data, start, size, out)
        elif kind == DROPOUT:
            self.counts.dropouts += 1
        elif kind in (LOGGING, TAGGED):
            self._logged(data[start : start + size], 1 if kind == LOGGING else 3, out)
        else:
            self._describe(chr(kind), data[start : start + size], out)

    def _data(self, data: bytes, start: int, size: int, out: list[Record]) -> None:
        if size < 10:
            return
        number = data[start] | data[start + 1] << 8
        if number not in self._topics:
            return
        topic = self._topics[number]
        us = TIME.unpack_from(data, start + 2)[0]
        latest = self._clock.us
        if topic is None or us < self._due.get(number, 0):
            if us >= self._life_due or latest is None:
                self._clock.take(Record(us, SIGN_OF_LIFE, {}), out)
                self._life_due = (self._clock.us or 0) + LIFE_US
            return
        if size - 2 < topic.size:
            return
        values = topic.layout.unpack_from(data[start + 2 : start + size].ljust(topic.layout.size, b"\0"))
        self._clock.take(Record(us, topic.name, {**_members(topic.members, values), "instance": topic.instance}), out)
        self._due[number] = (self._clock.us or us) + topic.every_us
        self._life_due = (self._clock.us or 0) + LIFE_US
        if latest is not None and (self._clock.us or 0) < latest:
            self._due.clear()

    def _logged(self, body: bytes, before: int, out: list[Record]) -> None:
        if len(body) < before + 8:
            return
        text = body[before + 8 :].decode("utf-8", "replace")
        values: dict[str, Value] = {"level": body[0] & 7, "text": text}
        self._clock.take(Record(TIME.unpack_from(body, before)[0], "message", values), out)

    def _describe(self, kind: str, body: bytes, out: list[Record]) -> None:
        """A definition."""
        if kind == "F":
            name, _, members = body.decode("utf-8", "replace").partition(":")
            if len(self._formats) < MOST:
                self._formats.setdefault(name, members)
        elif kind == "A" and len(body) > 3:
            self._subscribe(body[0], body[1] | body[2] << 8, body[3:].decode("utf-8", "replace"))
        elif kind == "B" and len(body) >= 16 and any((body[8] & 0xFE, *body[9:16])):
            self.refused = "it uses a part of the format that is not known"
        elif kind in "IP" and body and len(body) > 1 + body[0]:
            self._value(kind, body[1 : 1 + body[0]].decode("utf-8", "replace"), body[1 + body[0] :], out)

    def _value(self, kind: str, key: str, raw: bytes, out: list[Record]) -> None:
        """A parameter or an information: `float NAME` with its value."""
        kind_of, _, name = key.partition(" ")
        found = _ARRAY.fullmatch(kind_of)
        code = CODES.get(found[1]) if found else None
        if code is None or len(raw) > MOST:
            return
        value: Value = raw.decode("utf-8", "replace")
        if code != "s":
            layout = Struct("<" + code)
            if len(raw) < layout.size:
                return
            value = layout.unpack_from(raw)[0]
        what = "parameter" if kind == "P" else "information"
        out.append(Record(self._clock.us or 0, what, {"name": name, "value": value}))

    def _subscribe(self, instance: int, number: int, name: str) -> None:
        self._names.add(name)
        self._begins = None
        self._topics[number], self._sizes[number] = None, range(1 << 16)
        members = self._flat(name, "", DEPTH)
        if not members or len(members) > MOST or members[0] != ("timestamp", "Q", 0):
            return
        layout = _layout(members)
        shown = tuple((member, 0 if code == "s" else count) for member, code, count in members)
        padded = members
        while padded and padded[-1][0].startswith("_padding"):
            padded = padded[:-1]
        size = _layout(padded).size
        self._sizes[number] = range(size, layout.size + 1)
        if name not in self._wanted:
            return
        self._topics[number] = Topic(name, instance, size, layout, shown, round(self._wanted[name] * 1e6))

    def _flat(self, name: str, prefix: str, depth: int) -> list[tuple[str, str, int]]:
        """The members of a format with those of nested ones; empty if a format is not known or too large."""
        found: list[tuple[str, str, int]] = []
        if not depth:
            return found
        for member in filter(None, self._formats.get(name, "").split(";")):
            kind, _, label = member.partition(" ")
            parsed = _ARRAY.fullmatch(kind)
            if parsed is None:
                return []
            count = int(parsed[2] or 0)
            if parsed[1] in CODES:
                found.append((prefix + label, CODES[parsed[1]], count))
                continue
            for index in range(count or 1):
                inner = self._flat(parsed[1], f"{prefix}{label}{f'[{index}]' if count else ''}.", depth - 1)
                if not inner or len(found) > MOST:
                    return []
                found += inner
        return found


def _layout(members: Sequence[tuple[str, str, int]]) -> Struct:
    return Struct("<" + "".join(f"{count or ''}{code}" for _, code, count in members))


def _members(members: Sequence[tuple[str, int]], values: Sequence[int | float | bytes]) -> dict[str, Value]:
    """The values by their names; several of one name as a tuple."""
    found: dict[str, Value] = {}
    position = 0
    for name, count in members:
        piece = values[position : position + (count or 1)]
        position += count or 1
        plain = tuple(
            one.split(b"\0", 1)[0].decode("utf-8", "replace") if isinstance(one, bytes) else one for one in piece
        )
        found[name] = plain if count else plain[0]  # type: ignore[assignment]
    return found
