"""Collects the frames of one connection and summarizes them. Input: bytes and times. Output: findings."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

from ...gateway.observer import Observer
from ...hardware.mavlink.identity import is_autopilot, named
from ...hardware.mavlink.state.applet import is_word, value_of
from ...hardware.mavlink.state.boot_clock import APART
from ...hardware.mavlink.state.claims import CLOCKS
from ...hardware.mavlink.state.high_latency import stated
from ...mavlink import definitions as mav
from ...mavlink.counters import Counters
from ...mavlink.counters import count as add
from ...mavlink.framing import Parser
from ...mavlink.wire import V1
from .findings import HEARTBEAT, AppletReport, Speaker

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant
    from ...links.base import Address
    from ...mavlink.framing import Frame
    from .findings import Findings, VehicleStatus

HEAD: Final = 4096
"""Number of first bytes that are kept, to recognise other protocols."""
MOST_SOURCES: Final = 64
"""Addresses with a parser of their own. All others share one."""
MOST_SPEAKERS: Final = 256
MOST_KINDS: Final = 4
"""Limit of the kinds and boot times stored for one autopilot."""
RETURNS: Final = 2
"""This many returns to an earlier boot time prove two autopilots. A reboot never returns to one."""
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
        return any(sender.kinds for sender in self._components.values())

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
        "_boots",
        "_clock_off",
        "_kind",
        "_last",
        "_last_frame",
        "_returns",
        "_swaps",
        "_times",
        "frames",
        "heartbeat",
        "kinds",
        "v1",
    )

    def __init__(self) -> None:
        self.frames = self.v1 = 0
        self._times: dict[int, tuple[int, float, float]] = {}
        """By message id: count, time of the first and of the last. Bounded by the list of known ids."""
        self.heartbeat: mav.Heartbeat | None = None
        self.kinds: list[tuple[int, int]] = []
        """The distinct pairs of autopilot and type in its heartbeats."""
        self._kind = -1
        self._swaps = 0
        self._boots: list[float] = []
        self._last = -1
        self._returns = 0
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
        elif frame.message_id in CLOCKS:
            message = frame.message
            self._note_boot_time(now.mono - message.time_boot_ms / 1000)
            if type(message) is mav.SystemTime and message.time_unix_usec > YEAR_2020_US:
                self._clock_off = (message.time_unix_usec - now.unix_us) / 1e6

    def _note_heartbeat(self, heartbeat: mav.Heartbeat, component: int) -> None:
        """Note a heartbeat. Two autopilots with one id alternate; a single one never returns to an earlier type."""
        self.heartbeat = heartbeat
        if not is_autopilot(heartbeat, component):
            return
        kind = heartbeat.autopilot, heartbeat.type
        if kind not in self.kinds:
            if len(self.kinds) >= MOST_KINDS:
                return
            self.kinds.append(kind)
        elif self.kinds.index(kind) != self._kind:
            self._swaps += 1
        self._kind = self.kinds.index(kind)

    def _note_boot_time(self, booted: float) -> None:
        """Note a boot time. A return to an earlier one proves another autopilot; a reboot never returns."""
        known = next((i for i, at in enumerate(self._boots) if abs(at - booted) < APART), None)
        if known is None:
            if len(self._boots) >= MOST_KINDS:
                return
            self._boots.append(booted)
            known = len(self._boots) - 1
        elif known != self._last:
            self._returns += 1
        self._last = known

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
            pilot=bool(self.kinds),
            conflict=self._conflict(),
            clock_off=self._clock_off,
            applet=self._applet and AppletReport(self._applet[0], self._last_frame - self._applet[1]),
            status=status,
        )

    def _conflict(self) -> str:
        if self._swaps:
            kinds = (f"{named(mav.AUTOPILOT_NAMES, a)} {named(mav.TYPE_NAMES, t)}" for a, t in sorted(self.kinds))
            return "heartbeats that alternate between " + " and ".join(kinds)
        if self._returns >= RETURNS:
            return f"alternating clocks that started {max(self._boots) - min(self._boots):.0f} s apart"
        return ""
