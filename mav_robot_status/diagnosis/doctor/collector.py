"""Collects the frames of one connection and summarizes them. Input: bytes and times. Output: findings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

from ...clock import Instant
from ...gateway.observer import Observer
from ...hardware.mavlink.estop.applet import is_word, value_of
from ...hardware.mavlink.identity import is_autopilot
from ...hardware.mavlink.satellite.state import stated
from ...links.base import Address
from ...mavlink import definitions as mav
from ...mavlink.counters import Counters
from ...mavlink.counters import count as add
from ...mavlink.framing import Frame, Parser
from ...mavlink.wire import V1
from .findings import HEARTBEAT, AppletReport, Findings, Speaker, VehicleStatus

HEAD: Final = 4096
"""Number of first bytes that are kept, to recognise other protocols."""
MOST_SOURCES: Final = 64
"""Addresses with a parser of their own. All others share one."""
MOST_SPEAKERS: Final = 256
YEAR_2020_US: Final = 1_577_836_800_000_000
"""Earlier times are invalid: a vehicle without GPS starts at 1970."""


class Collector(Observer):
    """Collects the input of one connection. Bounded for any input."""

    def __init__(self) -> None:
        self._parsers: dict[Address, Parser] = {}
        self._components: dict[tuple[int, int], _Component] = {}
        self._good: dict[int, int] = {}
        self.head = b""
        self.size = 0

    def on_data(self, data: bytes, source: Address, now: Instant) -> None:
        """Process bytes from one address."""
        self.size += len(data)
        if len(self.head) < HEAD:
            self.head += data[: HEAD - len(self.head)]
        if source not in self._parsers and len(self._parsers) >= MOST_SOURCES:
            source = None
        if source not in self._parsers:
            self._parsers[source] = Parser(None)
        for frame in self._parsers[source].feed(data):
            self.take(frame, now)

    def take(self, frame: Frame, now: Instant) -> None:
        """Process one frame, with its `raw` bytes."""
        if frame.message_id not in mav.CRC_EXTRA:
            return  # its CRC is not checked, so its header may be noise
        add(self._good, frame.message_id)
        ids = frame.ids
        sender = self._components.get(ids)
        if sender is None:
            if len(self._components) >= MOST_SPEAKERS:
                return
            sender = self._components[ids] = _Component()
        sender.take(frame, now)

    def has_heartbeat(self) -> bool:
        """Whether a heartbeat of an autopilot was received."""
        return any(sender.pilot for sender in self._components.values())

    def findings(
        self, base: Findings, statuses: Mapping[tuple[int, int], VehicleStatus], counters: Counters | None = None
    ) -> Findings:
        """`base` with the input so far. `statuses`: the vehicles that have a handle, by their ids."""
        if counters is None:
            counters = Counters()
            for parser in self._parsers.values():
                counters.add(parser.counters)
        return dataclasses.replace(
            base,
            size=self.size,
            head=self.head,
            counters=counters,
            good=dict(self._good),
            sources=tuple(f"{s[0]}:{s[1]}" for s in self._parsers if isinstance(s, tuple)),
            speakers=tuple(v.speaker(ids, statuses.get(ids)) for ids, v in sorted(self._components.items())),
        )


class _Component:
    """The input from one component."""

    __slots__ = (
        "_applet",
        "_clock_off",
        "_last_frame",
        "_times",
        "frames",
        "heartbeat",
        "pilot",
        "v1",
    )

    def __init__(self) -> None:
        self.frames = self.v1 = 0
        self._times: dict[int, tuple[int, float, float]] = {}
        """By message id: count, time of the first and of the last. Bounded by the list of known ids."""
        self.heartbeat: mav.Heartbeat | None = None
        self.pilot = False
        """Whether one of its heartbeats is a vehicle's."""
        self._clock_off: float | None = None
        self._applet: tuple[int, float] | None = None
        """The last report of the applet, and when it came."""
        self._last_frame = 0.0

    def take(self, frame: Frame, now: Instant) -> None:
        self.frames += 1
        self._last_frame = now.mono
        self.v1 += frame.raw[0] == V1
        number, first, _ = self._times.get(frame.message_id, (0, now.mono, 0.0))
        self._times[frame.message_id] = number + 1, first, now.mono
        if frame.message_id == HEARTBEAT:
            self._note_heartbeat(frame.message, frame.ids[1])
        elif type(frame.message) is mav.HighLatency2:
            self._note_heartbeat(stated(frame.message), frame.ids[1])
        elif type(frame.message) is mav.NamedValueFloat:
            value = value_of(frame.message) if is_word(frame.message) else None
            if value is not None:
                self._applet = value, now.mono
        elif type(frame.message) is mav.SystemTime:
            message = frame.message
            if message.time_unix_usec > YEAR_2020_US:
                self._clock_off = (message.time_unix_usec - now.unix_us) / 1e6

    def _note_heartbeat(self, heartbeat: mav.Heartbeat, component: int) -> None:
        self.heartbeat = heartbeat
        self.pilot = self.pilot or is_autopilot(heartbeat, component)

    def speaker(self, ids: tuple[int, int], status: VehicleStatus | None) -> Speaker:
        """The summary of this component."""
        return Speaker(
            *ids,
            autopilot=self.heartbeat.autopilot if self.heartbeat else None,
            type=self.heartbeat.type if self.heartbeat else None,
            counts={i: number for i, (number, _, _) in sorted(self._times.items())},
            rates={
                i: round((number - 1) / (last - first), 1)
                for i, (number, first, last) in sorted(self._times.items())
                if last > first
            },
            frames=self.frames,
            frames_v1=self.v1,
            pilot=self.pilot,
            clock_off=self._clock_off,
            applet=self._applet and AppletReport(self._applet[0], self._last_frame - self._applet[1]),
            status=status,
        )
