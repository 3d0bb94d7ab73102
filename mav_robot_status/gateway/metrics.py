"""Collects the counters of a live gateway for `/metrics`, in the gateway's thread. It formats no text."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from ..interface import ConnectionMetrics, Metrics, PublisherMetrics, RobotStatusMsg

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..clock import Instant
    from ..interface import IndustrialRobotStatusHandle
    from .links.endpoint import Endpoint
    from .links.link_hub import LinkHub
    from .pipeline import Pipeline


def metrics(pipeline: Pipeline, hub: LinkHub, now: Instant) -> Metrics:
    """All values and counters at `now`."""
    handles = pipeline.hw.handles
    return Metrics(
        tuple(_vehicle(handles.get_handle(name), now) for name in handles.get_names()),
        tuple(_connection(endpoint) for endpoint in hub.endpoints),
        tuple(_publishers(pipeline)),
        hub.record_dropped,
    )


def _vehicle(handle: IndustrialRobotStatusHandle, now: Instant) -> RobotStatusMsg:
    age = None if handle.heard_at is None else now.mono - handle.heard_at
    return RobotStatusMsg(handle.name, now.unix_us, handle.status, handle.detail, age)


def _connection(endpoint: Endpoint) -> ConnectionMetrics:
    got = endpoint.totals()
    return ConnectionMetrics(
        endpoint.url,
        endpoint.is_out,
        sum(1 for _ in endpoint.peers()),
        got.frames,
        got.lost,
        got.bad_crc,
        sum(got.unknown.values()),
        got.incompatible,
        got.garbage_bytes,
        endpoint.link.dropped,
        endpoint.budget.sent,
        endpoint.budget.withheld,
        endpoint.left_out,
    )


def _publishers(pipeline: Pipeline) -> Iterator[PublisherMetrics]:
    """Publishers count messages in `queued` and `dropped`."""
    numbers: Counter[str] = Counter()
    for (kind, _), publisher in pipeline.publishers.items():
        numbers[kind] += 1
        dropped = getattr(publisher, "dropped", 0) + pipeline.skipped(publisher)
        yield PublisherMetrics(kind, numbers[kind], getattr(publisher, "queued", 0), dropped)
