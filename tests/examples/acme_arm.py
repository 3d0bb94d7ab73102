"""An arm that sends lines such as `auto=1 stopped=0 powered=1 moving=0` to every TCP client."""

from collections.abc import Sequence

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.tcp_source import TcpSource
from mav_robot_status.interface import (
    Detail,
    HardwareContext,
    IndustrialRobotStatusHandle,
    LinkState,
    RobotHW,
    RobotMode,
    RobotStatus,
    TriState,
)

MODES = {b"0": RobotMode.MANUAL, b"1": RobotMode.AUTO}
STATES = {b"0": TriState.FALSE, b"1": TriState.TRUE}
SILENCE, LONGEST = 3.0, 1000  # s, bytes


class AcmeRobotHW(RobotHW):
    stops_cut_power = False  # it brakes under power

    def __init__(self, context: HardwareContext) -> None:
        super().__init__()
        self._arm = IndustrialRobotStatusHandle(context.name)
        self._arm.detail = Detail(link=LinkState.NEVER_SEEN)
        self.handles.register_handle(self._arm)
        self._rest, self._words = b"", dict[bytes, bytes]()
        host, port = str(context.options.get("host")), float(str(context.options.get("port", 7000)))
        self._sources = [] if context.replay else [TcpSource(host, port, self._heard)]

    def sources(self) -> Sequence[TcpSource]:
        return self._sources

    def close(self) -> None:
        for source in self._sources:
            source.close()

    def _heard(self, data: bytes, now: Instant) -> None:
        if self._sources[0].is_new():  # half a line of the connection before means nothing
            self._rest = b""
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-LONGEST:]
        for line in lines:
            words = dict(word.partition(b"=")[::2] for word in line.split())
            if b"powered" in words:
                self._words, self._arm.heard_at = words, now.mono

    def read(self, now: Instant) -> None:
        for source in self._sources:
            source.turn(now)
        if self._arm.heard_at is None:
            return
        if now.mono - self._arm.heard_at > SILENCE:
            self.set_status(self._arm, RobotStatus(), Detail(link=LinkState.LOST))
            return
        names = (b"stopped", b"powered", b"moving")
        stopped, powered, moving = (STATES.get(self._words.get(name, b""), TriState.UNKNOWN) for name in names)
        blocked = stopped is TriState.TRUE or powered is TriState.FALSE
        possible = TriState.FALSE if blocked else TriState.UNKNOWN
        mode = MODES.get(self._words.get(b"auto", b""), RobotMode.UNKNOWN)
        self.set_status(self._arm, RobotStatus(mode, stopped, powered, possible, moving), Detail())
