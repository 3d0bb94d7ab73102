"""A vehicle on the wire, for tests of time: its streams, a clock that is told to pass, and the hardware interface.

Every status on the way is held against the invariants, and against one that is derived at that moment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.derive import Derived, derive
from mav_robot_status.hardware.mavlink.facts import Deadline
from mav_robot_status.hardware.mavlink.interface import SETTLES, MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import VehicleState
from mav_robot_status.hardware.mavlink.subjects import EDGES, facts_of
from mav_robot_status.hardware.mavlink.update import status_at
from mav_robot_status.hardware.mavlink.vehicle import ExpectedVehicle, TrackedVehicle
from mav_robot_status.interface import Detail, LinkState, RobotStatus, TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame
from mav_robot_status.testing import ManualClock

ARDUPILOT, PX4 = 3, 12
PLANE, QUAD, ROVER, SUB, QUADPLANE = 1, 2, 10, 12, 20
STANDBY, ACTIVE, CRITICAL, EMERGENCY, TERMINATED = 3, 4, 5, 6, 8

GYRO, GPS, MOTORS, RC, FENCE, AHRS, BATTERY, PREARM = (1 << bit for bit in (0, 5, 15, 16, 20, 21, 25, 28))
FITTED = 0xF | GPS | MOTORS | AHRS | BATTERY

SOON = 0.002  # s, more than the least wait between two updates

GLANCE_US = 200_000
"""Maximum time between two reads of a vehicle in microseconds."""

DEFINITIONS = {definition.type: definition for definition in mav.MESSAGES.values()}
Ids = tuple[int, int]


def frame_of(message: Any, ids: Ids = (1, 1), sequence: int = 0) -> Frame:
    """A message as the parser returns it, in the precision of the wire."""
    definition = DEFINITIONS[type(message)]
    layout = definition.layout
    raw = encode(message, system=ids[0], component=ids[1], sequence=sequence)
    return Frame(definition.id, ids, sequence, type(message)(*layout.unpack(layout.pack(*message))), raw)


class Numbers:
    """The next sequence number of each count of a sender."""

    def __init__(self) -> None:
        self._last: dict[Hashable, int] = {}

    def next(self, count: Hashable) -> int:
        """The next number of this count, which begins with 0."""
        self._last[count] = number = self._last.get(count, -1) + 1 & 255
        return number


def statustext(text: str | bytes, severity: int, number: int = 0, chunk: int = 0) -> mav.Statustext:
    raw = text.encode() if isinstance(text, str) else text
    return mav.Statustext(severity, raw, number, chunk)


def version_of(major: int, minor: int, patch: int) -> mav.AutopilotVersion:
    """AUTOPILOT_VERSION of a release."""
    return mav.AutopilotVersion(major << 24 | minor << 16 | patch << 8 | 255)


def check_invariants(status: RobotStatus, detail: Detail, options: HardwareOptions) -> None:
    """I1-I4; `link_loss_is_error` is the one exception to I4: the error is known, everything else is not."""
    if status.e_stopped is TriState.TRUE:
        assert status.drives_powered is TriState.FALSE, f"I1: {status}"
    if status.drives_powered is TriState.FALSE:
        assert status.motion_possible is TriState.FALSE, f"I2: {status}"
    assert (status.error_code != 0) is (status.in_error is TriState.TRUE), f"I3: {status}"
    assert (status.in_error is TriState.TRUE) is bool(detail.errors), f"I3: {detail.errors}"
    if detail.link is not LinkState.CONNECTED:
        is_error = options.link_loss_is_error and detail.link is LinkState.LOST
        lost = RobotStatus(in_error=TriState.TRUE, error_code=9001) if is_error else RobotStatus()
        assert status == lost, f"I4: {status}"
    if status.motion_possible is TriState.TRUE:
        assert not detail.inhibits


def derived(state: VehicleState, before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """The status of vehicle 1.1 with this state at `now`."""
    return derive(facts_of(state, Deadline(now.mono), options), (1, 1), before, now, options)


def check_present(tracked: TrackedVehicle, now: Instant, options: HardwareOptions) -> None:
    """A handle that was not updated equals a newly derived status: no change was missed."""
    if tracked.state is not None and not tracked.touched and now.mono < tracked.due - SOON:
        due, updated = tracked.due, status_at(tracked, now, options)
        assert updated is not None
        if updated.derived is not None:  # it rests on other facts, and is the same
            detail = updated.derived.detail
            detail = detail._replace(vehicle=detail.vehicle._replace(name=tracked.name))
            assert updated.derived.status == tracked.handle.status
            assert detail == tracked.handle.detail
        if len(tracked.belief.speakers) == 1:  # senders that differ are compared at each look
            assert updated.due >= due - SOON, "it is due earlier than the last `read` said"


class Stream:
    """A periodic message."""

    def __init__(self, message: Callable[[], Any], period_us: int, next_us: int, ids: Ids) -> None:
        self.message, self.period_us, self.next_us, self.ids = message, period_us, next_us, ids


class Flight:
    """One vehicle and what is made of it. Attributes say what its streams will tell; `wait` lets time pass."""

    def __init__(
        self,
        autopilot: int = ARDUPILOT,
        vehicle_type: int = QUAD,
        *,
        options: HardwareOptions | None = None,
        slots: tuple[ExpectedVehicle, ...] = (ExpectedVehicle(1, 1),),
        streams: bool = True,
        version: tuple[int, int, int] | None = None,
    ) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(options, slots)
        self.autopilot, self.vehicle_type = autopilot, vehicle_type
        self.armed, self.mode, self.state, self.flags = False, 0, STANDBY, 1
        self.present = self.enabled = FITTED if autopilot == PX4 else FITTED | PREARM
        self.health = FITTED | PREARM
        self.internal_errors = 0
        self.booted_us = -60_000_000
        self.asks: list[Any] = []
        self.passive: tuple[Ids, ...] = ()
        """Vehicles on passive links."""
        self._us = 0
        self._start = self.clock.now().mono
        self._event_sequence = 0
        self._numbers = Numbers()
        self._streams: dict[str, Stream] = {}
        if streams:
            self.stream("heartbeat", self.heartbeat)
            self.stream("sys_status", self.sys_status)
            if version is not None:
                self.stream("version", lambda: version_of(*version), hz=0.1)

    # -- what it says -----------------------------------------------------------------------------------------------

    def heartbeat(self) -> mav.Heartbeat:
        base_mode = self.flags | (128 if self.armed else 0)
        return mav.Heartbeat(self.mode, self.vehicle_type, self.autopilot, base_mode, self.state, 3)

    def sys_status(self) -> mav.SysStatus:
        low, high = self.internal_errors & 0xFFFF, self.internal_errors >> 16
        return mav.SysStatus(self.present, self.enabled, self.health, low, high, 0, 0, 0)

    def system_time(self) -> mav.SystemTime:
        return mav.SystemTime(0, self.boot_ms)

    @property
    def boot_ms(self) -> int:
        """Time since boot on the clock of the vehicle."""
        return (self._us - self.booted_us) // 1000

    # -- sending ----------------------------------------------------------------------------------------------------

    def hb(self, **changes: Any) -> Flight:
        """Apply these changes and send a heartbeat now. Later heartbeats keep the changes."""
        self.set(**changes)
        if "heartbeat" in self._streams:
            self._streams["heartbeat"].next_us = self._us
        return self.send(self.heartbeat()) if "heartbeat" not in self._streams else self.look()

    def set(self, **changes: Any) -> Flight:
        for name, value in changes.items():
            assert hasattr(self, name), name
            setattr(self, name, value)
        return self

    def text(self, text: str, severity: int = 4, ids: Ids = (1, 1)) -> Flight:
        return self.send(statustext(text, severity), ids)

    def chunk(self, number: int, chunk: int, text: str, severity: int) -> Flight:
        return self.send(statustext(text, severity, number, chunk))

    def event(self, log_levels: int) -> Flight:
        self._event_sequence += 1
        return self.send(mav.Event(1 << 24, self.boot_ms, self._event_sequence, 0, 0, log_levels, b""))

    def send(self, message: Any, ids: Ids = (1, 1)) -> Flight:
        """Send one message now, after all due messages, and wait until it is in the status."""
        self.look()
        self._take(message, ids)
        if DEFINITIONS[type(message)].id not in EDGES:
            self.wait(SETTLES + 1e-6)
        return self.look()

    def _take(self, message: Any, ids: Ids) -> None:
        self.hw.on_frame(frame_of(message, ids, self._numbers.next(ids)), self.clock.now())

    def lose(self, frames: int = 1) -> Flight:
        """Send this many frames that do not arrive."""
        for _ in range(frames):
            self._numbers.next((1, 1))
        return self

    def stream(self, name: str, message: Callable[[], Any], hz: float = 1.0, ids: Ids = (1, 1)) -> Flight:
        """Send this message at this rate from now on."""
        self._streams[name] = Stream(message, round(1e6 / hz), self._us, ids)
        return self

    def stop(self, *names: str) -> Flight:
        """Stop these streams, or all of them without names."""
        for name in names or tuple(self._streams):
            del self._streams[name]
        return self

    def has(self, name: str) -> bool:
        """Whether this stream is active."""
        return name in self._streams

    def resume(self) -> Flight:
        return self.stream("heartbeat", self.heartbeat).stream("sys_status", self.sys_status)

    def reboot(self, uptime_s: float = 0.0) -> Flight:
        """Restart its clock at `uptime_s` seconds, and its count of frames."""
        self.booted_us = self._us - round(uptime_s * 1e6)
        self._numbers = Numbers()
        return self

    # -- time -------------------------------------------------------------------------------------------------------

    def wait(self, seconds: float) -> list[RobotStatus]:
        """Advance the time and read at each arrival or due moment. Returns all statuses without repetitions."""
        end = self._us + round(seconds * 1e6)
        seen: list[RobotStatus] = []
        while True:
            self.look()
            if self.tracked is not None and (not seen or seen[-1] != self.status):
                seen.append(self.status)
            if self._us >= end:
                return seen
            self._advance(
                min([end, self._us + GLANCE_US, self._hw_due_us(), *(s.next_us for s in self._streams.values())])
            )

    def look(self) -> Flight:
        """Send the due messages and read."""
        now = self.clock.now()
        for stream in self._streams.values():
            if stream.next_us <= self._us:
                self._take(stream.message(), stream.ids)
                stream.next_us = self._us + stream.period_us
        self.hw.read(now)
        self.asks += [ask.message for ask in self.hw.due_requests(now, self.passive)]
        for tracked in self.hw.vehicles:
            check_invariants(tracked.handle.status, tracked.handle.detail, self.hw.options)
            check_present(tracked, now, self.hw.options)
        return self

    def _hw_due_us(self) -> int:
        due = self.hw.next_due()
        return 1 << 62 if due == math.inf else math.ceil((due - self._start) * 1e6)

    def _advance(self, target_us: int) -> None:
        step = max(target_us - self._us, 1)
        self.clock.advance(step / 1e6)
        self._us += step

    # -- what is made of it -----------------------------------------------------------------------------------------

    @property
    def tracked(self) -> TrackedVehicle | None:
        return self.hw.find(1, 1)

    @property
    def vehicle(self) -> TrackedVehicle:
        assert self.tracked is not None
        return self.tracked

    @property
    def status(self) -> RobotStatus:
        return self.vehicle.handle.status

    @property
    def detail(self) -> Detail:
        return self.vehicle.handle.detail

    @property
    def code(self) -> int:
        return self.status.error_code

    @property
    def codes(self) -> list[int]:
        return [error.code for error in self.detail.errors]

    @property
    def inhibits(self) -> dict[str, str | None]:
        return {inhibit.name: inhibit.text for inhibit in self.detail.inhibits}


def copter(**how: Any) -> Flight:
    """A copter whose pre-arm checks include the stop."""
    return Flight(ARDUPILOT, QUAD, **{"version": (4, 5, 6)} | how)


def rover(**how: Any) -> Flight:
    return Flight(ARDUPILOT, ROVER, **how)


def px4(**how: Any) -> Flight:
    return Flight(PX4, QUAD, **how)
