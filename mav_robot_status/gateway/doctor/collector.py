"""Takes what comes in on one connection, frame by frame, and says at the end what was heard. Bytes and times in."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

from ...hardware.fields.view import named
from ...hardware.identity import is_autopilot
from ...mavlink import definitions as mav
from ...mavlink.counters import Counters
from ...mavlink.counters import count as add
from ...mavlink.framing import Parser
from ...mavlink.wire import V1
from ..paths import APART, CLOCKS
from .findings import HEARTBEAT, Speaker

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant
    from ...link.base import Address
    from ...mavlink.framing import Frame
    from .findings import Findings, VehicleStatus

HEAD: Final = 4096
"""Bytes kept of what came first, by which other protocols are recognised."""
MOST_SOURCES: Final = 64
"""Addresses whose cut frames are put together; those beyond share one parser."""
MOST_SPEAKERS: Final = 256
MOST_KINDS: Final = 4
"""Kinds and boot times of one autopilot that are told apart."""
RETURNS: Final = 2
"""So often has a clock to go back to a boot time known before: one that reboots never does."""
YEAR_2020_US: Final = 1_577_836_800_000_000
"""A vehicle without GPS counts from 1970."""


class Collector:
    """Takes what comes in on one connection. Bounded, whatever is sent."""

    def __init__(self) -> None:
        self._parsers: dict[Address, Parser] = {}
        self._voices: dict[tuple[int, int], _Voice] = {}
        self._good: dict[int, int] = {}
        self.head = b""
        self.size = 0

    def hear(self, data: bytes, source: Address, now: Instant) -> None:
        """Take the bytes that one address sent."""
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
        """Take one frame, with its `raw` bytes."""
        if frame.message_id not in mav.CRC_EXTRA:
            return  # not checked: its header may be noise
        add(self._good, frame.message_id)
        ids = frame.ids
        voice = self._voices.get(ids)
        if voice is None:
            if len(self._voices) >= MOST_SPEAKERS:
                return
            voice = self._voices[ids] = _Voice()
        voice.take(frame, now)

    def beats(self) -> bool:
        """Whether an autopilot's heartbeat was heard."""
        return any(voice.kinds for voice in self._voices.values())

    def findings(
        self, base: Findings, statuses: Mapping[tuple[int, int], VehicleStatus], counters: Counters | None = None
    ) -> Findings:
        """`base` with what was heard; `statuses` are those of the vehicles that have a handle, by their ids."""
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
            speakers=tuple(v.speaker(ids, statuses.get(ids)) for ids, v in sorted(self._voices.items())),
        )


class _Voice:
    """What one component said."""

    __slots__ = (
        "_boots",
        "_clock_off",
        "_kind",
        "_last",
        "_returns",
        "_swaps",
        "_times",
        "beat",
        "frames",
        "kinds",
        "v1",
    )

    def __init__(self) -> None:
        self.frames = self.v1 = 0
        self._times: dict[int, tuple[int, float, float]] = {}
        """By id: how many, when the first and the last; no longer than the list of known ids."""
        self.beat: mav.Heartbeat | None = None
        self.kinds: list[tuple[int, int]] = []
        """Autopilot and type of its autopilot's heartbeats, each once."""
        self._kind = -1
        self._swaps = 0
        self._boots: list[float] = []
        self._last = -1
        self._returns = 0
        self._clock_off: float | None = None

    def take(self, frame: Frame, now: Instant) -> None:
        self.frames += 1
        self.v1 += frame.raw[0] == V1
        number, first, _ = self._times.get(frame.message_id, (0, now.mono, 0.0))
        self._times[frame.message_id] = number + 1, first, now.mono
        if frame.message_id == HEARTBEAT:
            self._beat(frame.message, frame.ids[1])
        elif frame.message_id in CLOCKS:
            message = frame.message
            self._clock(now.mono - message.time_boot_ms / 1000)
            if type(message) is mav.SystemTime and message.time_unix_usec > YEAR_2020_US:
                self._clock_off = (message.time_unix_usec - now.unix_us) / 1e6

    def _beat(self, beat: mav.Heartbeat, component: int) -> None:
        """Two autopilots with one id take turns; one alone never returns to a type that it has left."""
        self.beat = beat
        if not is_autopilot(beat, component):
            return
        kind = beat.autopilot, beat.type
        if kind not in self.kinds:
            if len(self.kinds) >= MOST_KINDS:
                return
            self.kinds.append(kind)
        elif self.kinds.index(kind) != self._kind:
            self._swaps += 1
        self._kind = self.kinds.index(kind)

    def _clock(self, booted: float) -> None:
        """A boot time that is returned to belongs to another autopilot; a reboot only ever leaves one behind."""
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
        """All of it as a value."""
        return Speaker(
            *ids,
            autopilot=self.beat.autopilot if self.beat else None,
            type=self.beat.type if self.beat else None,
            counts={i: number for i, (number, _, _) in sorted(self._times.items())},
            rates={
                i: round((number - 1) / (last - first), 1)
                for i, (number, first, last) in sorted(self._times.items())
                if last > first
            },
            frames=self.frames,
            frames_v1=self.v1,
            pilot=bool(self.kinds),
            twins=self._twins(),
            clock_off=self._clock_off,
            status=status,
        )

    def _twins(self) -> str:
        if self._swaps:
            kinds = (f"{named(mav.AUTOPILOT_NAMES, a)} {named(mav.TYPE_NAMES, t)}" for a, t in sorted(self.kinds))
            return "heartbeats in turns of " + " and of ".join(kinds)
        if self._returns >= RETURNS:
            return f"clocks in turns that started {max(self._boots) - min(self._boots):.0f} s apart"
        return ""
