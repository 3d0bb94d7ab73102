"""Raw captures: MAVLink without time stamps, as the .tlog.raw of MAVProxy. The clock of the autopilot gives the times.

SYSTEM_TIME, ATTITUDE and other messages tell the milliseconds since the autopilot has started (`time_boot_ms`), and
SYSTEM_TIME the time in UTC, if the autopilot knows it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...hardware.mavlink.identity import is_autopilot
from ...links.log import LATEST, SMALL_STEP_US
from ...mavlink.definitions import CRC_EXTRA, Heartbeat, SystemTime
from ...mavlink.framing import STAMP_SIZE, Parser

if TYPE_CHECKING:
    from ...mavlink.framing import Frame

FIRST_FRAMES: Final = 1 << 14
"""Bytes at the start of a file that show whether time stamps precede the frames."""


def is_raw(head: bytes) -> bool:
    """Whether these first bytes of a file hold MAVLink frames, and most of them without a time stamp before them."""
    head = head[:FIRST_FRAMES]
    position = plain = stamped = 0
    for frame in Parser(None).feed(head):
        position = head.index(frame.raw, position)
        stamp = int.from_bytes(head[max(0, position - STAMP_SIZE) : position], "big")
        if frame.message_id in CRC_EXTRA:
            if position >= STAMP_SIZE and stamp < LATEST:
                stamped += 1
            else:
                plain += 1
        position += len(frame.raw)
    return plain > stamped


class AutopilotClock:
    """Dates frames by the clock of the first autopilot that sends a heartbeat.

    A frame without a time has the time before it. Without UTC the time is that since the start of the autopilot. After
    a restart of the autopilot, time continues from where it was.
    """

    def __init__(self, head: bytes) -> None:
        """`head` are the first bytes of the capture."""
        self.stamp = 0
        """Microseconds since 1970 (or since the start of the autopilot) of the last frame."""
        self._ids: tuple[int, int] | None = None
        self._start = 0
        """The stamp at which the autopilot started."""
        frames = Parser(CRC_EXTRA).feed(head)
        for frame in frames:
            if isinstance(frame.message, Heartbeat) and is_autopilot(frame.message, frame.ids[1]):
                self._ids = frame.ids
                break
        times = [f.message for f in frames if f.ids == self._ids and isinstance(f.message, SystemTime)]
        told = next((t for t in times if 0 < t.time_unix_usec < LATEST), None)
        if told is not None:
            self._start = told.time_unix_usec - told.time_boot_ms * 1000
        boots = (getattr(f.message, "time_boot_ms", 0) for f in frames if f.ids == self._ids)
        self.stamp = self._start + next(filter(None, boots), 0) * 1000

    def stamped(self, frame: Frame) -> Frame:
        """The frame with its time."""
        boot_ms = getattr(frame.message, "time_boot_ms", None) if frame.ids == self._ids else None
        if boot_ms:
            stamp = self._start + boot_ms * 1000
            if stamp < self.stamp - SMALL_STEP_US:
                self._start += self.stamp - stamp
                stamp = self.stamp
            self.stamp = max(self.stamp, stamp)
        return frame._replace(stamp=self.stamp)
