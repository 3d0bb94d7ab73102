"""Publishers: what a controller requires of an output, and what the gateway provides to it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Hashable, Mapping, Sequence
from typing import NamedTuple, Protocol, TextIO

from ..clock import Instant
from ..json_object import JsonMapping
from .metrics import Metrics
from .status import RobotStatusMsg


class Publisher(Protocol):
    """One output. No method blocks: a publisher that cannot accept a message is `busy`, and is tried again soon.

    A class may derive from this one: then it is never busy, and has nothing to do in `service` and `close`.

    A publisher may have two more methods:

    - `forget(handle)`: this handle is gone, and no message of it follows. Its last message has the link state
      NEVER_SEEN. Release what belongs to the handle.
    - `rests_until(handle) -> float`: until when (monotonic seconds) it has no use for a periodic message of this
      handle. A controller leaves those out, and publishes each change nevertheless. It asks after each message; if
      the time becomes an earlier one, return `now` in `service`.

    A publisher class may set three more attributes. All default to False:

    - `live_only`: a replay of a recorded log runs without this publisher. Set it if receivers use the
      messages as the present state of the robot: a ground station, a broker, a live page.
    - `durable`: the publisher stores each change before `publish` returns. Durable publishers run first, so that no
      other output shows a change that a crash can still lose.
    - `one_handle`: the publisher gets the messages of one handle only, that of the first controller that names it. Set
      it if receivers cannot tell whose status they get.
    """

    periodic: bool
    """False: this publisher takes changes only, and no periodic messages. It may become False at any time, and True in
    a `service` that returns its `now`: the controllers are updated before the next one."""

    def busy(self) -> bool:
        """True while it cannot accept a message (a failed trylock of realtime_tools)."""
        return False

    def publish(self, msg: RobotStatusMsg) -> None:
        """Accept a message. Only called while not busy."""

    def service(self, now: Instant) -> float | None:
        """Do pending work: the rest of a line, a change that was held back. Return when to be called again (monotonic
        seconds), or None if nothing waits."""
        return None

    def close(self) -> None:
        """The last call: send the remaining messages and release all resources. A second call does nothing."""
        return  # so that a class need not have it


class Audience(NamedTuple):
    """A receiver of our MAVLink: an out, or one peer on a link."""

    key: Hashable
    """Identifies the audience for as long as it exists."""
    interval: float | None = None
    """Seconds between two ROBOT_STATUS of one vehicle, as set with MAV_CMD_SET_MESSAGE_INTERVAL. None: the default.
    inf: no messages."""
    mirror: bool = False
    """True for ground stations, which may not know ROBOT_STATUS; False for a vehicle."""
    systems: Container[int] | None = None
    """The system ids of the vehicles that it gets messages about. None: all."""


class MavlinkPort(Protocol):
    """Sends MAVLink with our identity."""

    def audiences(self) -> Sequence[Audience]:
        """The present receivers of messages about vehicles: the same object as before, if nothing has changed.

        The caller does not change it.
        """

    def requests(self) -> Collection[tuple[Hashable, int]]:
        """Requests for one ROBOT_STATUS since the last call: key of the audience, system id of the vehicle."""

    def send(self, message: NamedTuple, system: int, audience: Audience) -> None:
        """Send a message of `mavlink.definitions` about the vehicle with this system id."""


class PublisherContext(NamedTuple):
    """The arguments of a publisher."""

    options: Mapping[str, object]
    """The options of its mapping in the configuration; see `options`."""
    mavlink: MavlinkPort
    stdout: TextIO
    patient: bool = False
    """True on replay: the log waits for a slow reader, and no message is lost."""
    explain: Callable[[str, Instant], JsonMapping | None] | None = None
    """The evidence for each field of a handle, as `explain --as-json` prints it; None for an unknown handle or a
    vehicle that was not heard. Only the gateway's thread may call it. It takes 0.1 ms."""
    metrics: Callable[[Instant], Metrics] | None = None
    """The present values and counters, as `/metrics` prints them. Only the gateway's thread may call it."""
