"""DataFlash logs of ArduPilot in their text form (.log): a line for each record, its values separated by commas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .dataflash import TIMES
from .record import Clock, Counts, Record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .record import Value

HEAD: Final = b"FMT,"
OLD_TIMES: Final = {("T", "I"): 1000}
"""The last column of GPS up to Copter 3.1, whose other records have no time: they have that of the last one."""
LONGEST: Final = 4096
"""Bytes of a line. A longer one is no record."""
TEXTS: Final = frozenset("nNZ")


class TextReader:
    """Reads a log in blocks."""

    def __init__(self, wanted: Mapping[str, float]) -> None:
        """`wanted`: the least seconds between two records of a name that are given; 0 gives all."""
        self.counts = Counts()
        self._wanted = wanted
        self._forms: dict[str, tuple[str, tuple[str, ...]]] = {}
        """Types and columns by the name of a record."""
        self._due: dict[str, int] = {}
        self._clock = Clock()
        self._rest = b""

    @property
    def pending(self) -> int:
        """Bytes of an incomplete record."""
        return len(self._rest)

    def names(self) -> frozenset[str]:
        """The kinds of records that the log announces."""
        return frozenset(self._forms)

    def feed(self, data: bytes) -> Sequence[Record]:
        """The wanted records that are complete."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST:
            self.counts.bad_bytes += len(self._rest)
            self._rest = b""
        out: list[Record] = []
        for line in lines:
            self._line(line, out)
        return out

    def finish(self) -> Sequence[Record]:
        """The last line."""
        out: list[Record] = []
        self._line(self._rest, out)
        self._rest = b""
        return out + self._clock.finish()

    def _line(self, line: bytes, out: list[Record]) -> None:
        name, *values = (part.strip() for part in line.decode("utf-8", "replace").split(","))
        if name == "FMT" and len(values) > 4 and len(self._forms) < 256:
            self._forms[values[2]] = values[3], tuple(values[4:])
        elif name in self._forms:
            self._record(name, values, out)
        elif line.strip():
            self.counts.bad_bytes += len(line)

    def _record(self, name: str, values: list[str], out: list[Record]) -> None:
        types, columns = self._forms[name]
        if len(values) > len(columns) > 0 and types.endswith("Z"):  # a text may hold commas
            values[len(columns) - 1 :] = [", ".join(values[len(columns) - 1 :])]
        unit, at = (TIMES.get((columns[0], types[:1]), 0), 0) if columns else (0, 0)
        if not unit and columns and (columns[-1], types[-1:]) in OLD_TIMES:
            unit, at = OLD_TIMES[columns[-1], types[-1:]], -1
        try:
            found = {label: _value(code, one) for label, code, one in zip(columns, types, values, strict=True)}
            us = int(values[at]) * unit if unit else self._clock.us or 0
        except ValueError:
            self.counts.bad_bytes += sum(map(len, values))
            return
        self.counts.records += 1
        if name not in self._wanted or us < self._due.get(name, 0) or found.get("I") or found.get("C"):
            return
        if unit or self._clock.us is None:
            self._clock.take(Record(us, name, found), out)
        else:
            out.append(Record(us, name, found))
        self._due[name] = (self._clock.us or us) + round(self._wanted[name] * 1e6)


def _value(code: str, raw: str) -> Value:
    if code in TEXTS or code == "a":
        return raw
    if code == "M" and not raw.isdigit():
        return raw  # the name of a mode
    return float(raw) if code in "fdgcCeEL" else int(raw)
