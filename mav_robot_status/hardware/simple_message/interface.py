"""`SimpleMessageRobotHW`: a robot whose controller serves its status to ROS-Industrial. It sends nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ...clock import Instant
from ...interface import HardwareContext, Option, Options
from ...simple_message import ORDERS, STATE_PORT, StatusFrame, StatusReader
from ..tcp_arm import TcpArm, Values
from .status import values_of


@dataclass(frozen=True)
class SimpleMessageHardwareOptions(Options):
    """The options of the hardware interface `simple_message`."""

    host: Annotated[str, Option("the controller, or another gateway")]
    port: Annotated[float, Option("state port", low=1, high=65535)] = STATE_PORT
    byte_order: Annotated[str, Option("byte order of the controller", choices=tuple(ORDERS))] = "little"


class SimpleMessageRobotHW(TcpArm[StatusFrame]):
    """One robot, as a handle with the name of the interface."""

    options_type = SimpleMessageHardwareOptions
    motion_needs_power = False
    """A controller may switch the drives on for a motion command."""

    def __init__(self, context: HardwareContext) -> None:
        options = SimpleMessageHardwareOptions.read("simple_message", context.options)
        self._byte_order = options.byte_order
        super().__init__(context, options.host, options.port)

    def begin(self) -> None:
        """Read from the start of a frame."""
        self._reader = StatusReader(self._byte_order)

    def feed(self, data: bytes, now: Instant) -> StatusFrame | None:
        """The last frame in `data`."""
        frames = self._reader.feed(data)
        return frames[-1] if frames else None

    def values(self, message: StatusFrame, heard_at: float, now: Instant) -> Values:
        """The status that a frame proves."""
        return values_of(message, self.robot.detail, now.unix_us, heard_at)

    def awaited(self) -> str:
        """A frame."""
        return "no status arrived"
