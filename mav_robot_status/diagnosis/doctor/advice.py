"""The texts of the advice: recognises other protocols, names the settings of the autopilots.

The settings are those of ArduPilot's and PX4's parameter lists (ArduPilot renamed its own in 4.7), and of INAV's and
Betaflight's command lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from ...clock import rfc3339
from ...mavlink import definitions as mav
from ...mavlink.counters import OTHER_IDS
from ...mavlink.enumerations import MAV_AUTOPILOT_ARDUPILOTMEGA, MAV_AUTOPILOT_PX4
from ..vehicle_reports import PAGE, WORDS
from .findings import HEARTBEAT, Findings, Speaker
from .heard import duration

BROKEN: Final = 50.0
"""From this percentage of lost frames on, the advice is to repair the link first."""
EVERY_ADDRESS: Final = ("0.0.0.0", "::")
LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")


class Protocol(NamedTuple):
    """A protocol that may be found instead of MAVLink."""

    name: str
    pattern: re.Pattern[bytes]
    next: str


_TO_MAVLINK: Final = "set this port of the autopilot to MAVLink"
_TO_AUTOPILOT: Final = "connect to the autopilot instead: that is its GPS"
_OTHER_PORT: Final = "name the port that MAVLink is on"
PROTOCOLS: Final = (
    Protocol("MSP", re.compile(rb"\$[MX][<>!]"), f"{_TO_MAVLINK} (Betaflight, INAV: telemetry MAVLINK on this UART)"),
    Protocol("NMEA", re.compile(rb"\$(G[PNLAB]|BD)[A-Z]{3},"), _TO_AUTOPILOT),
    Protocol("u-blox", re.compile(rb"\xb5b[\x01-\x29][\x00-\x7f]"), _TO_AUTOPILOT),
    Protocol("LTM", re.compile(rb"\$T[AGNOSX]"), _TO_MAVLINK),
    Protocol("SSH", re.compile(rb"\ASSH-"), _OTHER_PORT),
    Protocol("HTTP", re.compile(rb"\AHTTP/|<html", re.IGNORECASE), _OTHER_PORT),
    Protocol("a console's text", re.compile(rb"\A[\t\r\n\x1b\x20-\x7e]{16,}\Z"), f"{_TO_MAVLINK}; it is a console now"),
)
"""The most certain first."""


def protocol(head: bytes) -> Protocol | None:
    """The protocol of these bytes, if it is a known one."""
    return next((p for p in PROTOCOLS if p.pattern.search(head)), None)


def message_name(message_id: int) -> str:
    """`1 SYS_STATUS`, or the number of a message that we do not read."""
    if message_id == OTHER_IDS:
        return "others"
    definition = mav.MESSAGES.get(message_id)
    return f"{message_id} {definition.name}" if definition else str(message_id)


def listed(counts: Mapping[int, int]) -> str:
    """Messages with their counts."""
    return ", ".join(f"{message_name(i)} ({n} times)" for i, n in sorted(counts.items()))


def named_all(speakers: Iterable[Speaker]) -> str:
    """The components, by id and type."""
    return ", ".join(s.words for s in speakers) or "nobody"


def own(f: Findings) -> str:
    """The addresses at which others reach this connection."""
    if f.url.host not in EVERY_ADDRESS or not f.place.addresses:
        return f.url.where()
    return " or ".join(f"{address}:{f.url.port}" for address in f.place.addresses)


def let_send(f: Findings) -> str:
    """The advice for a silent UDP port."""
    if f.url.host in LOOPBACK:
        others = f"udp:0.0.0.0:{f.url.port}"
        return f"let a program on this computer send to {f.url.where()}; for other computers write {others}"
    return f"let the sender send to {own(f)}, and let this computer's firewall pass UDP port {f.url.port}"


def pick_device(f: Findings) -> str:
    """The advice for a missing device."""
    devices = f.place.devices
    if not devices:
        return "plug it in; dmesg shows whether the system detects it"
    return f"write {devices[0]}" if len(devices) == 1 else "write one of those"


def other_rate(f: Findings) -> str:
    """The advice for a serial device that sends bytes but no MAVLink at any usual rate."""
    return f"write the baud rate of the autopilot's port: {f.url.device},RATE (ArduPilot: SERIALn_BAUD)"


def missing_heartbeats(f: Findings) -> str:
    """The advice for missing heartbeats."""
    if f.loss >= BROKEN:
        return f"repair the link first: {f.loss:.0f} % of the frames are lost"
    return "let the autopilot send HEARTBEAT once a second"


def heartbeats(speaker: Speaker) -> int:
    """The number of heartbeats."""
    return speaker.counts.get(HEARTBEAT, 0)


def stream_sys_status(f: Findings, vehicle: Speaker) -> str:
    """The advice for a missing SYS_STATUS."""
    if f.passive and not f.url.kind.is_log:
        return "remove --passive, so that it is requested"
    return _SYS_STATUS.get(vehicle.autopilot or 0, "let the autopilot send SYS_STATUS once a second")


def use_mavlink_2(vehicle: Speaker) -> str:
    """The advice for a vehicle that uses MAVLink 1."""
    return _MAVLINK_2.get(vehicle.autopilot or 0, "set the autopilot to MAVLink 2")


def behind_satellite(f: Findings) -> str:
    """The advice for a vehicle that sends only HIGH_LATENCY2."""
    if f.url.kind.is_log:
        return run(f)
    return f"{run(f)}; if the link is not a satellite, let the autopilot send HEARTBEAT there"


def run(f: Findings) -> str:
    """The command that publishes the statuses, and advice to install the applet if it would help."""
    command = f"mav-robot-status {f.url.text}" + (" --passive" if f.passive and not f.url.kind.is_log else "")
    return command + (APPLET_ADVICE if any(s.needs_applet for s in f.vehicles) else "")


def available(f: Findings) -> str:
    """Says that a status is available; for a log that ends in silence, when its vehicles were heard."""
    if not any(s.silent for s in f.vehicles):
        return "a status is available"
    first, *others = f.vehicles
    if first.silent and not others:
        silence = duration(first.silent.silence)
        return f"the autopilot {first.ids} was heard for {first.silent.words}; the log ends {silence} later in silence"
    told = (f"{s.ids} for {s.heard.words}, {_end(s.heard.silence)}" for s in f.vehicles if s.heard)
    return f"{len(f.vehicles)} autopilots were heard: {'; '.join(told)}"


def _end(silence: float) -> str:
    return f"then silent for {duration(silence)} until the log ends" if silence else "until the log ends"


def look(f: Findings) -> str:
    """The next command for a connection without a fault; for a log that ends in silence, it shows the last status."""
    last = max((s.silent.until_us for s in f.vehicles if s.silent), default=None)
    if last is None or not all(s.silent for s in f.vehicles):
        return run(f)
    return f"mav-robot-status explain {f.url.text} --at {rfc3339(last)}"


def others_only(f: Findings) -> str:
    """Says that no autopilot is heard, and who is heard instead."""
    if f.url.kind.is_log:
        return f"the log has no heartbeat of an autopilot, only {named_all(f.speakers)}"
    return f"no autopilot is heard, only {named_all(f.speakers)}"


def forward(f: Findings) -> str:
    """The advice for a connection without an autopilot."""
    if f.url.kind.is_log:
        return "record where the autopilot is heard: mav-robot-status CONNECTION --record FILE.tlog"
    return "let the router forward the autopilot's messages here, at least HEARTBEAT"


def applet_heard(vehicle: Speaker) -> Iterator[str]:
    """Whether the applet on an ArduPilot is heard; nothing for other autopilots."""
    report = vehicle.applet
    if report is not None:
        since = "" if report.fresh else f"; silent for {report.age:.0f} s"
        yield f"applet: RS_STOP {report.value}, {WORDS[report.value]}{since}"
    elif vehicle.status is not None and vehicle.status.can_run_applet:
        yield "applet: not heard" + (
            "; without it an ArduPilot may show an emergency stop in no message" if vehicle.needs_applet else ""
        )


APPLET_ADVICE: Final = "; for an e_stopped that is always known, put the applet on the autopilot: " + PAGE
OTHER_SYSTEM: Final = (
    "give one of them another system id (ArduPilot: SYSID_THISMAV, from 4.7 on MAV_SYSID; PX4: MAV_SYS_ID)"
)
_SYS_STATUS: Final = {
    MAV_AUTOPILOT_ARDUPILOTMEGA: "set SRn_EXT_STAT to 2, where n is the number of the MAVLink port, from 0 "
    "(from ArduPilot 4.7 on MAVn_EXT_STAT, from 1; INAV, Betaflight: mavlink_ext_status_rate)",
    MAV_AUTOPILOT_PX4: "turn the stream on: mavlink stream -d DEVICE -s SYS_STATUS -r 1 (on UDP -u PORT)",
}
_MAVLINK_2: Final = {
    MAV_AUTOPILOT_ARDUPILOTMEGA: "set SERIALn_PROTOCOL of this port to 2, which is MAVLink 2 "
    "(INAV: mavlink_version = 2)",
    MAV_AUTOPILOT_PX4: "set MAV_PROTO_VER to 2",
}
