"""`TableDownload`: gets the table of PX4's events from a vehicle: the general file, then the file that this names."""

from __future__ import annotations

import math
from typing import Final

from .download import Download, Failure
from .metadata import MOST_GENERAL, MOST_GENERAL_TEXT, MOST_TABLE, Place, has_crc, place, table_place
from .payload import Payload

STEP: Final = 1000
"""How far the sequence numbers of two files are apart: a late answer about the first is not taken for the second."""


class TableDownload:
    """One table. Call `due` and `heard` as for a `Download`, until `ended`.

    `uri` and `crc` are those of COMPONENT_METADATA, `component` is the component that sent it. A hop to another
    component is not supported: PX4's files are on the autopilot.
    """

    def __init__(self, uri: str, crc: int, component: int, *, rate: float, now: float) -> None:
        self.outcome: bytes | Failure | None = None
        """The file of the table, or why there is none. None: not known yet."""
        self._component = component
        self._rate = rate
        self._file: Download | None = None
        self._place: Place | None = None
        self._is_table = False
        self._free_at = now
        self._open(place(uri, crc or None), 0, now)

    @property
    def ended(self) -> bool:
        """Whether nothing is sent any more."""
        return self._file is None or (self.outcome is not None and self._file.ended)

    @property
    def progress(self) -> tuple[int, int]:
        """The bytes of the table received so far, and its size; 0 if it is not known yet."""
        return self._file.progress if self._file is not None and self._is_table else (0, 0)

    def next_due(self) -> float:
        """When `due` has something to do."""
        return math.inf if self.ended or self._file is None else self._file.next_due()

    def due(self, now: float) -> Payload | None:
        """The request to send at `now`, if any."""
        file = self._file
        if file is None:
            return None
        request = file.due(now)
        self._settle(file, now)
        return request

    def heard(self, answer: Payload, now: float) -> None:
        """Process one answer of the vehicle's server."""
        file = self._file
        if file is not None:
            file.heard(answer, now)
            self._settle(file, now)

    def _settle(self, file: Download, now: float) -> None:
        """Note the outcome of the present file, and open the next one when its session is closed."""
        if self.outcome is not None or file.outcome is None or self._place is None:
            return
        if isinstance(file.outcome, Failure):
            self.outcome = Failure(f"{self._place.path}: {file.outcome.reason}")
        elif not has_crc(file.outcome, self._place.crc, MOST_TABLE if self._is_table else MOST_GENERAL_TEXT):
            self.outcome = Failure(f"{self._place.path}: its checksum is wrong")
        elif self._is_table:
            self.outcome = file.outcome
        elif file.ended:
            self._is_table = True
            self._open(table_place(file.outcome), file.sequence + STEP & 0xFFFF, now)

    def _open(self, found: Place | Failure, sequence: int, now: float) -> None:
        if isinstance(found, Failure):
            self.outcome = found
        elif found.component not in (None, self._component):
            self.outcome = Failure(f"it is on component {found.component}, and only the autopilot is asked")
        else:
            most = MOST_TABLE if self._is_table else MOST_GENERAL
            self._place = found
            self._file = Download(found.path, rate=self._rate, now=now, most=most, sequence=sequence)
