"""What the log says of a vehicle. Each line is about a change; what a peer can cause again and again is paced."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Final

from ...interface import LinkState
from ...mavlink import definitions as mav
from .belief import Conflict, Speaker
from .facts import Facts
from .identity import named
from .senders import LATE, stranger
from .vehicle import TrackedVehicle

log = logging.getLogger(__name__)

PACE: Final = 30.0
"""Seconds between two log lines of one kind about one vehicle."""


def heard(tracked: TrackedVehicle, heartbeat: mav.Heartbeat) -> None:
    """It was heard for the first time."""
    names = named(mav.AUTOPILOT_NAMES, heartbeat.autopilot), named(mav.TYPE_NAMES, heartbeat.type)
    called = "" if tracked.name is None else f" '{tracked.name}'"
    log.info("heard vehicle %d.%d%s (%s, %s): handle '%s'", *_ids(tracked), called, *names, tracked.handle.name)


def exchanged(tracked: TrackedVehicle) -> None:
    """Another vehicle has its ids now."""
    log.warning("vehicle %d.%d: another vehicle has these ids now", *_ids(tracked))


def rebooted(tracked: TrackedVehicle) -> None:
    """It has rebooted."""
    log.info("vehicle %d.%d has rebooted", *_ids(tracked))


def link(tracked: TrackedVehicle, before: LinkState, after: LinkState, timeout: float) -> None:
    """Its link is lost, or back. `timeout` in seconds."""
    if after is LinkState.LOST and before is LinkState.CONNECTED:
        log.warning("lost vehicle %d.%d: nothing for %g s", *_ids(tracked), timeout)
    elif after is LinkState.CONNECTED and before is LinkState.LOST:
        log.info("vehicle %d.%d is back", *_ids(tracked))


def applet(tracked: TrackedVehicle, facts: Facts) -> None:
    """Its applet is heard now, or is silent. `facts` are the new ones."""
    was_heard = tracked.facts.applet.is_heard if tracked.facts else False
    if facts.applet.is_heard is was_heard or not facts.fresh.heartbeat:
        return
    if was_heard:
        log.warning("vehicle %d.%d: the applet is silent, e_stopped is deduced again", *_ids(tracked))
    else:
        log.info("vehicle %d.%d: the applet reports the emergency stop", *_ids(tracked))


def satellite(tracked: TrackedVehicle, sends_heartbeats: bool) -> None:
    """HIGH_LATENCY2 counts now, or HEARTBEATs do again."""
    if sends_heartbeats:
        log.info("vehicle %d.%d sends HEARTBEATs", *_ids(tracked))
    else:
        log.info("vehicle %d.%d is heard only through HIGH_LATENCY2: nothing is sent to it", *_ids(tracked))


def conflict(tracked: TrackedVehicle, found: Conflict, speakers: Sequence[Speaker]) -> None:
    """Two autopilots use its ids; one line for each conflict."""
    if tracked.conflict_since is found.since:
        return
    tracked.conflict_since = found.since
    channels = (count.channel for one in speakers for count in one.counts if count.channel is not None)
    where = " and ".join(dict.fromkeys(map(str, channels)))
    log.warning("two autopilots use the ids %d.%d%s (%s)", *_ids(tracked), where and f": {where}", found.why)


def strangers(tracked: TrackedVehicle, main: Speaker, rivals: Sequence[Speaker], now: float) -> None:
    """Who else speaks with its ids, and what ends that."""
    found = stranger(main, rivals, now) if now >= tracked.tell_strangers_at else None
    if found is None:
        return
    tracked.tell_strangers_at = now + PACE
    mine = f"If one of them is yours, name it: {found.mine}"
    rename = "Give each autopilot its own system id (SYSID_THISMAV)."
    log.warning("Two senders speak as vehicle %d.%d: %s. %s", *_ids(tracked), found.who, mine if found.mine else rename)


def late(tracked: TrackedVehicle, main: Speaker, now: float) -> None:
    """It is heard late."""
    if main.lag <= LATE or now < tracked.tell_late_at:
        return
    tracked.tell_late_at = now + PACE
    where = f" on {main.channel}" if main.channel is not None else ""
    log.warning(
        "vehicle %d.%d is heard %.1f s late%s: what is older than its time-out is unknown. Look for a radio or a "
        "program that stores frames",
        *_ids(tracked),
        main.lag,
        where,
    )


def _ids(tracked: TrackedVehicle) -> tuple[int, int]:
    return tracked.ids or (0, 0)
