"""The findings on one connection, as a value: components, messages, rates and faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from ...hardware.mavlink.autopilots.wanted import Wanted
from ...hardware.mavlink.estop.applet import FRESH
from ...hardware.mavlink.identity import named
from ...hardware.mavlink.senders import LATE, Sender, Strangers
from ...links.url import Url
from ...mavlink import definitions as mav
from ...mavlink.counters import Counters
from .heard import Heard

HEARTBEAT, SYS_STATUS, HIGH_LATENCY2 = 0, 1, 235
GROUND_STATION: Final = 6  # MAV_TYPE
SAME_ID: Final = 3
"""This many bad frames of an id, without a good one, suggest another definition instead of noise."""
LEAST_HEARTBEATS: Final = 2


class Trouble(NamedTuple):
    """Why the link could not be opened."""

    text: str
    """The line of the error: the fault, and what to do."""
    number: int | None = None
    """The errno, if there is one."""


class Place(NamedTuple):
    """The state of a silent connection on this computer."""

    trouble: str = ""
    """Of the other end: "refused", "timeout", "unreachable", "unknown name". Of a device: "missing". Of a local
    address: "not ours". Empty: no trouble found."""
    holder: str = ""
    """The process that holds the serial device: `mavproxy.py (pid 1234)`."""
    addresses: tuple[str, ...] = ()
    """The addresses of this computer."""
    devices: tuple[str, ...] = ()
    """The serial devices of this computer."""
    elsewhere: str = ""
    """Another connection, on which MAVLink was received."""


NOWHERE: Final = Place()


class AppletReport(NamedTuple):
    """The last report of the applet on an ArduPilot."""

    value: int
    """The value of RS_STOP."""
    age: float
    """Seconds from it to the last frame of the vehicle."""

    @property
    def fresh(self) -> bool:
        """Whether the applet still reports."""
        return self.age <= FRESH


class VehicleStatus(NamedTuple):
    """The gateway's view of a vehicle."""

    flight_mode: str | None
    fields: Mapping[str, str | bool | None]
    """The values by field, as in a JSON line."""
    errors: tuple[str, ...]
    inhibits: tuple[str, ...]
    wanted: tuple[Wanted, ...]
    """The messages that the status of this vehicle needs."""
    firmware: str | None = None
    """The version of its firmware."""
    costly: bool = False
    """Whether it is heard only through HIGH_LATENCY2."""
    name: str | None = None
    """What people call it."""
    can_run_applet: bool = False
    """Whether its autopilot is ArduPilot, which can run the applet."""
    senders: tuple[Sender, ...] = ()
    """Those that speak as it, if there are several or if it is late. The first one is believed."""
    strangers: Strangers | None = None
    """The evidence that two senders use its ids."""
    next: Mapping[str, str] = MappingProxyType({})
    """What would make each unknown field known."""

    @property
    def lag(self) -> float:
        """Seconds by which it is heard late; 0 if that is too little to matter."""
        return self.senders[0].lag if self.senders and self.senders[0].lag > LATE else 0.0


class Speaker(NamedTuple):
    """One component that sent something with a good CRC."""

    system: int
    component: int
    autopilot: int | None = None
    """MAV_AUTOPILOT; None without a heartbeat."""
    type: int | None = None
    """MAV_TYPE."""
    counts: Mapping[int, int] = {}
    """Messages by id."""
    rates: Mapping[int, float] = {}
    """Hz by id, for messages that arrived more than once."""
    frames: int = 0
    frames_v1: int = 0
    pilot: bool = False
    """Whether it is a vehicle's autopilot."""
    clock_off: float | None = None
    """Seconds by which its clock is ahead of ours; None if it does not know the time."""
    applet: AppletReport | None = None
    """None if the applet was not heard."""
    status: VehicleStatus | None = None
    """None if it has no handle."""
    heard: Heard | None = None
    """When it was heard, in a log; None on a live connection, and without a handle."""

    @property
    def ids(self) -> str:
        """`1.1`, the system and the component."""
        return f"{self.system}.{self.component}"

    @property
    def words(self) -> str:
        """`255.190 GCS`, or `1.154 without a heartbeat`."""
        kind = "without a heartbeat" if self.type is None else named(mav.TYPE_NAMES, self.type)
        return f"{self.ids} {kind}"

    @property
    def wanted(self) -> dict[str, float | None]:
        """Hz by name, for its heartbeat and the messages that a status needs. None: received once. 0: never."""
        if self.seldom:
            return {mav.MESSAGES[HIGH_LATENCY2].name: self.rates.get(HIGH_LATENCY2)}
        needed: list[tuple[int, ...]] = [(HEARTBEAT,)]
        for one in self.status.wanted if self.status else ():
            needed.append((one.id,) if one.instead is None else (one.id, one.instead))
        wanted: dict[str, float | None] = {}
        for ids in needed:
            came = next((i for i in ids if i in self.counts), None)
            name = mav.MESSAGES[ids[0] if came is None else came].name
            wanted[name] = 0.0 if came is None else self.rates.get(came)
        return wanted

    @property
    def seldom(self) -> bool:
        """Whether it is a vehicle that is heard only through HIGH_LATENCY2."""
        return self.status is not None and self.status.costly

    @property
    def needs_applet(self) -> bool:
        """Whether the applet is not heard, and would make an unknown `e_stopped` known."""
        status = self.status
        if status is None or not status.can_run_applet or (self.applet is not None and self.applet.fresh):
            return False
        return (self.silent.last if self.silent else status).fields.get("e_stopped") is None

    @property
    def silent(self) -> Heard | None:
        """When it was heard, if it is silent when the log ends."""
        return self.heard if self.heard is not None and self.heard.silence else None

    @property
    def missing(self) -> tuple[str, ...]:
        """The names of needed messages that were not received."""
        return tuple(name for name, hz in self.wanted.items() if hz == 0.0)


@dataclass(frozen=True)
class Findings:
    """All findings on one connection."""

    url: Url
    words: str
    """The action, `listening on 127.0.0.1:14550/udp`."""
    passive: bool = False
    asked: bool = False
    """Whether missing messages were requested, and had time to arrive."""
    signing: bool = False
    """Whether there is a key to verify signatures with."""
    seconds: float = 0.0
    """Duration of the listening."""
    size: int = 0
    """Bytes received."""
    head: bytes = b""
    counters: Counters = field(default_factory=Counters)
    good: Mapping[int, int] = field(default_factory=dict)
    """Frames with a good CRC by id."""
    dropped: int = 0
    """Messages that could not be sent, and datagrams that the kernel dropped."""
    sources: tuple[str, ...] = ()
    """Source addresses, on links that can have several peers."""
    speakers: tuple[Speaker, ...] = ()
    expected: tuple[int, ...] = ()
    """System ids that the user expects; empty: any."""
    trouble: Trouble | None = None
    place: Place = NOWHERE

    @property
    def vehicles(self) -> tuple[Speaker, ...]:
        """The autopilots that have a handle."""
        return tuple(s for s in self.speakers if s.status is not None)

    @property
    def able(self) -> bool:
        """Whether every vehicle sends enough for a status."""
        return bool(self.vehicles) and all(
            s.seldom or (s.counts.get(HEARTBEAT, 0) >= LEAST_HEARTBEATS and SYS_STATUS in s.counts)
            for s in self.vehicles
        )

    @property
    def loss(self) -> float:
        """The percentage of lost frames."""
        came = self.counters.frames + sum(self.counters.unknown.values())
        return 100 * self.counters.lost / (came + self.counters.lost) if came else 0.0

    @property
    def foreign(self) -> dict[int, int]:
        """Counts of ids that we read and that always have a bad CRC: the sender defines them differently."""
        bad = self.counters.bad_crc
        return {i: n for i, n in bad.items() if n >= SAME_ID and i not in self.good and i in mav.MESSAGES}
