"""HIGH_LATENCY2 as ArduPilot, PX4, INAV and UV Radio Room send it, and a sky with satellites."""

from __future__ import annotations

from typing import Any

from mav_robot_status.hardware.mavlink.belief import Belief
from mav_robot_status.hardware.mavlink.interface import SETTLES, MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.subjects import EDGES
from mav_robot_status.interface import RobotStatus
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.framing import Frame
from mav_robot_status.testing import ManualClock

from ..driver import ARDUPILOT, PX4, QUAD, check_invariants, check_present, frame_of

DISARMED, ARMED = 81, 209 - 256
"""ArduPilot Copter's base_mode in STABILIZE as custom0, which is signed."""
NOTHING = mav.HighLatency2(0, 0, 0, 0, 0, QUAD, ARDUPILOT, 0, 0, 0, 0, 0, 0, 0)


def ardupilot(custom0: int = DISARMED, **fields: int) -> mav.HighLatency2:
    return NOTHING._replace(**{"custom0": custom0, "custom_mode": 4} | fields)


def px4(**fields: int) -> mav.HighLatency2:
    told = {"autopilot": PX4, "custom0": -128, "custom1": -128, "custom2": -128, "eph": 255, "epv": 255}
    return NOTHING._replace(**told | {"custom_mode": 4 | 4 << 8} | fields)


def inav(**fields: int) -> mav.HighLatency2:
    return NOTHING._replace(**{"eph": 255, "epv": 255, "custom_mode": 4} | fields)


def radio_room(volts: int = 13, base_mode: int = 217, **fields: int) -> mav.HighLatency2:
    """A computer beside an ArduPilot: custom0 is the voltage of its battery."""
    return NOTHING._replace(**{"custom0": volts, "custom_mode": base_mode | 4 << 8, "eph": 121, "epv": 9} | fields)


class Sky:
    """Messages of one vehicle on ways to one hardware interface, on a clock of its own."""

    def __init__(self, options: HardwareOptions | None = None) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(options)
        self._start = self.clock.now().mono
        self._counts: dict[Any, int] = {}

    def send(self, message: Any, way: Any = "satellite", sequence: int | None = None, **told: int) -> RobotStatus:
        """One message. The sender's clock runs with ours unless it is told otherwise."""
        if sequence is None:
            sequence = self._counts.get(way, 100) + 1 & 255
        self._counts[way] = sequence
        if type(message) is mav.HighLatency2:
            seconds = self.clock.now().mono - self._start + 1000
            message = message._replace(**{"timestamp": round(seconds * 1000)} | told)
        frame: Frame = frame_of(message, sequence=sequence)
        self.hw.on_frame(frame, self.clock.now(), way)
        return self.look() if frame.message_id in EDGES else self.wait(SETTLES + 1e-6)

    def beat(self, way: Any = "radio", *, armed: bool = False, autopilot: int = ARDUPILOT, **how: Any) -> RobotStatus:
        number = 4 if autopilot == ARDUPILOT else 4 << 16 | 4 << 24
        return self.send(mav.Heartbeat(number, QUAD, autopilot, 209 if armed else 81, 4 if armed else 3, 3), way, **how)

    def wait(self, seconds: float) -> RobotStatus:
        self.clock.advance(seconds)
        return self.look()

    def look(self) -> RobotStatus:
        now = self.clock.now()
        self.hw.read(now)
        for tracked in self.hw.vehicles:
            check_invariants(tracked.handle.status, tracked.handle.detail, self.hw.options)
            check_present(tracked, now, self.hw.options)
        return self.status

    @property
    def vehicle(self) -> Any:
        return next(self.hw.vehicles)

    @property
    def status(self) -> RobotStatus:
        status: RobotStatus = self.vehicle.handle.status
        return status

    @property
    def detail(self) -> Any:
        return self.vehicle.handle.detail

    @property
    def link(self) -> str:
        return str(self.detail.link.value)

    @property
    def belief(self) -> Belief:
        belief: Belief = self.vehicle.belief
        return belief

    @property
    def codes(self) -> list[int]:
        return [error.code for error in self.detail.errors]

    @property
    def inhibits(self) -> list[str]:
        return [inhibit.name for inhibit in self.detail.inhibits]
