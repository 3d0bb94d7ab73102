"""The records of an onboard log, each with its time: `.bin` and `.log` of ArduPilot, `.ulg` of PX4."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Final, NamedTuple

from ...clock import Instant, rfc3339
from ...errors import UsageError
from ...hardware.onboard_log import ardupilot, ardupilot_motion, px4
from ...hardware.onboard_log.dataflash import DataFlashReader
from ...hardware.onboard_log.dataflash_text import TextReader
from ...hardware.onboard_log.interface import OnboardLogRobotHW
from ...hardware.onboard_log.ulog import MAGIC, ULogReader
from ...interface import DEFAULT_HANDLE_NAME
from ...links.log import LATEST, LogReader

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from ...config import Config
    from ...hardware.mavlink.options import HardwareOptions
    from ...hardware.onboard_log.interface import Meaning
    from ...hardware.onboard_log.record import Counts, Reader, Record, Value
    from ...links.log import Stamped

log = logging.getLogger(__name__)

FIRST_DATAFLASH: Final = b"\xa3\x95\x80\x80\x59FMT\0"
"""The record that describes itself, near the start of each DataFlash log."""
FIRST_TEXT: Final = b"FMT, 128, 89, FMT"
OLDEST_US: Final = 946_684_800_000_000  # 2000


class Form(NamedTuple):
    """A form of onboard logs."""

    words: str
    reader: Callable[[Mapping[str, float]], Reader]
    meaning: Callable[[HardwareOptions], Meaning]
    scanned: Mapping[str, float]
    """The records that tell the time in UTC and the system id, with the least seconds between two."""
    utc_us: Callable[[Mapping[str, Value]], int | None]
    """The time in such a record, microseconds since 1970."""


def _px4_utc(values: Mapping[str, Value]) -> int | None:
    found = values.get("time_utc_usec")
    return found if isinstance(found, int) and OLDEST_US < found < LATEST else None


_ARDUPILOT: Final = (ardupilot.ArduPilotMeaning, {"GPS": 1.0, "PARM": 0.0}, ardupilot_motion.utc_us)
DATAFLASH: Final = Form("DataFlash log", DataFlashReader, *_ARDUPILOT)
DATAFLASH_TEXT: Final = Form("DataFlash log as text", TextReader, *_ARDUPILOT)
ULOG: Final = Form(
    "ULog file",
    ULogReader,
    px4.Px4Meaning,
    {"vehicle_gps_position": 1.0, "sensor_gps": 1.0, "vehicle_status": 1.0, "parameter": 0.0},
    _px4_utc,
)


def form_of(head: bytes) -> Form | None:
    """The form of a log by its first bytes; None: it is no onboard log. The name of a file says nothing."""
    if head.startswith(MAGIC):
        return ULOG
    if head.startswith(b"\xa3\x95") or FIRST_DATAFLASH in head:
        return DATAFLASH
    return DATAFLASH_TEXT if FIRST_TEXT in head.replace(b",", b", ").replace(b"  ", b" ") else None


class Preview(NamedTuple):
    """What a first look at the log tells."""

    boot_unix_us: int
    """UTC at the start of the autopilot, microseconds since 1970."""
    clock: str
    """How that is known, in words."""
    system: int | None


class OnboardRecording:
    """One log. Iterate once: each wanted record with its time; the last record is None."""

    def __init__(self, reader: LogReader, form: Form) -> None:
        """`reader` has read the head. Raises UsageError for a pipe: the log is looked at twice."""
        if reader.is_pipe:
            raise UsageError(f"{reader.path} is a pipe, and an onboard log is read twice: write it to a file first")
        self.path = reader.path
        self.form = form
        self.seconds = 0.0
        """The length of the log."""
        self.first_us = 0
        """The time of the first record, microseconds since the start of the autopilot."""
        self._reader = reader
        self.preview = self._look()
        self._records: Reader = form.reader({})
        self._hw: OnboardLogRobotHW | None = None

    @property
    def robot(self) -> OnboardLogRobotHW:
        """The robot that `hardware` has made."""
        if self._hw is None:
            raise RuntimeError("call `hardware` first")
        return self._hw

    @property
    def counts(self) -> Counts:
        """What the reader has found so far."""
        return self._records.counts

    @property
    def trouble(self) -> str | None:
        """Why the log ended early."""
        return self._reader.trouble

    @property
    def share(self) -> float:
        """The fraction of the log that was read, from 0 to 1."""
        return self._reader.share

    def hardware(self, config: Config) -> OnboardLogRobotHW:
        """The robot of this log. Raises UsageError if the configuration names other ones only."""
        system = self.preview.system or 1
        expected = [v for v in config.vehicles if v.system in (None, system)]
        if config.vehicles and not expected:
            systems = ", ".join(str(v.system) for v in config.vehicles)
            raise UsageError(f"{self.path} is the log of system {system}, and system {systems} is expected")
        name = expected[0].name if expected else None
        handle = DEFAULT_HANDLE_NAME if system == 1 else f"{DEFAULT_HANDLE_NAME}/{system}.1"
        handle = expected[0].handle if expected else handle
        options = config.hardware
        hw = OnboardLogRobotHW(
            lambda: self.form.meaning(options), handle, options, name or config.names.get((system, None))
        )
        self._hw = hw
        log.info("%s: a %s; the stamps are UTC %s", self.path, self.form.words, self.preview.clock)
        return hw

    def __iter__(self) -> Iterator[Stamped]:
        """Raises UsageError at the end if the log held no record."""
        hw = self.robot
        self._records = self.form.reader(hw.meaning.wanted())
        boot, started, last, mono = self.preview.boot_unix_us, 0.0, None, 0.0
        now = Instant(0.0, 0)
        for record in self._all(self._reader, self._records):
            new = last is not None and record.us < last
            if last is None:
                self.first_us = record.us
                started = -record.us / 1e6
            elif new:  # the autopilot has started anew: time goes on where it was
                started = mono - record.us / 1e6
                boot += last - record.us
            last, mono = record.us, started + record.us / 1e6
            now = Instant(mono, boot + record.us)
            hw.begun(started, self._records.names())
            yield now, record, new
        if last is None:
            raise self._empty()
        self.seconds = mono
        yield now, None, False

    def summary(self) -> str:
        """One line for the user: the number of records, and the faults that occurred."""
        counts = self._records.counts
        found = (
            (counts.dropouts, "dropouts noted by the autopilot"),
            (0 if self._hw is None else self._hw.gaps, "gaps of more than 1 s"),
            (counts.bad_bytes, "bytes that belong to no record"),
        )
        total = f"{self.path}: {counts.records} records"
        told = [total, *(f"{number} {what}" for number, what in found if number)]
        return ", ".join(told + ([self._reader.trouble] if self._reader.trouble else []))

    def _all(self, source: LogReader, reader: Reader) -> Iterator[Record]:
        for block in source.blocks():
            yield from reader.feed(block)
            if isinstance(reader, ULogReader) and reader.refused:
                raise UsageError(f"{self.path} cannot be read: {reader.refused}")
        yield from reader.finish()

    def _look(self) -> Preview:
        """Read until UTC and system id are known; else the whole log."""
        form, system, last = self.form, None, None
        records = form.reader(form.scanned)
        for record in self._all(LogReader(self.path), records):
            last = record.us
            name, value = record.values.get("Name", record.values.get("name")), record.values.get("value")
            if name in ("SYSID_THISMAV", "MAV_SYSID", "MAV_SYS_ID"):
                value = record.values.get("Value", value)
                system = int(value) if isinstance(value, int | float) and 1 <= value <= 255 else system
            elif (utc := form.utc_us(record.values)) is not None:
                return Preview(utc - record.us, "by its GPS", system)
        if last is None:
            raise self._empty()
        end = round(os.stat(self.path).st_mtime * 1e6)
        return Preview(end - last, f"if the log ended when its file was last changed ({rfc3339(end)})", system)

    def _empty(self) -> UsageError:
        return UsageError(f"{self.path} is no {self.form.words} that can be read: no record in it")
