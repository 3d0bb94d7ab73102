"""From what was found on a connection to what is wrong with it and what to do next: a table of cases, in order.

The first case that applies is the diagnosis, so what hides everything else stands first. Pure.
"""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING, Final, NamedTuple

from .advice import (
    OTHER_SYSTEM,
    beats,
    let_send,
    listed,
    more_beats,
    named_all,
    other_rate,
    own,
    pick_device,
    protocol,
    run,
    speak_mavlink_2,
    stream_sys_status,
)
from .findings import BEATS, SYS_STATUS

if TYPE_CHECKING:
    from collections.abc import Callable

    from .findings import Findings, Speaker

    Test = Callable[[Findings], object]
    Words = Callable[[Findings], str]

WRONG_CLOCK: Final = 5.0
"""Seconds by which a vehicle's clock and ours may differ: slow links delay by less."""


class Diagnosis(NamedTuple):
    """What is the matter."""

    cause: str
    ok: bool
    """Whether a status can be had."""
    matter: str
    """What was found, in one line."""
    next: str
    """What to do."""


class Case(NamedTuple):
    """One row of the table."""

    cause: str
    meaning: str
    """For the document."""
    applies: Test
    matter: Words
    next: Words
    spoils: bool = False
    """Whether a status that can be had all the same is not to be believed."""


def diagnose(f: Findings) -> Diagnosis:
    """The first case that applies."""
    case = next(case for case in CASES if case.applies(f))
    return Diagnosis(case.cause, f.able and not case.spoils, case.matter(f), case.next(f))


def _failed(*numbers: int) -> Test:
    """The link could not be opened, for one of these reasons."""
    return lambda f: f.trouble is not None and (not numbers or f.trouble.number in numbers)


def _refusal(f: Findings) -> str:
    return f.trouble.text.partition("; ")[0] if f.trouble else ""


def _remedy(otherwise: str) -> Words:
    """What the error itself says is to be done."""
    return lambda f: (f.trouble.text.partition("; ")[2] if f.trouble else "") or otherwise


def _silent(*kinds: str, trouble: tuple[str, ...] = ()) -> Test:
    """Nothing came on a link of these kinds, for one of these reasons."""
    return lambda f: f.size == 0 and f.url.kind in kinds and (not trouble or f.place.trouble in trouble)


def _no_mavlink(f: Findings) -> bool:
    return not f.counters.frames and not f.foreign


def _pilots(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.speakers if s.pilot)


def _twins(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.twins)


def _seldom(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if beats(s) < BEATS)


def _speechless(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if SYS_STATUS not in s.counts)


def _old(f: Findings) -> tuple[Speaker, ...]:
    return tuple(s for s in f.vehicles if s.frames_v1 == s.frames)


def _off(f: Findings) -> tuple[Speaker, ...]:
    """Not in a log, which another computer may have stamped."""
    live = f.vehicles if f.url.kind != "log" else ()
    return tuple(s for s in live if s.clock_off is not None and abs(s.clock_off) > WRONG_CLOCK)


_UDP = "udpout", "udpbcast"
CASES: Final = (
    # the link cannot be opened
    Case("port-taken", "another program has the port",
         _failed(errno.EADDRINUSE), _refusal, _remedy("stop the other program")),
    Case("no-permission", "the port or the device may not be opened",
         _failed(errno.EACCES, errno.EPERM), _refusal, _remedy("let its owner permit it")),
    Case("cannot-open", "the link cannot be opened for another reason",
         _failed(), _refusal, _remedy("write another connection")),
    # nothing comes
    Case("device-missing", "there is no such serial device",
         _silent("serial", trouble=("missing",)),
         lambda f: f"there is no {f.url.device}; serial devices here: {', '.join(f.place.devices) or 'none'}",
         pick_device),
    Case("device-held", "another program has the serial device",
         lambda f: f.size == 0 and f.place.holder,
         lambda f: f"{f.url.device} is held by {f.place.holder}",
         lambda f: "end that program, or let it pass MAVLink on by UDP"),
    Case("no-such-address", "listening on an address that this computer does not have",
         _silent("udpin", "tcpin", trouble=("not ours",)),
         lambda f: f"this computer has no address {f.url.host}; it has {', '.join(f.place.addresses) or 'none yet'}",
         lambda f: f"listen on one of its own, or on all: {f.url.text.replace(f.url.host, '0.0.0.0')}"),
    Case("unknown-name", "the name of the other end is not known",
         _silent(*_UDP, "tcp", trouble=("unknown name",)),
         lambda f: f"the name {f.url.host} is not known", lambda f: "check the name, or write the address"),
    Case("elsewhere", "no MAVLink comes here, but it does to another port or at another baud rate",
         lambda f: _no_mavlink(f) and f.place.elsewhere,
         lambda f: f"no MAVLink comes here, but it does with {f.place.elsewhere}",
         lambda f: f"write {f.place.elsewhere}"),
    Case("udp-silent", "listening on UDP, and nothing is sent to this port",
         _silent("udpin"),
         lambda f: f"nothing was sent to UDP port {f.url.port} within {f.seconds:.1f} s", let_send),
    Case("must-speak", "sending to UDP with `--passive`: nobody knows where to answer to",
         lambda f: _silent(*_UDP)(f) and f.passive,
         lambda f: "because of --passive nothing was sent, so nobody knows where to answer to",
         lambda f: "leave --passive away"),
    Case("udp-refused", "nothing listens on that UDP port",
         _silent(*_UDP, trouble=("refused",)),
         lambda f: f"{f.url.where()} refuses what is sent: nothing listens on that UDP port",
         lambda f: f"start what should listen there; if it sends by itself, write udp:0.0.0.0:{f.url.port}"),
    Case("no-answer", "sending to UDP, and nobody answers",
         _silent(*_UDP),
         lambda f: f"{f.url.where()} does not answer within {f.seconds:.1f} s, though our heartbeat was sent there",
         lambda f: f"check the address and the firewall there; if it sends by itself, write udp:0.0.0.0:{f.url.port}"),
    Case("tcp-refused", "nothing listens on that TCP port",
         _silent("tcp", trouble=("refused",)),
         lambda f: f"{f.url.where()} refuses the connection: nothing listens on that TCP port",
         lambda f: "start the server there, or write the port that it listens on"),
    Case("tcp-unreachable", "no answer at all from that address",
         _silent("tcp", trouble=("timeout", "unreachable")),
         lambda f: f"{f.url.where()} cannot be reached: {f.place.trouble}",
         lambda f: f"check the address and the way there: ping {f.url.host}"),
    Case("tcp-silent", "the TCP connection is made, and nothing comes",
         _silent("tcp"),
         lambda f: f"{f.url.where()} takes the connection, but no byte came within {f.seconds:.1f} s",
         lambda f: "check that MAVLink is on this port; end other clients if the server serves only one"),
    Case("nobody-connects", "being a TCP server, and nothing comes",
         _silent("tcpin"),
         lambda f: f"nobody connected and sent anything within {f.seconds:.1f} s",
         lambda f: f"let the other end connect to {own(f)}, and the firewall here pass TCP port {f.url.port}"),
    Case("serial-silent", "no byte comes from the serial device",
         _silent("serial"),
         lambda f: f"no byte came from {f.url.device} within {f.seconds:.1f} s",
         lambda f: f"check power, TX to RX both ways, and that the port there speaks MAVLink at {f.url.baud} baud"),
    # bytes come
    Case("other-protocol", "bytes come, of another protocol: MSP, NMEA, a console, ...",
         lambda f: _no_mavlink(f) and protocol(f.head),
         lambda f: f"{f.size} bytes came, but no MAVLink: it is {p.name if (p := protocol(f.head)) else ''}",
         lambda f: p.next if (p := protocol(f.head)) else ""),
    Case("wrong-baud", "bytes come from the serial device, but no MAVLink: most likely another baud rate",
         lambda f: _no_mavlink(f) and f.url.kind == "serial",
         lambda f: f"{f.size} bytes came at {f.url.baud} baud, but no MAVLink, neither at the other usual rates",
         other_rate),
    Case("not-mavlink", "bytes come, but no MAVLink",
         _no_mavlink,
         lambda f: f"{f.size} bytes came, but no MAVLink; they begin with {f.head[:12].hex(' ')}",
         lambda f: "let the sender speak plain MAVLink, not encrypted, and with no other protocol around it"),
    # MAVLink comes
    Case("other-dialect", "every frame of a message that a status needs has a bad CRC: it is defined otherwise there",
         lambda f: f.foreign,
         lambda f: f"the sender defines otherwise than MAVLink: {listed(f.foreign)}",
         lambda f: "let the sender use MAVLink's own definitions of these"),
    Case("no-autopilot", "MAVLink comes, but no autopilot's heartbeat: only ground stations, cameras, ...",
         lambda f: not _pilots(f),
         lambda f: f"no autopilot is heard, only {named_all(f.speakers)}",
         lambda f: "let the router pass on here what the autopilot sends, its HEARTBEAT first of all"),
    Case("not-believed", "an autopilot is heard, but its frames are not signed with the key that was given",
         lambda f: f.signing and not f.vehicles,
         lambda f: f"{named_all(_pilots(f))} is not believed: "
         + ("its frames are signed with another key" if f.counters.signed else "its frames are not signed"),
         lambda f: "give the vehicle's own key" if f.counters.signed else "set the vehicle up to sign with this key"),
    Case("other-system", "an autopilot is heard, but not the one that was asked for",
         lambda f: not f.vehicles,
         lambda f: f"system {', '.join(map(str, f.expected))} is not heard, but {named_all(_pilots(f))}",
         lambda f: f"write --system {_pilots(f)[0].system}, or give the vehicle the system id that is expected"),
    Case("two-vehicles", "two autopilots have the same ids",
         _twins,
         lambda f: f"two autopilots speak as {_twins(f)[0].ids}: {_twins(f)[0].twins}",
         lambda f: OTHER_SYSTEM,
         spoils=True),
    Case("signed", "the frames are signed, and there is no key",
         lambda f: f.counters.signed and not f.signing,
         lambda f: f"{f.counters.signed} of {f.counters.frames} frames are signed: they are not verified, and what we "
         "ask unsigned is ignored",
         lambda f: "give the key with --signing-key FILE"),
    Case("few-heartbeats", "an autopilot is heard, but its heartbeats are too few",
         _seldom,
         lambda f: f"{beats(_seldom(f)[0])} HEARTBEAT of {_seldom(f)[0].ids} came within {f.seconds:.1f} s",
         more_beats),
    Case("no-sys-status", "an autopilot is heard, but sends no SYS_STATUS",
         _speechless,
         lambda f: f"vehicle {_speechless(f)[0].ids} sends no SYS_STATUS"
         + (", although it was asked for" if f.asked else "; it was not asked for"),
         lambda f: stream_sys_status(f, _speechless(f)[0])),
    # a status can be had
    Case("mavlink-1", "the vehicle speaks MAVLink 1: no extension fields, and no message ids over 255",
         _old,
         lambda f: f"a status can be had, but {_old(f)[0].ids} speaks MAVLink 1: no extension fields, no ROBOT_STATUS",
         lambda f: speak_mavlink_2(_old(f)[0])),
    Case("wrong-clock", "this computer's clock and the vehicle's differ",
         _off,
         lambda f: f"a status can be had, but the clocks of {_off(f)[0].ids} and of this computer, which stamps the "
         f"lines, differ by {abs(_off(f)[0].clock_off or 0):.0f} s",
         lambda f: "set this computer's clock (timedatectl set-ntp true), unless it is the vehicle's that is wrong"),
    Case("ok", "a status can be had",
         lambda f: True, lambda f: "a status can be had", run),
)  # fmt: skip
"""In the order in which they are tried; the last always applies."""
