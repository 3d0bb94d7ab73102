"""Scripted vehicles in a simulated air: who sends what from where, what becomes of it on the way, what the status says.

Times are seconds since the start of a scene. A `Vehicle` speaks through `Port`s, which number its frames; a port sends
on `Path`s, and the fate of a path says when each datagram arrives. `Scene.lines` has the status 20 times a second.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Any, Final, NamedTuple

from fuzz.air import START, Gateway, packed, says_safe
from mav_robot_status.clock import later
from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.interface import Detail, LinkState, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.signing import Signer

Source = tuple[str, int]
Fate = Callable[[float, bytes], Iterable[float]]
"""When a datagram that is sent at this time arrives: once for each copy, never if it is lost."""
Test = Callable[["Line"], bool]

STEPS: Final = 100
"""Steps a second."""
RECORDED: Final = 20
"""Lines a second."""
NEARLY: Final = 1e-6
APART: Final = 0.02
"""Seconds between the kinds of messages of a vehicle, so that others can speak between them."""
HOME, AWAY, THIRD = ("10.0.0.5", 14550), ("10.0.0.9", 4555), ("10.0.0.7", 7000)
ROVER, QUADROTOR, ARDUPILOT = 10, 2, 3
MANUAL, HOLD = 0, 4
ACTIVE: Final = 4
HEALTHY: Final = 0x0320_802F
HEARTBEAT, SYS_STATUS, ATTITUDE, POSITION = 0, 1, 30, 33
SYSTEM_ID_CONFLICT, REBOOT_WHILE_ARMED = 9002, 5004


# -- what becomes of a datagram on the way -----------------------------------------------------------------------------


def at_once(at: float, data: bytes) -> Iterable[float]:
    return (at,)


def late(seconds: float, since: float = -math.inf) -> Fate:
    """Each datagram sent from `since` on arrives so much later."""
    return lambda at, data: (at + seconds if at >= since else at,)


def again(seconds: float) -> Fate:
    """Each datagram arrives, and so much later once more."""
    return lambda at, data: (at, at + seconds)


def cut(*gaps: tuple[float, float], rest: Fate = at_once) -> Fate:
    """What is sent from the one time to the other is lost."""
    return lambda at, data: () if any(begin <= at < end for begin, end in gaps) else rest(at, data)


def held(begin: float, end: float) -> Fate:
    """What is sent from the one time to the other arrives at the other, at once and in order."""
    return lambda at, data: (end if begin <= at < end else at,)


def dropped(share: float, seed: int, rest: Fate = at_once) -> Fate:
    """This share is lost, at random."""
    return lambda at, data: () if _drawn(seed, at, data) < share else rest(at, data)


def scattered(seconds: float, seed: int) -> Fate:
    """Each datagram is late by up to `seconds`, at random."""
    return lambda at, data: (at + seconds * _drawn(seed, at, data),)


def _drawn(seed: int, at: float, data: bytes) -> float:
    """From 0 to 1, at random, but always the same for a datagram."""
    return int.from_bytes(blake2b(data, digest_size=4, key=b"%d %.4f" % (seed, at)).digest(), "big") / 2**32


def only(*ids: int, rest: Fate = at_once) -> Fate:
    """Only these messages arrive."""
    return lambda at, data: rest(at, data) if message_id(data) in ids else ()


def without(*ids: int, since: float = -math.inf, until: float = math.inf) -> Fate:
    """These messages are lost."""
    return lambda at, data: () if since <= at < until and message_id(data) in ids else (at,)


def message_id(frame: bytes) -> int:
    """The id of the message in a MAVLink 2 frame."""
    return int.from_bytes(frame[7:10], "little")


# -- who speaks --------------------------------------------------------------------------------------------------------


class Path(NamedTuple):
    """A way to the gateway."""

    source: Source = HOME
    fate: Fate = at_once
    link: int = 0


@dataclass(eq=False)
class Port:
    """A count of sequence numbers, and the paths on which its frames are heard."""

    paths: tuple[Path, ...] = (Path(),)
    number: int = 0
    """The number of the next frame."""
    step: int = 1
    signer: Signer | None = None

    def frame(self, message: Any, ids: tuple[int, int], unix_us: int) -> bytes:
        """The next frame."""
        data = packed(message, self.number, *ids)
        self.number = (self.number + self.step) & 255
        return data if self.signer is None else self.signer.sign(data, unix_us)


class Sent(NamedTuple):
    """A message that a vehicle has sent: the frame is that of its first port."""

    at: float
    message: Any
    data: bytes


class Heard(NamedTuple):
    """A frame that has arrived."""

    at: float
    who: Vehicle | None
    """Its sender, if that is one of the scene."""
    number: int
    """Its place in what that one has sent."""


@dataclass(eq=False)
class Vehicle:
    """HEARTBEAT and SYS_STATUS at 1 Hz, ATTITUDE and GLOBAL_POSITION_INT with a boot clock at 4 Hz."""

    ports: tuple[Port, ...] = field(default_factory=lambda: (Port(),))
    ids: tuple[int, int] = (1, 1)
    kind: int = ROVER
    autopilot: int = ARDUPILOT
    armed: bool = False
    mode: int = MANUAL
    speed: float = 0.0
    """Metres a second, to the north."""
    enabled: int = HEALTHY
    """SYS_STATUS: the sensors that are in use."""
    clock: float = 100.0
    """Seconds since it booted. Its clock, and all that it sends, go at `pace` of real time."""
    pace: Callable[[float], float] = lambda at: 1.0
    streams: dict[str, float] = field(
        default_factory=lambda: {"heartbeat": 1.0, "sys_status": 1.0, "attitude": 0.25, "position": 0.25}
    )
    """The seconds from one message to the next, by the method that makes it."""
    begin: float = 0.0
    end: float = math.inf
    sent: list[Sent] = field(default_factory=list)
    """What it sent so far."""

    def __post_init__(self) -> None:
        self.boot(self.clock)

    def boot(self, clock: float = 0.0) -> None:
        """It begins anew."""
        self.clock = clock
        self._due = {name: clock + APART * place for place, name in enumerate(self.streams)}
        self._next = -math.inf

    @property
    def boot_ms(self) -> int:
        return round(self.clock * 1000) & 0xFFFFFFFF

    def heartbeat(self) -> Any:
        return mav.Heartbeat(self.mode, self.kind, self.autopilot, 129 if self.armed else 1, ACTIVE, 3)

    def sys_status(self) -> Any:
        return mav.SysStatus(HEALTHY, self.enabled, HEALTHY, 0, 0, 0, 0, 0)

    def attitude(self) -> Any:
        return mav.Attitude(self.boot_ms, 0.0, 0.0, 0.0)

    def position(self) -> Any:
        return mav.GlobalPositionInt(self.boot_ms, 480_000_000, 90_000_000, round(self.speed * 100), 0, 0)

    def vfr_hud(self) -> Any:
        return mav.VfrHud(self.speed, 0.0, 0)

    def applet(self, value: int) -> Any:
        return mav.NamedValueFloat(self.boot_ms, float(value), b"RS_STOP")

    def pass_time(self, seconds: float) -> list[Any]:
        """The messages that it sends now."""
        self.clock += seconds
        said: list[Any] = []
        if self.clock < self._next:
            return said
        for name, period in self.streams.items():
            while self.clock >= self._due[name] - NEARLY:
                self._due[name] += period
                said.append(getattr(self, name)())
        self._next = min(self._due.values(), default=math.inf) - NEARLY
        return said


def heard(*paths: Path, number: int = 0) -> tuple[Port]:
    """One count on these paths."""
    return (Port(paths, number),)


def states(period: float = 1.0) -> dict[str, float]:
    """The streams of a vehicle that sends HEARTBEAT and SYS_STATUS only: no clock."""
    return {"heartbeat": period, "sys_status": period}


def text(words: str) -> Any:
    """A STATUSTEXT."""
    return mav.Statustext(6, words.encode(), 0, 0)


PRESSED, RELEASED = text("RC7: MotorEStop HIGH"), text("RC7: MotorEStop LOW")


# -- what the status says ----------------------------------------------------------------------------------------------


class Line(NamedTuple):
    """The status at one time."""

    at: float
    status: RobotStatus
    detail: Detail

    @property
    def connected(self) -> bool:
        return self.detail.link is LinkState.CONNECTED

    @property
    def codes(self) -> set[int]:
        return {error.code for error in self.detail.errors}

    @property
    def inhibits(self) -> list[str]:
        return [inhibit.name for inhibit in self.detail.inhibits]


UNSAID: Final = Line(0.0, RobotStatus(), Detail(link=LinkState.NEVER_SEEN))


def is_safe(line: Line) -> bool:
    return says_safe(line.status, line.detail)


def is_stopped(line: Line) -> bool:
    return line.connected and line.status.e_stopped is TriState.TRUE


def is_unknown(line: Line) -> bool:
    """Whether the mode, or whether it is armed, is not known."""
    return (
        not line.connected
        or line.status.mode is RobotMode.UNKNOWN
        or line.status.drives_powered is TriState.UNKNOWN
        or line.status.motion_possible is TriState.UNKNOWN
    )


def is_conflict(line: Line) -> bool:
    return SYSTEM_ID_CONFLICT in line.codes


class Scene:
    """A gateway, those who speak, and what is to happen when."""

    def __init__(self, *urls: str, **config: Any) -> None:
        """The links have these URLs, or it is one that listens. `config`: more members of the `Config`."""
        links = tuple(LinkConfig(url) for url in urls or ("udpin:127.0.0.1:1",))
        self._config = Config(links=links, requests="none", **config)
        self.gateway = Gateway(self._config, START)
        self.vehicles: list[Vehicle] = []
        self.lines: list[Line] = []
        self.heard: list[Heard] = []
        self.systems: dict[tuple[int, int], float] = {}
        """When the status of each vehicle was known first."""
        self._steps = -1
        self._order = 0
        self._coming: list[tuple[float, int, bytes, Source, int, Vehicle | None, int]] = []
        self._planned: list[tuple[float, int, Callable[[], object]]] = []

    @property
    def now(self) -> float:
        """Seconds since the start."""
        return max(self._steps, 0) / STEPS

    def add(self, vehicle: Vehicle) -> Vehicle:
        """It speaks from its `begin` to its `end`."""
        self.vehicles.append(vehicle)
        return vehicle

    def at(self, at: float, todo: Callable[[], object]) -> None:
        """This happens then, before anything is sent."""
        self._order += 1
        heapq.heappush(self._planned, (at, self._order, todo))

    def set(self, at: float, who: Vehicle, **values: Any) -> None:
        """A vehicle is like this from then on."""

        def change() -> None:
            for name, value in values.items():
                setattr(who, name, value)

        self.at(at, change)

    def each(self, period: float, begin: float, end: float, todo: Callable[[], object]) -> None:
        """This happens at `begin`, and then once in each period."""
        for number in range(math.ceil((end - begin) / period)):
            self.at(begin + number * period, todo)

    def arrives(
        self, at: float, data: bytes, source: Source = HOME, link: int = 0, who: Vehicle | None = None, number: int = 0
    ) -> None:
        """A datagram arrives then, whoever sent it."""
        self._order += 1
        heapq.heappush(self._coming, (at, self._order, data, source, link, who, number))

    def say(self, who: Vehicle, message: Any) -> bytes:
        """A vehicle says this now. Returns the frame of its first port."""
        frames = [port.frame(message, who.ids, self.gateway.now.unix_us) for port in who.ports]
        who.sent.append(Sent(self.now, message, frames[0]))
        for port, data in zip(who.ports, frames, strict=True):
            for path in port.paths:
                for arrival in path.fate(self.now, data):
                    self.arrives(arrival, data, path.source, path.link, who, len(who.sent) - 1)
        return frames[0]

    def says(self, at: float, who: Vehicle, message: Any) -> None:
        """A vehicle says this then."""
        self.at(at, lambda: self.say(who, message))

    def restart(self) -> None:
        """The gateway ends, and starts again."""
        self.gateway.close()
        self.gateway = Gateway(self._config, self.gateway.now)

    def run(self, until: float) -> Scene:
        """Let time pass."""
        while self._steps < round(until * STEPS):
            self._steps += 1
            at = self._steps / STEPS
            self._deliver(at)
            while self._planned and self._planned[0][0] <= at:
                self._pass(at)
                heapq.heappop(self._planned)[2]()
            for vehicle in self.vehicles:
                if vehicle.begin <= at < vehicle.end:
                    for message in vehicle.pass_time(vehicle.pace(at) / STEPS if self._steps else 0.0):
                        self._pass(at)
                        self.say(vehicle, message)
            self._deliver(at)
            if self._steps % (STEPS // RECORDED) == 0:
                self._pass(at)
                self._record(at)
        return self

    def _pass(self, at: float) -> None:
        if self.gateway.now.mono < START.mono + at:
            self.gateway.now = later(START, at)

    def _deliver(self, until: float) -> None:
        while self._coming and self._coming[0][0] <= until:
            at, _, data, source, link, who, number = heapq.heappop(self._coming)
            self._pass(at)
            self.gateway.arrive(data, source, link)
            self.heard.append(Heard(self.gateway.now.mono - START.mono, who, number))

    def _record(self, at: float) -> None:
        self.gateway.turn()
        vehicles = self.gateway.hardware.vehicles
        for vehicle in vehicles.vehicles:
            if vehicle.ids is not None and vehicle.handle.detail.link is LinkState.CONNECTED:
                self.systems.setdefault(vehicle.ids, at)
        found = vehicles.find(1, 1)
        handle = found.handle if found is not None else next(iter(self.gateway.hardware.handles), None)
        self.lines.append(UNSAID._replace(at=at) if handle is None else Line(at, handle.status, handle.detail))

    # what was said

    def during(self, begin: float, end: float = math.inf) -> list[Line]:
        """The lines from `begin` until before `end`."""
        return [line for line in self.lines if begin <= line.at < end]

    def seconds(self, test: Test, begin: float = 0.0, end: float = math.inf) -> float:
        """For how long it was so."""
        return sum(map(test, self.during(begin, end))) / RECORDED

    def said(self, begin: float = 0.0) -> list[tuple[Any, ...]]:
        """What the status said, without the times at which it began."""
        return [(line.status, line.detail.link, line.inhibits, line.codes) for line in self.during(begin)]

    def line(self, at: float) -> Line:
        """The last line up to then."""
        return next(line for line in reversed(self.lines) if line.at <= at)

    def is_known(self, at: float, *, armed: bool) -> bool:
        """Whether the status said then of a healthy vehicle that it is armed, or that it is not."""
        line, known = self.line(at), TriState.of(armed)
        return line.connected and line.status.drives_powered is known and line.status.motion_possible is known
