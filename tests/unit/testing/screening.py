"""A scenario on the way to a status, without sockets and without waiting.

The fake's model and its encoder (pymavlink), our parser, the hardware interface; what that asks for goes back to the
vehicle. Every status on the way is held against the invariants.
"""

from __future__ import annotations

from mav_robot_status.hardware.kinds import WANTED_IDS
from mav_robot_status.hardware.options import HardwareOptions
from mav_robot_status.hardware.robot_hw import MavlinkRobotHW
from mav_robot_status.hardware.tracked import Tracked
from mav_robot_status.interface import Detail, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.mavlink.pymavlink_dialect import (
    MAVLink,
    MAVLink_command_long_message,
    MAVLink_heartbeat_message,
    MAVLink_message,
)
from mav_robot_status.testing import ManualClock, Scenario, decode
from mav_robot_status.testing.commands import answer
from mav_robot_status.testing.vehicle_model import VehicleModel

from ..hardware.driver import check_invariants, check_present

TICK = 0.05
MODES = {RobotMode.MANUAL: "MANUAL", RobotMode.AUTO: "AUTO", RobotMode.UNKNOWN: "?"}
STATES = {TriState.TRUE: "T", TriState.FALSE: "F", TriState.UNKNOWN: "?"}


def line(status: RobotStatus) -> str:
    """mode | e_stopped, drives_powered, motion_possible, in_motion, in_error | error_code, on one line."""
    fields = " ".join(STATES[value] for value in status[1:6])
    return f"{MODES[status.mode]} | {fields} | {status.error_code}"


class Screening:
    """One scenario, watched by the hardware interface and by a ground station that is heard on the link."""

    def __init__(self, scenario: Scenario, options: HardwareOptions | None = None) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(options)
        self._start = self.clock.now().mono
        self._model = VehicleModel(scenario, self._start)
        self._mav = MAVLink(None, srcSystem=1, srcComponent=1)
        self._parser = Parser(WANTED_IDS)
        answer(self._model, MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self._tick()

    def at(self, seconds: float) -> str:
        """Play until that time of the scenario; the status then, as `line` says it."""
        while self.clock.now().mono - self._start < seconds - 1e-6:
            self.clock.advance(TICK)
            self._tick()
        return line(self.status)

    def say(self, message: MAVLink_message, sender: tuple[int, int] = (1, 1)) -> str:
        """One message more on the link, by the vehicle or by somebody else; the status then."""
        self._take(message.pack(MAVLink(None, srcSystem=sender[0], srcComponent=sender[1])))
        self._read()
        return line(self.status)

    def ask(self, command: int, *params: float) -> None:
        """A ground station's command reaches the vehicle; it answers with the next tick."""
        padded = [*params, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][:7]
        station = MAVLink(None, srcSystem=255, srcComponent=190)
        for message in decode(MAVLink_command_long_message(1, 1, command, 0, *padded).pack(station)):
            answer(self._model, message)

    def _tick(self) -> None:
        self._take(b"".join(self._pack(out.message, out.seq) for out in self._model.run(self.clock.now())))
        self._read()
        for ask in self.hw.write(self.clock.now()):
            for message in decode(encode(ask.message, system=1, component=192, sequence=0)):
                answer(self._model, message)

    def _pack(self, message: MAVLink_message, seq: int) -> bytes:
        self._mav.seq = seq
        return message.pack(self._mav)

    def _take(self, data: bytes) -> None:
        for frame in self._parser.feed(data):
            self.hw.take(frame, self.clock.now())

    def _read(self) -> None:
        now = self.clock.now()
        self.hw.read(now)
        check_invariants(self.status, self.detail, self.hw.options)
        check_present(self.vehicle, now, self.hw.options)

    @property
    def vehicle(self) -> Tracked:
        tracked = self.hw.find(1, 1)
        assert tracked is not None
        return tracked

    @property
    def status(self) -> RobotStatus:
        return self.vehicle.handle.status

    @property
    def detail(self) -> Detail:
        return self.vehicle.handle.detail

    @property
    def flight_mode(self) -> str | None:
        return self.detail.vehicle.flight_mode

    @property
    def inhibits(self) -> dict[str, str | None]:
        return {inhibit.name: inhibit.text for inhibit in self.detail.inhibits}
