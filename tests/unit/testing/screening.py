"""Plays a scenario and derives the status, without sockets and without waits.

It connects the model of the fake autopilot, our parser and the hardware interface. The requests of the hardware
interface go back to the model. Every status is checked against the invariants.
"""

from __future__ import annotations

from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.hardware.mavlink.vehicle import TrackedVehicle
from mav_robot_status.interface import Detail, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.testing import ManualClock, Scenario, decode
from mav_robot_status.testing.commands import answer
from mav_robot_status.testing.vehicle_model import VehicleModel
from tests.pymavlink_dialect import (
    MAVLink,
    MAVLink_command_long_message,
    MAVLink_heartbeat_message,
    MAVLink_message,
)

from ..hardware.mavlink.driver import check_invariants, check_present

TICK = 0.05
MODES = {RobotMode.MANUAL: "MANUAL", RobotMode.AUTO: "AUTO", RobotMode.UNKNOWN: "?"}
STATES = {TriState.TRUE: "T", TriState.FALSE: "F", TriState.UNKNOWN: "?"}


def line(status: RobotStatus) -> str:
    """mode | e_stopped, drives_powered, motion_possible, in_motion, in_error | error_code, on one line."""
    fields = " ".join(STATES[value] for value in status[1:6])
    return f"{MODES[status.mode]} | {fields} | {status.error_code}"


class Screening:
    """One scenario with the hardware interface and a ground station on one link."""

    def __init__(self, scenario: Scenario, options: HardwareOptions | None = None) -> None:
        self.clock = ManualClock()
        self.hw = MavlinkRobotHW(options)
        self._start = self.clock.now().mono
        self._model = VehicleModel(scenario, self._start)
        self._parser = Parser(WANTED_IDS)
        self._handle(MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self._tick()

    def at(self, seconds: float) -> str:
        """Play until this time of the scenario. Return the status as by `line`."""
        while self.clock.now().mono - self._start < seconds - 1e-6:
            self.clock.advance(TICK)
            self._tick()
        return line(self.status)

    def receive(self, message: MAVLink_message, sender: tuple[int, int] = (1, 1)) -> str:
        """Receive one more message, from the vehicle or from another sender. Return the status."""
        mav = MAVLink(None, srcSystem=sender[0], srcComponent=sender[1])
        if sender == (1, 1):  # the message takes part in the count of the vehicle
            mav.seq, self._model._seq = self._model._seq, (self._model._seq + 1) % 256
        self._receive(message.pack(mav))
        self._read()
        return line(self.status)

    def command(self, command: int, *params: float) -> None:
        """Send a command of the ground station to the vehicle. It answers at the next tick."""
        padded = [*params, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][:7]
        self._handle(MAVLink_command_long_message(1, 1, command, 0, *padded))

    def _handle(self, message: MAVLink_message) -> None:
        """The ground station sends a message to the vehicle."""
        for received in decode(message.pack(MAVLink(None, srcSystem=255, srcComponent=190))):
            answer(self._model, received)

    def _tick(self) -> None:
        self._receive(b"".join(out.frame() for out in self._model.run(self.clock.now())))
        self._read()
        for request in self.hw.due_requests(self.clock.now()):
            for message in decode(encode(request.message, system=1, component=192, sequence=0)):
                answer(self._model, message)

    def _receive(self, data: bytes) -> None:
        for frame in self._parser.feed(data):
            self.hw.on_frame(frame, self.clock.now())

    def _read(self) -> None:
        now = self.clock.now()
        self.hw.read(now)
        check_invariants(self.status, self.detail, self.hw.options)
        check_present(self.vehicle, now, self.hw.options)

    @property
    def vehicle(self) -> TrackedVehicle:
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
