"""What a live gateway counts, as values for `/metrics`: taken in its own thread, and cheap, for no text is made."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from ..interface import ConnectionMetrics, Metrics, PublisherMetrics, RobotStatusMsg

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..clock import Instant
    from ..interface import IndustrialRobotStatusHandle
    from .plant import Plant
    from .station import Station
    from .switchboard import Switchboard


def metrics(plant: Plant, switchboard: Switchboard, now: Instant) -> Metrics:
    """Everything up to `now`."""
    handles = plant.hw.handles
    return Metrics(
        tuple(_vehicle(handles.get_handle(name), now) for name in handles.get_names()),
        tuple(_connection(station) for station in switchboard.stations),
        tuple(_publishers(plant)),
        switchboard.record_dropped,
    )


def _vehicle(handle: IndustrialRobotStatusHandle, now: Instant) -> RobotStatusMsg:
    age = None if handle.heard_at is None else now.mono - handle.heard_at
    return RobotStatusMsg(handle.name, now.unix_us, handle.status, handle.detail, age)


def _connection(station: Station) -> ConnectionMetrics:
    got = station.totals()
    return ConnectionMetrics(
        station.url,
        station.is_out,
        sum(1 for _ in station.peers()),
        got.frames,
        got.lost,
        got.bad_crc,
        sum(got.unknown.values()),
        got.incompatible,
        got.garbage_bytes,
        station.link.dropped,
    )


def _publishers(plant: Plant) -> Iterator[PublisherMetrics]:
    """A publisher that holds something says so in `queued`, one that drops something in `dropped`."""
    numbers: Counter[str] = Counter()
    for (kind, _), publisher in plant.publishers.items():
        numbers[kind] += 1
        dropped = getattr(publisher, "dropped", 0) + plant.skipped(publisher)
        yield PublisherMetrics(kind, numbers[kind], getattr(publisher, "queued", 0), dropped)
