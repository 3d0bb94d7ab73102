"""DataFlash logs of ArduPilot (.bin): records that the log itself describes with its FMT records. No meaning.

A record is 0xA3 0x95, its type, and values without padding. It counts only if another record follows it: what a full
or slow card has damaged begins like a record, too.
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Final, NamedTuple

from .record import LIFE_US, SIGN_OF_LIFE, Clock, Counts, Record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from .record import Value

HEAD: Final = b"\xa3\x95"
HEAD_SIZE: Final = 3
FMT: Final = 128
CODES: Final = {
    "a": "64s", "b": "b", "B": "B", "c": "h", "C": "H", "d": "d", "e": "i", "E": "I", "f": "f", "g": "e", "h": "h",
    "H": "H", "i": "i", "I": "I", "L": "i", "M": "B", "n": "4s", "N": "16s", "q": "q", "Q": "Q", "Z": "64s",
}  # fmt: skip
"""The types of values, as `struct` names them."""
FACTORS: Final = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
TEXTS: Final = frozenset("nNZ")
INSTANCES: Final = frozenset({"I", "C", "Inst", "Instance"})
"""The names of a second column that numbers the sensors. Only the first sensor is read."""
TIMES: Final = {("TimeUS", "Q"): 1, ("TimeMS", "I"): 1000}
"""The first column with its type, and microseconds of its unit."""


class Form(NamedTuple):
    """One kind of record."""

    name: str
    length: int
    """Bytes, with the head."""
    layout: Struct | None
    """None if a type of value is not known: then only its length is."""
    types: str
    columns: tuple[str, ...]
    time: Struct | None
    """The layout of its time; None if it has none."""
    unit_us: int
    is_numbered: bool
    """Whether its second column numbers the sensors."""
    wanted: bool
    every_us: int
    """The least time between two records that are given."""


def form_of(name: str, length: int, types: str, columns: str, wanted: Mapping[str, float]) -> Form:
    """The form that a FMT record describes."""
    names = tuple(columns.split(",")) if columns else ()
    try:
        layout: Struct | None = Struct("<" + "".join(CODES[code] for code in types))
    except KeyError:
        layout = None
    if layout is not None and (layout.size + HEAD_SIZE != length or len(names) != len(types)):
        layout = None
    unit = TIMES.get((names[0], types[0]), 0) if names and types else 0
    numbered = bool(unit) and len(names) > 1 and names[1] in INSTANCES and types[1:2] == "B"
    every = round(wanted.get(name, 0.0) * 1e6)
    time = Struct("<" + CODES[types[0]]) if unit else None
    return Form(name, length, layout, types, names, time, unit, numbered, name in wanted, every)


class DataFlashReader:
    """Reads a log in blocks."""

    def __init__(self, wanted: Mapping[str, float]) -> None:
        """`wanted`: the least seconds between two records of a name that are given; 0 gives all."""
        self.counts = Counts()
        self._wanted = wanted
        self._forms: list[Form | None] = [None] * 256
        self._forms[FMT] = form_of("FMT", 89, "BBnNZ", "Type,Length,Name,Format,Columns", {"FMT": 0})
        self._rest = b""
        self._clock = Clock()
        self._due = [0] * 256
        """When the next record of a type is given."""
        self._life_due = 0

    @property
    def pending(self) -> int:
        """Bytes of an incomplete record."""
        return len(self._rest)

    def names(self) -> frozenset[str]:
        """The kinds of records that the log announces."""
        return frozenset(form.name for form in self._forms if form is not None)

    def feed(self, data: bytes) -> Sequence[Record]:
        """The wanted records that are complete."""
        data = self._rest + data if self._rest else data
        out: list[Record] = []
        forms, position, end = self._forms, 0, len(data)
        while position + HEAD_SIZE <= end:
            form = forms[data[position + 2]] if data[position] == 0xA3 and data[position + 1] == 0x95 else None
            if form is not None:
                after = position + form.length
                if after + 2 > end:
                    break
                if data[after] == 0xA3 and data[after + 1] == 0x95:
                    self._take(form, data, position, out)
                    position = after
                    continue
            position = self._skip(data, position)
        self._rest = data[position:]
        return out

    def finish(self) -> Sequence[Record]:
        """The last record, if it is complete."""
        out: list[Record] = []
        rest, self._rest = self._rest, b""
        form = self._forms[rest[2]] if len(rest) >= HEAD_SIZE and rest.startswith(HEAD) else None
        if form is not None and len(rest) == form.length:
            self._take(form, rest, 0, out)
        else:
            self.counts.bad_bytes += len(rest)
        return out + self._clock.finish()

    def _skip(self, data: bytes, position: int) -> int:
        """Where the next record may begin."""
        found = data.find(HEAD, position + 1)
        if found < 0:
            found = len(data) - 1 if data[-1] == HEAD[0] and len(data) - 1 > position else len(data)
        self.counts.bad_bytes += found - position
        return found

    def _take(self, form: Form, data: bytes, position: int, out: list[Record]) -> None:
        self.counts.records += 1
        kind = data[position + 2]
        us = form.time.unpack_from(data, position + HEAD_SIZE)[0] * form.unit_us if form.time is not None else None
        latest = self._clock.us
        if us is None:
            if form.wanted or kind == FMT:
                self._give(form, data, position, latest or 0, out)
            return
        if latest is not None and latest <= us < self._life_due and (not form.wanted or us < self._due[kind]):
            return
        if form.wanted and (us >= self._due[kind] or (latest is not None and us < latest - form.every_us)):
            if form.is_numbered and data[position + HEAD_SIZE + 8]:
                return
            self._give(form, data, position, us, out)
            self._due[kind] = (self._clock.us or us) + form.every_us
        elif us >= self._life_due or latest is None or us < latest:
            self._clock.take(Record(us, SIGN_OF_LIFE, {}), out)
        self._life_due = (self._clock.us or 0) + LIFE_US

    def _give(self, form: Form, data: bytes, position: int, us: int, out: list[Record]) -> None:
        if form.layout is None:
            return
        values = dict(zip(form.columns, _values(form, data, position), strict=True))
        if data[position + 2] == FMT:
            self._define(values)
        elif form.time is None:
            out.append(Record(us, form.name, values))
        else:
            self._clock.take(Record(us, form.name, values), out)

    def _define(self, values: Mapping[str, Value]) -> None:
        """A FMT record. The first definition of a type counts."""
        kind, length = values["Type"], values["Length"]
        if isinstance(kind, int) and isinstance(length, int) and length >= HEAD_SIZE and self._forms[kind] is None:
            name, types, columns = (str(values[key]) for key in ("Name", "Format", "Columns"))
            self._forms[kind] = form_of(name, length, types, columns, self._wanted)


def _values(form: Form, data: bytes, position: int) -> Iterable[Value]:
    if form.layout is None:
        return
    for code, value in zip(form.types, form.layout.unpack_from(data, position + HEAD_SIZE), strict=True):
        if code in FACTORS:
            yield value * FACTORS[code]
        elif code in TEXTS:
            yield text(value)
        else:
            yield value if code != "a" else 0


def text(raw: bytes) -> str:
    """A text that ends at the first NUL."""
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
