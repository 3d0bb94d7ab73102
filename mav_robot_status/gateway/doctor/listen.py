"""Listens on a connection for some seconds and says what was found and what to do next.

It is the gateway that listens, with all that it sends and asks for, so what is found is what `run` would find.
"""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Any, Final, cast

from ...clock import now as present
from ...errors import LinkError
from ...hardware.kinds import WANTED_IDS
from ...hardware.requests import COMMON, LOOK, wanted_of
from ...link.url import parse
from ...mavlink.component import LONELY_SYSTEM, Component
from ...mavlink.framing import Frame, Parser
from ..explain import NO_OUTPUT, explanation, silent
from ..live import Live
from ..plant import Plant
from ..recorded import Recording
from ..replay import Nobody, run_through
from . import probes
from .advice import protocol
from .collector import Collector
from .diagnosis import diagnose
from .findings import Findings, Trouble, VehicleStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...clock import Instant
    from ...config import Config, LinkConfig
    from ...hardware.robot_hw import MavlinkRobotHW
    from ...hardware.tracked import Tracked
    from ...link.base import Link, Received
    from ...link.log import Stamped
    from ...mavlink.counters import Counters
    from .diagnosis import Diagnosis

LISTEN: Final = 5.0
"""Seconds to listen, again from the first heartbeat on: what is missing is asked for after 3 s, and has to come."""
SURE: Final = 3.0
"""Seconds after which it ends early if nothing is wrong."""
ANSWER: Final = 1.0  # s that an autopilot has to send what it was asked for


def examine(
    config: Config, link: LinkConfig, seconds: float = LISTEN, clock: Callable[[], Instant] = present
) -> tuple[Findings, Diagnosis]:
    """Listen on one of the links. Raises UsageError for a log that cannot be read."""
    config = dataclasses.replace(silent(config), links=(link,), outs=(), record=None, forward=False)
    url = parse(link.url)
    base = Findings(
        url,
        url.words(),
        link.passive,
        signing=config.signing is not None,
        expected=tuple(v.system for v in config.vehicles if v.system is not None),
    )
    findings = _read(config, base) if url.kind == "log" else _listen(config, base, seconds, clock)
    return findings, diagnose(findings)


# -- a live link -------------------------------------------------------------------------------------------------------


class Tap:
    """A link that tells a collector of everything that it receives."""

    def __init__(self, link: Link, collector: Collector, clock: Callable[[], Instant]) -> None:
        self._link = link
        self._collector = collector
        self._clock = clock

    def __getattr__(self, name: str) -> Any:
        return getattr(self._link, name)

    def receive(self, limit: int = 64) -> list[Received]:
        """What is waiting, as it is."""
        pieces = self._link.receive(limit)
        now = self._clock()
        for data, source in pieces:
            self._collector.hear(data, source, now)
        return pieces


def _listen(config: Config, base: Findings, seconds: float, clock: Callable[[], Instant]) -> Findings:
    try:
        found = _turn(config, base, seconds, clock)
    except LinkError as error:
        cause = error.__context__  # the error that the link was refused with
        return dataclasses.replace(base, trouble=Trouble(str(error), getattr(cause, "errno", None)))
    if not found.size:
        heartbeat = b"" if base.passive else Component().heartbeat(LONELY_SYSTEM)
        return dataclasses.replace(found, place=probes.place(base.url, heartbeat))
    if base.url.kind == "serial" and not found.counters.frames and not protocol(found.head):
        return dataclasses.replace(found, place=probes.other_baud(base.url))
    return found


def _turn(config: Config, base: Findings, seconds: float, clock: Callable[[], Instant]) -> Findings:
    """Turn the gateway's loop until enough was heard. Raises LinkError."""
    gateway = Live(config, NO_OUTPUT, clock)
    collector = Collector()
    station = gateway.stations[0]
    link = station.link
    station.link = cast("Link", Tap(link, collector, clock))
    start = clock().mono
    first_beat: list[float] = []

    def found() -> Findings:
        now = clock()
        listened = now.mono - (first_beat[0] if first_beat else start)
        known = dataclasses.replace(
            base,
            words=link.text,
            seconds=round(now.mono - start, 1),
            dropped=link.dropped,
            asked=config.requests == "missing" and not base.passive and listened >= LOOK + ANSWER,
        )
        return collector.findings(known, _statuses(gateway.plant.hw, now))

    def enough() -> bool:
        now = clock().mono
        if not first_beat and collector.beats():
            first_beat.append(now)
        listened = now - (first_beat[0] if first_beat else start)
        if listened >= seconds:
            return True
        return bool(first_beat) and now - start >= SURE and _all_is_well(found())

    gateway.run(until=enough)
    return found()


def _all_is_well(f: Findings) -> bool:
    """Whether listening longer would find nothing else: everything that a status needs has come."""
    return diagnose(f).cause == "ok" and not any(s.missing for s in f.vehicles)


# -- a recorded log ----------------------------------------------------------------------------------------------------


class _Whole(Recording):
    """A recorded log that gives every frame, not only those that a status needs."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self._parser = Parser(None, stamped=True)

    def counters(self) -> Counters:
        """What was counted so far."""
        return self._parser.counters

    def overheard(self, collector: Collector) -> Iterator[Stamped]:
        """What the gateway wants of it; the collector hears all."""
        for stamped in self:
            now, values, new_segment = stamped
            if values is None:
                yield stamped
                continue
            frame = Frame(*values)
            collector.take(frame, now)
            yield stamped if frame.message_id in WANTED_IDS else (now, None, new_segment)


def _read(config: Config, base: Findings) -> Findings:
    """Read a log to its end. Raises UsageError."""
    recording = _Whole(base.url.device)
    collector = Collector()
    plant = Plant(config, Nobody(), NO_OUTPUT, patient=True)
    last = run_through(plant, recording.overheard(collector))  # the first record is at 0
    known = dataclasses.replace(base, seconds=round(last.mono, 1))
    found = collector.findings(known, _statuses(plant.hw, last), recording.counters())
    return dataclasses.replace(found, size=os.path.getsize(base.url.device))


# -- what the gateway makes of it --------------------------------------------------------------------------------------


def _statuses(hw: MavlinkRobotHW, now: Instant) -> dict[tuple[int, int], VehicleStatus]:
    hw.explain(now)
    return {tracked.ids: _status(hw, tracked, now) for tracked in hw.vehicles if tracked.ids is not None}


def _status(hw: MavlinkRobotHW, tracked: Tracked, now: Instant) -> VehicleStatus:
    explained = explanation(tracked, now)
    memory = tracked.memory
    wanted = wanted_of(memory.stack, memory.family, hw.options.watch_outputs) if memory else COMMON
    return VehicleStatus(
        explained["vehicle"]["flight_mode"],
        {name: field["value"] for name, field in explained["fields"].items()},
        tuple(error["name"] for error in explained["errors"]),
        tuple(inhibit["name"] for inhibit in explained["inhibits"]),
        wanted,
    )
