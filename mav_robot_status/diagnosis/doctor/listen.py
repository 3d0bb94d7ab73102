"""Listens on a connection for some seconds, and returns the findings and the diagnosis.

It runs the normal gateway, which also sends and requests messages, so the findings apply to `run`.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator
from typing import Final

from ...clock import Instant
from ...clock import now as present
from ...config import Config, LinkConfig
from ...errors import LinkError
from ...gateway.event_loop import EventLoop
from ...gateway.logs.recorded_log import Recording
from ...gateway.replay import ReplayPipeline, run_through
from ...hardware.mavlink.autopilots.wanted import COMMON
from ...hardware.mavlink.interface import MavlinkRobotHW
from ...hardware.mavlink.requests.message_intervals import LOOK, wanted_of
from ...hardware.mavlink.senders import senders, strangers
from ...hardware.mavlink.vehicle import TrackedVehicle
from ...interface.explanation import explanation
from ...links.log import Stamped
from ...links.url import parse
from ...mavlink.component import DEFAULT_SYSTEM, Component
from ...mavlink.counters import Counters
from ...mavlink.framing import Frame, Parser
from ...streams import NO_OUTPUT
from ..explain import silent
from ..vehicle_reports import can_run
from . import probes
from .advice import protocol
from .collector import Collector
from .diagnosis import Diagnosis, diagnose
from .findings import Findings, Trouble, VehicleStatus
from .heard import Listener

LISTEN: Final = 5.0
"""Seconds to listen. They start again at the first heartbeat, because missing messages are requested 3 s later."""
SURE: Final = 3.0
"""Seconds after which listening ends early if there is no fault."""
ANSWER: Final = 1.0  # s for an autopilot to send requested messages


def examine(
    config: Config, link: LinkConfig, seconds: float = LISTEN, clock: Callable[[], Instant] = present
) -> tuple[Findings, Diagnosis]:
    """Listen on one of the links. Raises UsageError for a log that cannot be read."""
    config = dataclasses.replace(silent(config), links=(link,), outs=(), interfaces=(), record=None, forward=False)
    url = parse(link.url)
    base = Findings(
        url,
        url.words(),
        link.passive,
        signing=config.signing is not None,
        expected=tuple(v.system for v in config.vehicles if v.system is not None),
    )
    findings = _read(config, base) if url.kind.is_log else _listen(config, base, seconds, clock)
    return findings, diagnose(findings)


# -- a live link -------------------------------------------------------------------------------------------------------


def _listen(config: Config, base: Findings, seconds: float, clock: Callable[[], Instant]) -> Findings:
    try:
        found = _turn(config, base, seconds, clock)
    except LinkError as error:
        cause = error.__context__  # the OSError of the link
        return dataclasses.replace(base, trouble=Trouble(str(error), getattr(cause, "errno", None)))
    if not found.size:
        heartbeat = b"" if base.passive else Component().heartbeat(DEFAULT_SYSTEM)
        return dataclasses.replace(found, place=probes.place(base.url, heartbeat))
    if base.url.kind.is_serial and not found.counters.frames and not protocol(found.head):
        return dataclasses.replace(found, place=probes.other_baud(base.url))
    return found


def _turn(config: Config, base: Findings, seconds: float, clock: Callable[[], Instant]) -> Findings:
    """Run the gateway until the findings are complete. Raises LinkError."""
    collector = Collector()
    gateway = EventLoop(config, NO_OUTPUT, clock, observers=[collector])
    link = gateway.endpoints[0].link
    start = clock().mono
    first_heartbeat: list[float] = []

    def found() -> Findings:
        now = clock()
        listened = now.mono - (first_heartbeat[0] if first_heartbeat else start)
        known = dataclasses.replace(
            base,
            words=link.text,
            seconds=round(now.mono - start, 1),
            dropped=link.dropped,
            asked=config.requests == "missing" and not base.passive and listened >= LOOK + ANSWER,
        )
        return collector.findings(known, _statuses(gateway.hardware.mavlink.vehicles, now))

    def enough() -> bool:
        now = clock().mono
        if not first_heartbeat and collector.has_heartbeat():
            first_heartbeat.append(now)
        listened = now - (first_heartbeat[0] if first_heartbeat else start)
        if listened >= seconds:
            return True
        return bool(first_heartbeat) and now - start >= SURE and _all_is_well(found())

    gateway.run(until=enough)
    return found()


def _all_is_well(f: Findings) -> bool:
    """Whether there is no fault, every message that a status needs has arrived, and one sender speaks."""
    return diagnose(f).cause == "ok" and not any(s.missing or (s.status and s.status.senders) for s in f.vehicles)


# -- a recorded log ----------------------------------------------------------------------------------------------------


class _Whole(Recording):
    """A recorded log with every frame, not only those that a status needs."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self._parser = Parser(None, stamped=True)

    def counters(self) -> Counters:
        """The counters so far."""
        return self._parser.counters

    def frames_for(self, collector: Collector) -> Iterator[Stamped]:
        """All frames. The collector gets them too."""
        for stamped in self:
            now, values, _ = stamped
            if values is not None:
                collector.take(Frame(*values), now)
            yield stamped


def _read(config: Config, base: Findings) -> Findings:
    """Read a log to its end. Raises UsageError."""
    recording = _Whole(base.url.device)
    collector = Collector()
    listener = Listener()
    pipeline = ReplayPipeline(config, NO_OUTPUT, observers=[listener])
    last = run_through(pipeline, recording.frames_for(collector))  # the first record is at 0
    known = dataclasses.replace(base, seconds=round(last.mono, 1))
    found = collector.findings(known, _statuses(pipeline.vehicles, last), recording.counters())
    handles = {tracked.ids: tracked.handle for tracked in pipeline.vehicles.vehicles}
    speakers = (
        s._replace(heard=listener.heard(handles[s.system, s.component], last)) if s.status else s
        for s in found.speakers
    )
    return dataclasses.replace(found, size=os.path.getsize(base.url.device), speakers=tuple(speakers))


# -- the vehicles ------------------------------------------------------------------------------------------------------


def _statuses(hw: MavlinkRobotHW, now: Instant) -> dict[tuple[int, int], VehicleStatus]:
    for tracked in hw.vehicles:
        hw.explain(tracked.handle.name, now)
    return {tracked.ids: _status(hw, tracked, now) for tracked in hw.vehicles if tracked.ids is not None}


def _status(hw: MavlinkRobotHW, tracked: TrackedVehicle, now: Instant) -> VehicleStatus:
    explained = explanation(tracked.handle, now)
    state = tracked.state
    wanted = wanted_of(state.profile, state.family, hw.options.watch_outputs) if state else COMMON
    return VehicleStatus(
        explained["vehicle"]["flight_mode"],
        {name: field["value"] for name, field in explained["fields"].items()},
        tuple(error["name"] for error in explained["errors"]),
        tuple(dict.fromkeys(inhibit["name"] for inhibit in explained["inhibits"])),
        wanted,
        explained["vehicle"].get("firmware"),
        costly=tracked.costly,
        name=tracked.name,
        can_run_applet=can_run(state) and not tracked.costly,
        senders=senders(tracked.belief, now.mono),
        strangers=strangers(tracked.belief, now.mono, hw.options.heartbeat_timeout),
        next={name: field["next"] for name, field in explained["fields"].items() if field["next"] is not None},
    )
