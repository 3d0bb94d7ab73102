"""Fetches the table of PX4's events from a vehicle, once, for a file.

It runs the normal gateway, without its outputs and without the cache, until the table is there or given up.
"""

from __future__ import annotations

import dataclasses
import lzma
from collections.abc import Callable
from typing import Final

from ..clock import Instant
from ..clock import now as present
from ..config import Config
from ..errors import MavRobotStatusError, NothingHeardError
from ..gateway.event_loop import EventLoop
from ..gateway.mavlink_hardware import MavlinkHardware
from ..hardware.mavlink.autopilots.wanted import METADATA
from ..hardware.mavlink.px4_events.parsing import MOST_UNPACKED
from ..hardware.mavlink.state import VehicleState
from ..mavlink.ftp import metadata
from ..streams import NO_OUTPUT
from .explain import silent

HEARD_BY: Final = 15.0  # s to wait for the first heartbeat
KNOWN_BY: Final = 5.0
"""Seconds from the first heartbeat. After that no further vehicle is expected."""
OFFERED_BY: Final = 30.0
"""Seconds from the first heartbeat until a PX4 should have told where its metadata is. It is asked for other messages
first, and at most four times."""


class NoTableError(MavRobotStatusError):
    """The table cannot be had. The message says why."""


def fetch(
    config: Config, seconds: float, progress: Callable[[float], None], clock: Callable[[], Instant] = present
) -> bytes:
    """The file of the table of the first PX4 that delivers one.

    `progress` is called with the share that has arrived. Raises NothingHeardError, NoTableError, LinkError.
    """
    gateway = EventLoop(_alone(config), NO_OUTPUT, clock)
    hardware = gateway.hardware.mavlink
    files: dict[tuple[int, int], bytes] = {}
    hardware.tables.cache, hardware.tables.files = None, files
    start = clock().mono
    heard_at: list[float] = []
    errors: list[MavRobotStatusError] = []

    def enough() -> bool:
        now = clock().mono
        if not heard_at and any(hardware.vehicles.vehicles):
            heard_at.append(now)
        progress(_share(hardware))
        error = why_not(hardware, now - start, now - heard_at[0] if heard_at else None)
        if error is None and now - start >= seconds:
            error = NoTableError(
                f"the table of events has not arrived in {seconds:g} s; write for example --seconds 300"
            )
        if error is not None:
            errors.append(error)
        return bool(files or errors)

    gateway.run(until=enough)
    if not files:
        raise errors[0]
    return next(iter(files.values()))


def why_not(hardware: MavlinkHardware, listened: float, known: float | None) -> MavRobotStatusError | None:
    """Why no table will come; None while one may come.

    `listened` are the seconds since the start, `known` those since the first heartbeat; None: there was none.
    """
    if known is None:
        return None if listened < HEARD_BY else NothingHeardError(f"no autopilot was heard in {HEARD_BY:g} s")
    if known < KNOWN_BY:
        return None
    given_up, offers = hardware.tables.given_up, hardware.tables.offers
    px4 = [ids for ids, vehicle in _heard(hardware) if METADATA in vehicle.profile.requests.once]
    if not px4:
        others = ", ".join(_named(ids, vehicle.profile.name) for ids, vehicle in _heard(hardware))
        return NoTableError(f"no PX4 was heard, and only PX4 has a table of its events: {others}")
    first = _named(px4[0], "PX4")
    if all(ids in given_up for ids in px4):
        return NoTableError(f"{first}, does not provide the table of its events: {given_up[px4[0]]}")
    if known >= OFFERED_BY and not any(ids in offers for ids in px4):
        return NoTableError(f"{first}, does not send COMPONENT_METADATA: PX4 has it from 1.13 on")
    return None


def _heard(hardware: MavlinkHardware) -> list[tuple[tuple[int, int], VehicleState]]:
    vehicles = hardware.vehicles.vehicles
    return [(v.ids, v.state) for v in vehicles if v.ids is not None and v.state is not None]


def _named(ids: tuple[int, int], name: str | None) -> str:
    return "vehicle {}.{}, {}".format(*ids, name or "an unknown autopilot")


def _alone(config: Config) -> Config:
    """The configuration with its links, and nothing else."""
    bare = silent(config)
    return dataclasses.replace(bare, outs=(), interfaces=(), record=None, forward=False, requests="missing")


def _share(hardware: MavlinkHardware) -> float:
    """The share of the table that has arrived."""
    found = [hardware.tables.progress(ids) for ids in hardware.tables.offers]
    return max((arrived / size for arrived, size in filter(None, found) if size), default=0.0)


def as_xz(data: bytes) -> bytes:
    """The file of a table as xz."""
    return data if data.startswith(metadata.XZ) else lzma.compress(data)


def as_json(data: bytes) -> bytes:
    """The file of a table unpacked."""
    return metadata.unpacked(data, MOST_UNPACKED)
