"""Two senders with one id in a simulated air, without sockets: is a live robot ever called safe?

`World` sends the frames of a *true* vehicle and of *another* sender through the real `LinkHub` and `MavlinkRobotHW`.
Frames are lost, late or doubled; senders arm, disarm, reboot, move and are exchanged; the gateway restarts. After every
step `World.check` compares the status with the truth. `run` takes random steps; the property tests of hypothesis take
the same steps in the order in which it searches.

Safe means: connected, and drives_powered FALSE, motion_possible FALSE or e_stopped TRUE. It must not be said within
`WITHIN` seconds of an armed heartbeat of the true vehicle, unless the true vehicle has said otherwise since.

The other sender does not count along with the true one: its sequence numbers stay away from those of the true vehicle
whatever the ways. A sender that reads the sequence numbers of the vehicle and continues them cannot be told apart.
"""

from __future__ import annotations

import heapq
import logging
import math
from collections import deque
from contextlib import contextmanager
from functools import lru_cache
from random import Random
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from mav_robot_status.clock import later
from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import enclose

from .air import START, Gateway, packed, says_safe

if TYPE_CHECKING:
    from collections.abc import Iterator

WITHIN: Final = 2.0  # s
TRUE_ONE, OTHER = 0, 1
SHARED, SECOND, OWN = ("10.0.0.1", 1), ("10.0.0.2", 2), ("10.0.0.9", 9)
WAYS: Final = {
    TRUE_ONE: ((SHARED,), (SHARED, SECOND)),
    OTHER: ((OWN,), (SHARED,), (SECOND,), (OWN, ("10.0.0.8", 8))),
}
"""Where each sender may be heard. Both may share an address: a router, or one radio."""
FATES: Final = ("arrives", "arrives", "arrives", "lost", "late", "twice")
PAUSES: Final = (0.02, 0.1, 0.25, 0.5, 1.0, 1.6, 3.6, 11.0)
LATE: Final = 0.7  # s
KINDS: Final = (2, 10)  # quadrotor, rover
STATES: Final = (4, 4, 5, 6, 8)  # ACTIVE, CRITICAL, EMERGENCY, FLIGHT_TERMINATION
HIL: Final = 32
"""MAV_MODE_FLAG_HIL_ENABLED."""
RAW_IMU: Final = 27
"""A message that no status needs."""
SILENCE: Final = 0.9  # s
RATE: Final = 10
"""Frames a second that were lost in a longer silence: a vehicle goes on sending, so its numbers go on."""
FAR: Final = 60
"""The least distance of the sequence numbers of the two senders."""
BOOT: Final = 1.5
"""Seconds from a boot to the first frame."""
COPY: Final = 10.5
"""Seconds after which a sender may use a number again."""
SAME_BOOT: Final = 10.0
"""Seconds within which two boots may be taken for one, if frames of a sender are late."""
WORLD_STEPS: Final = 500


class UnsafeError(AssertionError):
    """A live robot was called safe."""


class Said(NamedTuple):
    """A frame on its way."""

    due: float
    order: int
    way: tuple[str, int]
    data: bytes
    who: int
    armed: bool | None
    """What a heartbeat of the true vehicle says; None: any other frame."""


class Sender:
    """A vehicle, or what claims to be one."""

    def __init__(self, who: int, now: float) -> None:
        self.who = who
        self.armed = who == TRUE_ONE
        self.mode = 3
        self.state, self.flags = 4, 0
        """MAV_STATE and further flags of base_mode while it is armed. Only the other sender changes them."""
        self.kind = KINDS[0]
        self.booted = now - 100.0 * (1 + 9 * who)
        self.ways: tuple[tuple[str, int], ...] = WAYS[who][0]
        self.forked = False
        """Whether a router copies its frames on all its ways. Else each way has its own count."""
        self.counts: dict[Any, int] = {}
        self.latest: dict[Any, int] = {}
        """The latest number on each way, also from before a reboot."""
        self.starts_at = now
        """It says nothing before: a boot takes time."""
        self.spoke: dict[Any, float] = {}
        """When it spoke last on each way."""

    def heartbeat(self) -> mav.Heartbeat:
        """What it says now."""
        if not self.armed:
            return mav.Heartbeat(self.mode, self.kind, 3, 89, 3, 3)
        return mav.Heartbeat(self.mode, self.kind, 3, 217 | self.flags, self.state, 3)


class World:
    """The senders, the air and the gateway. Each step is a method; `check` follows each."""

    def __init__(self) -> None:
        self.now = START
        self.history: deque[str] = deque(maxlen=WORLD_STEPS + 1)
        self.senders = (Sender(TRUE_ONE, self.now.mono), Sender(OTHER, self.now.mono))
        self._used: dict[Any, float] = {}
        """When each sender used a number on a way last."""
        self._boots = tuple({sender.booted} for sender in self.senders)
        """All boots of each sender."""
        self._late: list[Said] = []
        self._order = 0
        self.restart()

    # steps

    def restart(self) -> None:
        """The gateway restarts. It knows nothing of before."""
        self._newest, self._armed_at = -1, -math.inf
        config = Config(links=(LinkConfig("udpin:127.0.0.1:1"),), requests="none")
        self.gateway = Gateway(config, self.now)
        self.hardware = self.gateway.hardware

    def wait(self, seconds: float) -> None:
        """Time passes, and late frames arrive."""
        until = self.now.mono + seconds
        while self._late and self._late[0].due <= until:
            said = heapq.heappop(self._late)
            self._pass(said.due)
            self._arrive(said)
            self.check()
        self._pass(until)
        self.hardware.read(self.now)

    def beat(self, who: int, fate: str) -> None:
        """A sender sends a heartbeat on all its ways."""
        sender = self.senders[who]
        self._send(sender, sender.heartbeat(), fate, sender.armed if who == TRUE_ONE else None)

    def stream(self, who: int, fate: str) -> None:
        """A sender sends its clock and its attitude."""
        sender = self.senders[who]
        clock_ms = round((self.now.mono - sender.booted) * 1000)
        self._send(sender, mav.Attitude(clock_ms, 0.0, 0.0, 0.0), fate, None)

    def chatter(self, who: int, count: int) -> None:
        """A sender sends frames that no status needs. They count in the sequence."""
        sender = self.senders[who]
        for _ in range(count):
            for way in sender.ways[:1] if sender.forked else sender.ways:
                self.gateway.arrive(_unneeded(self._count(sender, way)), way)

    def arm(self, who: int, armed: bool) -> None:
        """A sender arms or disarms."""
        self.senders[who].armed = armed

    def change_mode(self, who: int, mode: int) -> None:
        """A sender changes its mode."""
        self.senders[who].mode = mode

    def claim(self, state: int, flags: int) -> None:
        """The other sender says of itself that it is armed, and perhaps why it cannot move."""
        other = self.senders[OTHER]
        other.armed, other.state, other.flags = True, state, flags

    def move(self, who: int, place: int, forked: bool) -> None:
        """A sender is heard on other ways."""
        sender = self.senders[who]
        sender.ways, sender.forked = WAYS[who][place % len(WAYS[who])], forked

    def reboot(self, who: int) -> None:
        """A sender reboots. It is disarmed and counts from zero. That takes longer than a frame is late."""
        sender = self.senders[who]
        self._late = [said for said in self._late if said.who != who]
        heapq.heapify(self._late)
        sender.booted, sender.armed, sender.counts = self._apart(who, self.now.mono), False, {}
        sender.starts_at = self.now.mono + BOOT

    def exchange(self, kind: int, age: float) -> None:
        """Another vehicle takes the place of the true one, and continues its count."""
        true = self.senders[TRUE_ONE]
        true.kind, true.booted = KINDS[kind], self._apart(TRUE_ONE, self.now.mono - age)

    def copy(self, who: int) -> None:
        """The other sender becomes alike, or unlike, the true one in its kind."""
        self.senders[OTHER].kind = KINDS[who]

    def _apart(self, who: int, booted: float) -> float:
        """When a sender booted: not near any boot of the other one, which would prove by clock that they are one."""
        others = self._boots[1 - who]
        while any(abs(booted - other) <= SAME_BOOT for other in others):
            booted -= SAME_BOOT
        self._boots[who].add(booted)
        return booted

    # the oracle

    def check(self) -> None:
        """Raises UnsafeError if the status calls a live robot safe."""
        if self.now.mono - self._armed_at >= WITHIN:
            return
        vehicle = self.hardware.vehicles.find(1, 1)
        if vehicle is not None and says_safe(vehicle.handle.status, vehicle.handle.detail):
            status = vehicle.handle.status
            raise UnsafeError(f"{self.now.mono - self._armed_at:.2f} s after an armed heartbeat: {status}")

    # the air

    def _pass(self, mono: float) -> None:
        self.now = self.gateway.now = later(START, mono - START.mono)

    def _send(self, sender: Sender, message: Any, fate: str, armed: bool | None) -> None:
        if self.now.mono < sender.starts_at:
            return
        self._order += 1
        if sender.forked:
            data = packed(message, self._count(sender, sender.ways[0]))
            frames = [(way, data) for way in sender.ways]
        else:
            frames = [(way, packed(message, self._count(sender, way))) for way in sender.ways]
        for number, (way, data) in enumerate(frames):
            said = Said(self.now.mono, self._order, way, data, sender.who, armed)
            if fate == "late" or (fate == "twice" and number == 0):
                heapq.heappush(self._late, said._replace(due=self.now.mono + LATE * (1 + number)))
            if fate in ("arrives", "twice"):
                self._arrive(said)

    def _count(self, sender: Sender, way: tuple[str, int]) -> int:
        """The next sequence number. The counts of the two senders stay away from one another."""
        number = sender.counts.get(way, 128 * sender.who)
        silence = self.now.mono - sender.spoke.get(way, self.now.mono)
        if silence > SILENCE:
            number = number + round(RATE * silence) & 255
        if sender.who == OTHER or silence > SILENCE:
            taken = tuple(self.senders[1 - sender.who].latest.values())
            if any(_distance(number, count) < FAR for count in taken):
                number = max(range(0, 256, 8), key=lambda free: min(_distance(free, count) for count in taken))
        jumps = number != sender.counts.get(way)
        while jumps and self.now.mono - self._used.get((sender.who, way, number), -math.inf) < COPY:
            number = number + 1 & 255  # the same bytes again would be a copy
            jumps = number != sender.counts.get(way)
        self._used[sender.who, way, number] = self.now.mono
        sender.spoke[way] = self.now.mono
        sender.counts[way] = number + 1 & 255
        sender.latest[way] = number
        return number

    def _arrive(self, said: Said) -> None:
        self.gateway.arrive(said.data, said.way)
        if said.armed is not None and said.order > self._newest:
            self._newest = said.order
            self._armed_at = self.now.mono if said.armed else -math.inf


def _distance(one: int, other: int) -> int:
    """Between two numbers of eight bits, the shorter way round."""
    return min((one - other) & 255, (other - one) & 255)


@lru_cache(maxsize=256)
def _unneeded(sequence: int) -> bytes:
    return enclose(RAW_IMU, b"imu", system=1, component=1, sequence=sequence)


def random_step(world: World, random: Random) -> tuple[str, tuple[Any, ...]]:
    """The name and the arguments of a step. Most are heartbeats, as on a real link."""
    dice = random.random()
    who = random.getrandbits(1)
    fate = FATES[int(random.random() * len(FATES))] if random.random() < 0.3 else "arrives"
    if dice < 0.36:
        return "wait", (PAUSES[int(random.random() ** 2 * len(PAUSES))],)
    if dice < 0.70:
        return "beat", (who, fate)
    if dice < 0.88:
        return "stream", (who, fate)
    if dice < 0.91:
        return "arm", (who, random.random() < 0.6)
    if dice < 0.93:
        return "claim", (random.choice(STATES), random.choice((0, 0, HIL)))
    if dice < 0.95:
        return "change_mode", (who, random.choice((3, 5)))
    if dice < 0.975:
        return "move", (who, random.getrandbits(2), random.random() < 0.5)
    if dice < 0.985:
        return "reboot", (who,)
    if dice < 0.990:
        return "exchange", (random.getrandbits(1), random.choice((5.0, 500.0, 5000.0)))
    if dice < 0.995:
        return "copy", (who,)
    return "restart", ()


@contextmanager
def quietly() -> Iterator[None]:
    """Without log lines: the simulation makes thousands."""
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)


def run(count: int, seed: int, world_type: type[World] = World) -> str | None:
    """Take `count` random steps, WORLD_STEPS in each world. Returns the steps to an unsafe status, or None."""
    with quietly():
        for first in range(0, count, WORLD_STEPS):
            random = Random(f"{seed}/{first}")
            world = world_type()
            for _ in range(min(WORLD_STEPS, count - first)):
                name, arguments = random_step(world, random)
                world.history.append(f"world.{name}{arguments if len(arguments) != 1 else f'({arguments[0]!r})'}")
                try:
                    getattr(world, name)(*arguments)
                    world.check()
                except UnsafeError as unsafe:
                    steps = "\n".join(world.history)
                    begin = f"world = {world_type.__name__}()"
                    return f"seed {seed}, world {first}, step {len(world.history)}: {unsafe}\n{begin}\n{steps}"
    return None
