"""The diagnosis: an ordered table of cases. Maps the findings on a connection to a fault and the next action.

The first case that applies is the diagnosis. A fault that hides other faults comes before them. Pure functions.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple

from ...json_object import JsonObject
from .advice import (
    OTHER_SYSTEM,
    available,
    behind_satellite,
    forward,
    heartbeats,
    let_send,
    listed,
    look,
    missing_heartbeats,
    named_all,
    other_rate,
    others_only,
    own,
    pick_device,
    protocol,
    stream_sys_status,
    use_mavlink_2,
)
from .findings import LEAST_HEARTBEATS, SYS_STATUS, Findings, Speaker

Test = Callable[[Any], object]
Words = Callable[[Any], str]


WRONG_CLOCK: Final = 5.0
"""Largest normal difference in seconds between a vehicle's clock and ours. A slow link delays by less."""


class Diagnosis(NamedTuple):
    """The fault of a connection."""

    cause: str
    ok: bool
    """Whether a status is available."""
    matter: str
    """The finding, in one line."""
    next: str
    """The next action."""

    def text(self, of: str, remarks: Iterable[str]) -> list[str]:
        """The finding of a connection `of`, the remarks and the next action, as lines."""
        return [f"{of}: {self.matter} [{self.cause}]", *(f"  {line}" for line in remarks), f"next: {self.next}"]

    def members(self, remarks: Iterable[str]) -> JsonObject:
        """The same in JSON. Members and causes are stable; the wording of `found` and `next` is not."""
        return {"cause": self.cause, "ok": self.ok, "found": [self.matter, *remarks], "next": self.next}


class Case(NamedTuple):
    """One row of a table: of MAVLink connections, arms or ROS 2. The functions get the findings there."""

    cause: str
    meaning: str
    """The row of the reference page."""
    applies: Test
    matter: Words
    next: Words
    spoils: bool = False
    """True if the fault makes an available status unreliable."""


def first_case(cases: Sequence[Case], findings: object, able: bool) -> Diagnosis:
    """The first case that applies. `able`: whether a status is available."""
    case = next(case for case in cases if case.applies(findings))
    return Diagnosis(case.cause, able and not case.spoils, case.matter(findings), case.next(findings))


def diagnose(f: Findings) -> Diagnosis:
    """The first case that applies to a MAVLink connection."""
    return first_case(CASES, f, f.able)


def _failed(*numbers: int) -> Test:
    """The link could not be opened, with one of these errnos."""
    return lambda f: f.trouble is not None and (not numbers or f.trouble.number in numbers)


def _refusal(f: Findings) -> str:
    return f.trouble.text.partition("; ")[0] if f.trouble else ""


def _remedy(otherwise: str) -> Words:
    """The advice in the error message."""
    return lambda f: (f.trouble.text.partition("; ")[2] if f.trouble else "") or otherwise


def _silent(*transports: str, listens: bool = False, trouble: tuple[str, ...] = ()) -> Test:
    """No input on a link of these transports, with one of these troubles."""

    def test(f: Findings) -> bool:
        kind = f.url.kind
        there = kind.transport in transports and kind.listens == listens
        return f.size == 0 and there and (not trouble or f.place.trouble in trouble)

    return test


def _no_mavlink(f: Findings) -> bool:
    return not f.counters.frames and not f.foreign


def _pilots(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.speakers if s.pilot)


def _conflicting(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.status is not None and s.status.strangers is not None)


def _who_speaks(f: Findings) -> str:
    one = _conflicting(f)[0]
    who = one.status.strangers.who if one.status and one.status.strangers else ""
    return f"two senders speak as vehicle {one.ids}: {who}"


def _other_system(f: Findings) -> str:
    status = _conflicting(f)[0].status
    mine = status.strangers.mine if status and status.strangers else None
    return OTHER_SYSTEM + (f"; if one of them is yours, name it: {mine}" if mine else "")


def _late(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.status is not None and s.status.lag)


def _how_late(f: Findings) -> str:
    one = _late(f)[0]
    return f"vehicle {one.ids} is heard {one.status.lag if one.status else 0:.1f} s late: what is that old is unknown"


def _seldom(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if heartbeats(s) < LEAST_HEARTBEATS and not s.seldom)


def _without_sys_status(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if SYS_STATUS not in s.counts and not s.seldom)


def _by_high_latency(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.seldom)


def _old(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.frames_v1 == s.frames)


def _off(f: Findings) -> tuple[Speaker, ...]:
    """Live links only: another computer may have stamped a log."""
    live = f.vehicles if not f.url.kind.is_log else ()
    return tuple(s for s in live if s.clock_off is not None and abs(s.clock_off) > WRONG_CLOCK)


CASES: Final = (
    # the link cannot be opened
    Case("port-taken", "another program has the port",
         _failed(errno.EADDRINUSE), _refusal, _remedy("stop the other program")),
    Case("no-permission", "no permission to open the port or the device",
         _failed(errno.EACCES, errno.EPERM), _refusal, _remedy("ask its owner for permission")),
    Case("cannot-open", "the link cannot be opened for another reason",
         _failed(), _refusal, _remedy("write another connection")),
    # no input
    Case("device-missing", "this serial device does not exist",
         _silent("serial", trouble=("missing",)),
         lambda f: f"there is no {f.url.device}; serial devices here: {', '.join(f.place.devices) or 'none'}",
         pick_device),
    Case("device-held", "another program has the serial device",
         lambda f: f.size == 0 and f.place.holder,
         lambda f: f"{f.url.device} is held by {f.place.holder}",
         lambda f: "end that program, or let it forward MAVLink over UDP"),
    Case("no-such-address", "listening on an address that this computer does not have",
         _silent("udp", "tcp", listens=True, trouble=("not ours",)),
         lambda f: f"this computer has no address {f.url.host}; it has {', '.join(f.place.addresses) or 'none yet'}",
         lambda f: f"listen on one of its addresses, or on all: {f.url.text.replace(f.url.host, '0.0.0.0')}"),
    Case("unknown-name", "the name of the other end is unknown",
         _silent("udp", "tcp", trouble=("unknown name",)),
         lambda f: f"the name {f.url.host} is unknown", lambda f: "check the name, or write the address"),
    Case("elsewhere", "no MAVLink arrives here, but it does on another port or at another baud rate",
         lambda f: _no_mavlink(f) and f.place.elsewhere,
         lambda f: f"no MAVLink arrives here, but it does on {f.place.elsewhere}",
         lambda f: f"{'add the sender to from=, or ' if f.url.senders else ''}write {f.place.elsewhere}"),
    Case("udp-silent", "listening on UDP, and nothing is sent to this port",
         _silent("udp", listens=True),
         lambda f: f"nothing was sent to UDP port {f.url.port} within {f.seconds:.1f} s", let_send),
    Case("must-speak", "sending to UDP with `--passive`: the other end does not know our address",
         lambda f: _silent("udp")(f) and f.passive,
         lambda f: "--passive: nothing was sent, so the other end does not know our address",
         lambda f: "remove --passive"),
    Case("udp-refused", "nothing listens on that UDP port",
         _silent("udp", trouble=("refused",)),
         lambda f: f"{f.url.where()} refuses datagrams: nothing listens on that UDP port",
         lambda f: f"start the program that should listen there; if it sends first, write udp:0.0.0.0:{f.url.port}"),
    Case("no-answer", "sending to UDP, without an answer",
         _silent("udp"),
         lambda f: f"{f.url.where()} does not answer within {f.seconds:.1f} s to our heartbeat",
         lambda f: f"check the address and its firewall; if it sends first, write udp:0.0.0.0:{f.url.port}"),
    Case("tcp-refused", "nothing listens on that TCP port",
         _silent("tcp", trouble=("refused",)),
         lambda f: f"{f.url.where()} refuses the connection: nothing listens on that TCP port",
         lambda f: "start the server there, or write the port that it listens on"),
    Case("tcp-unreachable", "no answer from that address",
         _silent("tcp", trouble=("timeout", "unreachable")),
         lambda f: f"{f.url.where()} cannot be reached: {f.place.trouble}",
         lambda f: f"check the address and the route: ping {f.url.host}"),
    Case("tcp-silent", "the TCP connection is open, and nothing arrives",
         _silent("tcp"),
         lambda f: f"{f.url.where()} accepts the connection, but no byte arrived within {f.seconds:.1f} s",
         lambda f: "check that MAVLink is on this port; end other clients if the server serves only one"),
    Case("nobody-connects", "a TCP server here, and nothing arrives",
         _silent("tcp", listens=True),
         lambda f: f"no client connected and sent data within {f.seconds:.1f} s",
         lambda f: f"let the other end connect to {own(f)}, and let the firewall here pass TCP port {f.url.port}"),
    Case("serial-silent", "no byte arrives from the serial device",
         _silent("serial"),
         lambda f: f"no byte arrived from {f.url.device} within {f.seconds:.1f} s",
         lambda f: "check the power, TX to RX in both directions, and that the autopilot's port uses MAVLink "
         f"at {f.url.baud} baud"),
    # input, but no MAVLink
    Case("other-protocol", "bytes arrive, of another protocol: MSP, NMEA, a console, ...",
         lambda f: _no_mavlink(f) and protocol(f.head),
         lambda f: f"{f.size} bytes arrived, but no MAVLink: this is {p.name if (p := protocol(f.head)) else ''}",
         lambda f: p.next if (p := protocol(f.head)) else ""),
    Case("wrong-baud", "bytes arrive from the serial device, but no MAVLink: most likely another baud rate",
         lambda f: _no_mavlink(f) and f.url.kind.is_serial,
         lambda f: f"{f.size} bytes arrived at {f.url.baud} baud, but no MAVLink, nor at other usual rates",
         other_rate),
    Case("not-mavlink", "bytes arrive, but no MAVLink",
         _no_mavlink,
         lambda f: f"{f.size} bytes arrived, but no MAVLink; they begin with {f.head[:12].hex(' ')}",
         lambda f: "let the sender send plain MAVLink, without encryption or another protocol around it"),
    # MAVLink, but no status
    Case("other-dialect", "every frame of a needed message has a bad CRC: the sender defines it differently",
         lambda f: f.foreign,
         lambda f: f"the sender's definitions differ from MAVLink's: {listed(f.foreign)}",
         lambda f: "let the sender use MAVLink's definitions of these messages"),
    Case("no-autopilot", "MAVLink arrives, but no heartbeat of an autopilot: only ground stations, cameras, ...",
         lambda f: not _pilots(f),
         others_only, forward),
    Case("not-believed", "an autopilot is heard, but its frames are not signed with the given key",
         lambda f: f.signing and not f.vehicles,
         lambda f: f"{named_all(_pilots(f))} is not accepted: "
         + ("its frames are signed with another key" if f.counters.signed else "its frames are not signed"),
         lambda f: "give the vehicle's own key" if f.counters.signed else "set the vehicle up to sign with this key"),
    Case("other-system", "an autopilot is heard, but not the one that was asked for",
         lambda f: not f.vehicles,
         lambda f: f"system {', '.join(map(str, f.expected))} is not heard, but {named_all(_pilots(f))}",
         lambda f: f"write --system {_pilots(f)[0].system}, or give the vehicle the system id that is expected"),
    Case("two-vehicles", "two autopilots have the same ids",
         _conflicting,
         _who_speaks,
         _other_system,
         spoils=True),
    Case("late", "the vehicle is heard late: something on the way stores its frames",
         _late,
         _how_late,
         lambda f: "look for a radio or a program that stores frames, and let the vehicle send fewer of them",
         spoils=True),
    Case("signed", "the frames are signed, and there is no key",
         lambda f: f.counters.signed and not f.signing,
         lambda f: f"{f.counters.signed} of {f.counters.frames} frames are signed: they are not verified, and our "
         "unsigned requests are ignored",
         lambda f: "give the key with --signing-key FILE"),
    Case("few-heartbeats", "an autopilot is heard, but its heartbeats are too few",
         _seldom,
         lambda f: f"{heartbeats(_seldom(f)[0])} HEARTBEAT of {_seldom(f)[0].ids} arrived within {f.seconds:.1f} s",
         missing_heartbeats),
    Case("no-sys-status", "an autopilot is heard, but sends no SYS_STATUS",
         _without_sys_status,
         lambda f: f"vehicle {_without_sys_status(f)[0].ids} sends no SYS_STATUS"
         + (", although it was requested" if f.asked else "; it was not requested"),
         lambda f: stream_sys_status(f, _without_sys_status(f)[0])),
    # a status is available
    Case("high-latency", "the vehicle sends only HIGH_LATENCY2, as behind a satellite",
         _by_high_latency,
         lambda f: f"a status is available, but {_by_high_latency(f)[0].ids} is heard only through HIGH_LATENCY2: "
         "e_stopped and rest are never known, armed is known only for an ArduPilot, "
         "and the status is as old as link.heartbeat_age",
         behind_satellite),
    Case("mavlink-1", "the vehicle uses MAVLink 1: no extension fields, and no message ids over 255",
         _old,
         lambda f: f"a status is available, but {_old(f)[0].ids} uses MAVLink 1: no extension fields, no ROBOT_STATUS",
         lambda f: use_mavlink_2(_old(f)[0])),
    Case("wrong-clock", "this computer's clock and the vehicle's differ",
         _off,
         lambda f: f"a status is available, but the clocks of {_off(f)[0].ids} and of this computer, which stamps the "
         f"lines, differ by {abs(_off(f)[0].clock_off or 0):.0f} s",
         lambda f: "set this computer's clock (timedatectl set-ntp true), unless the vehicle's clock is the wrong one"),
    Case("ok", "a status is available",
         lambda f: True, available, look),
)  # fmt: skip
"""In the order of evaluation. The last one always applies."""
