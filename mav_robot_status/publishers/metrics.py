"""Metrics in Prometheus' text format 0.0.4. A value that is not known has no line.

Names follow https://prometheus.io/docs/practices/naming/: base units, `_total` for counters. Label values are
our names and those of the configuration, never an autopilot's texts: these would create series without limit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from operator import attrgetter
from typing import Any, Final, NamedTuple

from ..interface import (
    FIELDS,
    ConnectionMetrics,
    ErrorCause,
    Inhibit,
    Kind,
    LinkState,
    Metrics,
    PublisherMetrics,
    RobotStatusMsg,
)
from ..version import __version__

Labels = dict[str, object]

CONTENT_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"
PREFIX: Final = "mav_robot_status_"
GAUGE, COUNTER = "gauge", "counter"

NUMBERS: Final = {Kind.MODE: " -1 unknown, 1 manual, 2 auto.", Kind.TRI_STATE: " -1 unknown, 0 false, 1 true."}
"""What the help of a field adds to its meaning."""


class Family(NamedTuple):
    """One metric. Each vehicle, connection or publisher has one line, or one for each set of further labels."""

    name: str
    kind: str
    help: str
    read: Callable[[Any], float | Iterable[tuple[Labels, float]] | None]
    """One value, None for no value, or several values with further labels."""


def _connected(msg: RobotStatusMsg) -> float:
    return int(msg.detail.link is LinkState.CONNECTED)


def _age(msg: RobotStatusMsg) -> float | None:
    return None if msg.heartbeat_age is None else round(max(0.0, msg.heartbeat_age), 3)


def _can_arm(msg: RobotStatusMsg) -> float | None:
    passes = msg.detail.vehicle.can_arm
    return None if passes is None else int(passes)


def _member(cause: ErrorCause | Inhibit) -> Labels:
    """The label that names the member of a group; a single robot has none."""
    return {} if cause.handle is None else {"member": cause.handle}


def _reasons(msg: RobotStatusMsg) -> Iterable[tuple[Labels, float]]:
    """One series for each name, and for each member of a group that gives it, however many texts it has."""
    for name, handle in dict.fromkeys((inhibit.name, inhibit.handle) for inhibit in msg.detail.inhibits):
        yield {"reason": name, **({} if handle is None else {"member": handle})}, 1


def _info(msg: RobotStatusMsg) -> Iterable[tuple[Labels, float]]:
    vehicle = msg.detail.vehicle
    if vehicle.autopilot is not None:
        names: Labels = {"autopilot": vehicle.autopilot, "type": vehicle.type or "", "state": vehicle.state or ""}
        yield {**names, "flight_mode": vehicle.flight_mode or "", "firmware": vehicle.firmware or ""}, 1


VEHICLE: Final = (
    Family("link_up", GAUGE, "1 while heartbeats of the vehicle arrive, else 0.", _connected),
    Family("heartbeat_age_seconds", GAUGE, "Seconds since the last heartbeat of the vehicle.", _age),
    *(
        Family(field.name, GAUGE, field.row.meaning + NUMBERS.get(field.kind, ""), attrgetter(f"status.{field.name}"))
        for field in FIELDS
    ),
    Family(
        "error",
        GAUGE,
        "1 for each active cause of in_error.",
        lambda m: (({"code": e.code, "cause": e.name, **_member(e)}, 1) for e in m.detail.errors),
    ),
    Family(
        "inhibit",
        GAUGE,
        "1 for each reason why motion is not possible.",
        _reasons,
    ),
    Family(
        "group_member", GAUGE, "1 for each member of a group.", lambda m: (({"member": n}, 1) for n in m.detail.members)
    ),
    Family("can_arm", GAUGE, "1 if the arming checks pass in the current mode, 0 if not; absent if unknown.", _can_arm),
    Family("vehicle_info", GAUGE, "1, with the autopilot's description of itself.", _info),
)
CONNECTION: Final = (
    Family("connection_frames_total", COUNTER, "MAVLink frames received that were not damaged.", lambda c: c.frames),
    Family(
        "connection_lost_frames_total", COUNTER, "Frames missing from the sequence of their sender.", lambda c: c.lost
    ),
    Family(
        "connection_crc_errors_total",
        COUNTER,
        "Frames with a bad CRC by message id: damaged, or defined otherwise; -1: further ids.",
        lambda c: (({"message_id": message_id}, number) for message_id, number in c.crc_errors.items()),
    ),
    Family("connection_unknown_frames_total", COUNTER, "Frames of ids that cannot be checked.", lambda c: c.unknown),
    Family(
        "connection_incompatible_frames_total",
        COUNTER,
        "Frames with an unknown incompatibility flag.",
        lambda c: c.incompatible,
    ),
    Family(
        "connection_garbage_bytes_total", COUNTER, "Bytes received that are not MAVLink.", lambda c: c.garbage_bytes
    ),
    Family(
        "connection_dropped_total",
        COUNTER,
        "Messages that could not be sent, and datagrams that the kernel dropped.",
        lambda c: c.dropped,
    ),
    Family("connection_unasked_bytes_total", COUNTER, "Bytes that were sent without being asked.", lambda c: c.said),
    Family(
        "connection_held_back_total",
        COUNTER,
        "Messages that were held back because of speech_limit.",
        lambda c: c.withheld,
    ),
    Family("connection_peers", GAUGE, "Peers that we send to.", lambda c: c.peers),
)
PUBLISHER: Final = (
    Family("publisher_queued_messages", GAUGE, "Messages held and not yet handed on.", lambda p: p.queued),
    Family("publisher_dropped_messages_total", COUNTER, "Messages dropped for lack of room.", lambda p: p.dropped),
)
GATEWAY: Final = (
    Family("build_info", GAUGE, "1, with the version.", lambda m: [({"version": __version__}, 1)]),
    Family("record_dropped_frames_total", COUNTER, "Frames missing in the recording.", lambda m: m.record_dropped),
)


def exposition(metrics: Metrics) -> str:
    """The whole text, as `/metrics` gives it."""
    lines = [
        *_lines(GATEWAY, [({}, metrics)]),
        *_lines(VEHICLE, [(_of_vehicle(msg), msg) for msg in metrics.vehicles]),
        *_lines(CONNECTION, [(_of_connection(one), one) for one in metrics.connections]),
        *_lines(PUBLISHER, [(_of_publisher(one), one) for one in metrics.publishers]),
    ]
    return "".join(f"{line}\n" for line in lines)


def _lines(families: Iterable[Family], things: list[tuple[Labels, object]]) -> Iterator[str]:
    for family in families:
        yield from _family(family, things)


def _of_vehicle(msg: RobotStatusMsg) -> Labels:
    detail = msg.detail
    ids = ("" if number is None else number for number in (detail.system, detail.component))
    return {"handle": msg.handle, **dict(zip(("system", "component"), ids, strict=True))}


def _of_connection(one: ConnectionMetrics) -> Labels:
    return {"connection": one.connection, "role": "out" if one.is_out else "vehicle"}


def _of_publisher(one: PublisherMetrics) -> Labels:
    return {"publisher": one.type, "number": one.number}


def _family(family: Family, things: list[tuple[Labels, object]]) -> list[str]:
    """The lines of a metric; none without a value. Values with the same labels are added: a series must be unique."""
    values: dict[str, float] = {}
    for labels, thing in things:
        found = family.read(thing)
        several = [({}, found)] if isinstance(found, int | float) else found or ()
        for more, value in several:
            series = _labels({**labels, **more})
            values[series] = values.get(series, 0) + value
    name = PREFIX + family.name
    head = [f"# HELP {name} {family.help}", f"# TYPE {name} {family.kind}"] if values else []
    return head + [f"{name}{series} {value:.15g}" for series, value in values.items()]


def _labels(labels: Mapping[str, object]) -> str:
    pairs = ",".join(f'{name}="{_escaped(str(value))}"' for name, value in labels.items())
    return f"{{{pairs}}}" if pairs else ""


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n")
