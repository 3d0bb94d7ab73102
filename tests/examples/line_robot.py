"""A robot that sends lines such as `mode=auto powered=1 moving=0 stopped=0` to a UDP port."""

import socket
from collections.abc import Sequence

from mav_robot_status.clock import Instant
from mav_robot_status.interface import (
    Detail,
    Evidence,
    HardwareContext,
    IndustrialRobotStatusHandle,
    IoSource,
    LinkState,
    RobotHW,
    RobotMode,
    RobotStatus,
    TriState,
)

MODES = {"manual": RobotMode.MANUAL, "auto": RobotMode.AUTO}
STATES = {"0": TriState.FALSE, "1": TriState.TRUE}
SILENCE = 3.0  # s


class LineRobotHW(RobotHW):
    """A hardware interface with one socket. It is its own source."""

    def __init__(self, context: HardwareContext) -> None:
        super().__init__()
        self._robot = IndustrialRobotStatusHandle(context.name)
        self._robot.detail = Detail(link=LinkState.NEVER_SEEN)
        self.handles.register_handle(self._robot)
        self._line: dict[str, str] = {}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if not context.replay:
            self._socket.bind(("127.0.0.1", int(str(context.options["port"]))))

    def sources(self) -> Sequence[IoSource]:
        return [self]

    def fileno(self) -> int:
        return self._socket.fileno()

    def close(self) -> None:
        self._socket.close()

    def receive(self, now: Instant, limit: int) -> None:
        try:
            for _ in range(limit):
                line = self._socket.recv(1000).decode("ascii", "replace")
                self._line = dict(word.partition("=")[::2] for word in line.split())
                self._robot.heard_at = now.mono
        except OSError:  # no datagram is left
            return

    def read(self, now: Instant) -> None:
        heard_at = self._robot.heard_at
        if heard_at is None:
            return
        if now.mono - heard_at > SILENCE:
            self.set_status(self._robot, RobotStatus(), Detail(link=LinkState.LOST), {})
            return
        mode = MODES.get(self._line.get("mode", ""), RobotMode.UNKNOWN)
        names = ("stopped", "powered", "moving")
        stopped, powered, moving = (STATES.get(self._line.get(name, ""), TriState.UNKNOWN) for name in names)
        if stopped is TriState.TRUE:  # an emergency stop removes the power
            powered = TriState.FALSE
        possible = TriState.FALSE if powered is TriState.FALSE else TriState.UNKNOWN
        status = RobotStatus(mode, stopped, powered, motion_possible=possible, in_motion=moving)
        evidence = {"mode": Evidence("the robot reports its mode", f"mode={self._line.get('mode')}", heard_at)}
        self.set_status(self._robot, status, Detail(), evidence)
