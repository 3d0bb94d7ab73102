"""A simulated companion computer with a cable and a radio to its autopilot, and a ground station on several ways.

Ground station, autopilot and gateway come, go and change their ways at random. The autopilot forwards between its ports
as ArduPilot does (MAVLink_routing.cpp): it learns routes until it reboots, and it sends a heartbeat to all ports except
those on which it has heard the sender. Some ground stations forward between their ways, too. Time is simulated, and a
seed gives the same run each time.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import TYPE_CHECKING, Final

from mav_robot_status.gateway.links.routing import Router
from mav_robot_status.mavlink.commands import HEARTBEAT
from mav_robot_status.mavlink.definitions import Attitude, CommandLong, Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame

if TYPE_CHECKING:
    from typing import NamedTuple

Ids = tuple[int, int]

AUTOPILOT: Final[Ids] = (1, 1)
GROUND: Final[Ids] = (255, 190)
PERIOD: Final = 0.25
"""Seconds between two frames of a sender. Every fourth is a heartbeat."""
LATE: Final = 2.0
"""The most seconds without a heartbeat of the ground station at the autopilot, while heartbeats reach the gateway."""
CHANGE: Final = 4.0
"""Mean seconds between two changes."""
MOST_COPIES: Final = 40
"""The most times that the gateway sends one frame. Without a loop: once to each of its channels."""
KEPT: Final = 30.0
"""Seconds for which the gateway still sends to a channel that was left."""
ATTITUDE: Final = Attitude(1, 0.0, 0.0, 0.0)
COMMAND: Final = CommandLong(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 400, *AUTOPILOT, 0)
BEATS: Final = {AUTOPILOT: Heartbeat(0, 2, 3, 81, 4, 3), GROUND: Heartbeat(0, 6, 8, 0, 4, 3)}


@dataclass(frozen=True, eq=False)
class Channel:
    """A channel of the gateway."""

    is_out: bool
    passive: bool = False


@dataclass(eq=False)
class Way:
    """A link. It joins two of: the gateway, the autopilot, the ground station."""

    ends: tuple[str, str]
    delay: tuple[float, float]
    """Seconds on the way, at least and at most."""
    up: bool = True


class World:
    """The simulation."""

    def __init__(self, seed: int | bytes) -> None:
        self.random = random.Random(seed)
        self.now = 0.0
        self.sent = 0
        """Frames that the gateway sent."""
        self.made = 0
        """Frames that autopilot and ground station made."""
        self.copies: Counter[int] = Counter()
        """How often the gateway sent each frame, for the frames of the last seconds."""
        self.worst = 0.0
        """The longest time without a heartbeat at the autopilot, in seconds."""
        self.ways = {
            "cable": Way(("gateway", "autopilot"), (0.001, 0.003)),
            "radio": Way(("gateway", "autopilot"), (0.03, 0.3)),
            "network": Way(("gateway", "ground"), (0.001, 0.05)),
            "direct": Way(("autopilot", "ground"), (0.02, 0.25)),
        }
        self.alive = dict.fromkeys(("gateway", "autopilot", "ground"), True)
        self._queue: list[tuple[float, int, str, str, Frame, int]] = []
        self._count = 0
        self._numbers: Counter[tuple[Ids, str]] = Counter()
        self._ports: dict[Ids, set[str]] = {}
        """ArduPilot's routes: the ways on which it has heard each component."""
        self._router: Router[Channel] = Router()
        self._channels: dict[str, Channel] = {}
        self._left: dict[Channel, float] = {}
        self._tuple: tuple[Channel, ...] = ()
        self._restart()
        self._style()
        self._beat_at_gateway = self._beat_at_autopilot = self._run_since = 0.0

    def run(self, seconds: float) -> None:
        """Run so long. Raises AssertionError if a heartbeat is missing at the autopilot, or if a loop amplifies."""
        end = self.now + seconds
        speak, change = self.now, self.now + self.random.expovariate(1 / CHANGE)
        turn = 0
        while self.now < end:
            due = min(speak, change)
            while self._queue and self._queue[0][0] <= due:
                self.now, _, way, end_of_way, frame, number = heappop(self._queue)
                if self.ways[way].up and self.alive[end_of_way]:
                    getattr(self, f"_{end_of_way}_hears")(way, frame, number)
            self.now = due
            if due == speak:
                turn += 1
                self._speak(AUTOPILOT, "autopilot", turn)
                self._speak(GROUND, "ground", turn)
                speak += PERIOD * self.random.uniform(0.95, 1.05)
            else:
                self._change()
                change += self.random.expovariate(1 / CHANGE)

    # what the three do

    def _speak(self, ids: Ids, who: str, turn: int) -> None:
        """Send one frame on all ways: with its own numbers on each, or the same bytes on all."""
        if not self.alive[who]:
            return
        message: NamedTuple = BEATS[ids] if turn % 4 == 0 else COMMAND if ids == GROUND and turn % 8 == 1 else ATTITUDE
        if self._beats_only and ids == GROUND and message is not BEATS[ids]:
            return
        same = self._same_bytes and ids == GROUND
        for name in self._ways_of(who):
            line = "" if same else name
            self.made += not same
            number = self.made
            sequence = 0 if self._constant and ids == GROUND else self._numbers[ids, line] % 256
            raw = encode(message, system=ids[0], component=ids[1], sequence=sequence)
            self._put(name, who, Frame(_id_of(message), ids, sequence, None, raw), number)
            self._numbers[ids, line] += not same
        if same:
            self.made += 1
            self._numbers[ids, ""] += 1

    def _gateway_hears(self, way: str, frame: Frame, number: int) -> None:
        if frame.message_id == HEARTBEAT and frame.ids == GROUND:
            self._check_late()
        to = self._router.destinations(frame, self._channels[way], self._tuple, self.now)
        names = {channel: name for name, channel in self._channels.items()}
        self.sent += len(to)
        self.copies[number] += len(to)
        assert self.copies[number] <= MOST_COPIES, f"{self.now:.3f}: a frame of {frame.ids} was sent so often"
        if len(self.copies) > 1000:
            self.copies = Counter({k: n for k, n in self.copies.items() if k > self.made - 500})
        for channel in to:
            if channel in names:
                self._put(names[channel], "gateway", frame, number)

    def _autopilot_hears(self, way: str, frame: Frame, number: int) -> None:
        if frame.ids == AUTOPILOT:
            return
        if frame.ids == GROUND and frame.message_id == HEARTBEAT:
            self._beat_at_autopilot = self.now
        self._ports.setdefault(frame.ids, set()).add(way)
        if frame.message_id == _id_of(COMMAND):
            return
        known = set().union(*self._ports.values()) if frame.message_id != HEARTBEAT else set(self._ways_of("autopilot"))
        if frame.message_id == HEARTBEAT:
            known -= self._ports[frame.ids]
        for name in sorted(known - {way}):
            self._put(name, "autopilot", frame, number)

    def _ground_hears(self, way: str, frame: Frame, number: int) -> None:
        if self._forwards:
            for name in self._ways_of("ground"):
                if name != way:
                    self._put(name, "ground", frame, number)

    # the changes

    def _change(self) -> None:
        what = self.random.choice(("way", "way", "way", "way", "one", "reboot", "restart", "style", "move"))
        if what == "way":
            self._toggle(self.ways[self.random.choice(sorted(self.ways))])
        elif what == "one":
            who = self.random.choice(("ground", "autopilot"))
            self.alive[who] = not self.alive[who] or self.random.random() < 0.5
            self._fresh()
        elif what == "reboot":
            self._ports.clear()
        elif what == "restart":
            self._restart()
        elif what == "move":
            self._open(self.random.choice(sorted(self._channels)))
        else:
            self._style()

    def _style(self) -> None:
        """The habits of the ground station."""
        self._forwards = self.random.random() < 0.3
        self._same_bytes = self.random.random() < 0.4
        self._constant = self.random.random() < 0.2
        self._beats_only = self.random.random() < 0.3

    def _toggle(self, way: Way) -> None:
        way.up = not way.up
        self._fresh()

    def _restart(self) -> None:
        """The gateway starts again: it knows nothing."""
        self._router = Router()
        self._channels, self._left = {}, {}
        for name, way in self.ways.items():
            if "gateway" in way.ends:
                self._open(name)
        self._fresh()

    def _open(self, name: str) -> None:
        """The other end of a way comes from a new address. The gateway sends to the old one for some time."""
        if name in self._channels:
            self._left[self._channels[name]] = self.now
        self._channels[name] = Channel(is_out=name == "network")
        self._left = {channel: left for channel, left in self._left.items() if self.now - left < KEPT}
        self._tuple = (*self._channels.values(), *self._left)

    # helpers

    def _ways_of(self, who: str) -> list[str]:
        return [name for name, way in self.ways.items() if who in way.ends]

    def _put(self, name: str, sender: str, frame: Frame, number: int) -> None:
        way = self.ways[name]
        if not way.up:
            return
        self._count += 1
        there = next(end for end in way.ends if end != sender)
        heappush(self._queue, (self.now + self.random.uniform(*way.delay), self._count, name, there, frame, number))

    def _fresh(self) -> None:
        """The waiting for a heartbeat begins again: what was on its way may be lost with a link or an end."""
        self._run_since = self.now
        self._beat_at_gateway = -1e9

    def _check_late(self) -> None:
        """A heartbeat of the ground station has reached the gateway."""
        if self.now - self._beat_at_gateway > 1.5:
            self._run_since = self.now
        self._beat_at_gateway = self.now
        if not (self.ways["cable"].up or self.ways["radio"].up) or not self.alive["autopilot"]:
            self._run_since = self.now
            return
        late = self.now - max(self._beat_at_autopilot, self._run_since)
        self.worst = max(self.worst, late)
        assert late <= LATE + self.ways["radio"].delay[1], f"{self.now:.3f}: no heartbeat at the autopilot for {late} s"


def _id_of(message: NamedTuple) -> int:
    return {Heartbeat: HEARTBEAT, Attitude: 30, CommandLong: 76}[type(message)]
