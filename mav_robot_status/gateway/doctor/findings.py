"""What was found out about one connection, as a value: who speaks, what, how often, and what was wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from ...hardware.fields.view import named
from ...mavlink import definitions as mav
from ...mavlink.counters import Counters

if TYPE_CHECKING:
    from ...hardware.requests import Wanted
    from ...link.url import Url

HEARTBEAT, SYS_STATUS = 0, 1
GROUND_STATION: Final = 6  # MAV_TYPE
SAME_ID: Final = 3
"""So many frames of an id have to be bad, and none good, before its definition is suspected rather than noise."""
BEATS: Final = 2


class Trouble(NamedTuple):
    """Why the link could not be opened."""

    text: str
    """The error's one line: what is wrong; what to do."""
    number: int | None = None
    """The errno behind it, if there is one."""


class Place(NamedTuple):
    """What this computer told about a connection on which nothing is heard."""

    trouble: str = ""
    """Of the other end "refused", "timeout", "unreachable", "unknown name"; of a device "missing"; of an address to
    listen on "not ours"; empty: none was found."""
    holder: str = ""
    """Who has the serial device, `mavproxy.py (pid 1234)`."""
    addresses: tuple[str, ...] = ()
    """This computer's own."""
    devices: tuple[str, ...] = ()
    """The serial devices that there are."""
    elsewhere: str = ""
    """The connection on which MAVLink is heard instead."""


NOWHERE: Final = Place()


class VehicleStatus(NamedTuple):
    """What the gateway makes of a vehicle."""

    flight_mode: str | None
    fields: Mapping[str, str | bool | None]
    """The mode's name; TRUE, FALSE or UNKNOWN of the others as in a JSON line."""
    errors: tuple[str, ...]
    inhibits: tuple[str, ...]
    wanted: tuple[Wanted, ...]
    """The messages that a status of this kind of vehicle needs."""


class Speaker(NamedTuple):
    """One component that sent something with a good CRC."""

    system: int
    component: int
    autopilot: int | None = None
    """MAV_AUTOPILOT; None: there was no heartbeat."""
    type: int | None = None
    """MAV_TYPE."""
    counts: Mapping[int, int] = {}
    """Messages by id."""
    rates: Mapping[int, float] = {}
    """Hz by id, of those that came more than once."""
    frames: int = 0
    frames_v1: int = 0
    pilot: bool = False
    """Whether it is a vehicle's autopilot."""
    twins: str = ""
    """What shows that there are two with these ids."""
    clock_off: float | None = None
    """Seconds by which its clock is ahead of ours; None: it does not know the time."""
    status: VehicleStatus | None = None
    """None: it has no handle."""

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
        """Hz of its heartbeat and of what a status needs of it, by name; None: it came once; 0: it did not come."""
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
    def missing(self) -> tuple[str, ...]:
        """What a status needs and what did not come, by name."""
        return tuple(name for name, hz in self.wanted.items() if hz == 0.0)


@dataclass(frozen=True)
class Findings:
    """Everything that was found out about one connection."""

    url: Url
    words: str
    """What was done, `listening on 127.0.0.1:14550/udp`."""
    passive: bool = False
    asked: bool = False
    """Whether a message that is missing had been asked for, and time to come."""
    signing: bool = False
    """Whether there is a key to verify signatures with."""
    seconds: float = 0.0
    """How long was listened."""
    size: int = 0
    """Bytes received."""
    head: bytes = b""
    counters: Counters = field(default_factory=Counters)
    good: Mapping[int, int] = field(default_factory=dict)
    """Frames with a good CRC by id."""
    dropped: int = 0
    """What could not be sent, and what the kernel dropped."""
    sources: tuple[str, ...] = ()
    """Addresses that something came from, where there are several ends."""
    speakers: tuple[Speaker, ...] = ()
    expected: tuple[int, ...] = ()
    """System ids that were asked for; empty: any."""
    trouble: Trouble | None = None
    place: Place = NOWHERE

    @property
    def vehicles(self) -> tuple[Speaker, ...]:
        """The autopilots that have a handle."""
        return tuple(s for s in self.speakers if s.status is not None)

    @property
    def able(self) -> bool:
        """Whether a status can be had, of every vehicle."""
        return bool(self.vehicles) and all(
            s.counts.get(HEARTBEAT, 0) >= BEATS and SYS_STATUS in s.counts for s in self.vehicles
        )

    @property
    def loss(self) -> float:
        """Percent of the frames that were lost."""
        came = self.counters.frames + sum(self.counters.unknown.values())
        return 100 * self.counters.lost / (came + self.counters.lost) if came else 0.0

    @property
    def foreign(self) -> dict[int, int]:
        """Ids that we read and of which every frame was bad: the sender's definition is not ours. With their counts."""
        bad = self.counters.bad_crc
        return {i: n for i, n in bad.items() if n >= SAME_ID and i not in self.good and i in mav.MESSAGES}
