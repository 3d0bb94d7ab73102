"""The gateway without its links: hardware, controllers and publishers, fed with frames and instants.

The same for a live link and for a recorded log, so that both give the same lines. No clock, no socket.
"""

from __future__ import annotations

import dataclasses
import math
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final, TextIO

from ..clock import Instant
from ..config import ControllerConfig, PublisherConfig
from ..controller import IndustrialRobotStatusController
from ..errors import ConfigError, MavRobotStatusError, UsageError
from ..hardware.robot_hw import MavlinkRobotHW
from ..hardware.tracked import Slot
from ..interface import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle, LinkState, PublisherContext
from . import plugins
from .guard import Guard, GuardedPublisher

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterator, Mapping

    from ..config import Config
    from ..hardware.tracked import Tracked
    from ..interface import Detail, MavlinkPort, Metrics, Publisher, RobotStatus
    from ..mavlink.framing import Values

NEVER: Final = Instant(0.0, 0)
"""The time of a plant that has not lived yet."""
DEFAULT_PUBLISHERS: Final = (PublisherConfig("json"), PublisherConfig("mavlink"), PublisherConfig("mirror"))
LIVE_PUBLISHERS: Final = frozenset({"mavlink", "mirror", "http", "mqtt"})
"""Those that a replay does without: there is nobody to hear MAVLink, and a page would show the end of the log."""
KEEPERS: Final = frozenset({"mqtt"})
"""They, and the controllers that have them, have their turn first wherever they are written: they keep on the disk what
others show, so that nothing was shown which is lost when we are killed."""
DEFAULT_CONTROLLER: Final = ControllerConfig(
    "robot_status_controller", "mav_robot_status/IndustrialRobotStatusController", {}, "default"
)
"""Runs on every handle where the configuration names no controllers."""


def check(config: Config) -> None:
    """Raise ConfigError for a controller or publisher that is not registered, an option of a publisher that it does not
    have, or a handle that nobody registers."""
    handles = [v.handle for v in config.vehicles] or [DEFAULT_HANDLE_NAME]
    for controller in config.controllers:
        plugins.load(plugins.CONTROLLERS, controller.type, controller.where)
        for publisher in _publishers(controller):
            _check_publisher(publisher, publisher.where or controller.where)
        name = handle_name(controller)
        if name not in handles and not _is_default(controller):
            there_are = f"there is no handle '{name}'; registered: " + ", ".join(f"'{h}'" for h in handles)
            hint = "" if config.vehicles else f". Write `vehicles: [{{handle: {name}}}]` to register it"
            raise ConfigError(f"{controller.where}: {there_are}{hint}")


def _check_publisher(publisher: PublisherConfig, where: str) -> None:
    made = plugins.load(plugins.PUBLISHERS, publisher.type, where)
    check_options: Callable[[Mapping[str, object]], object] | None = getattr(made, "check_options", None)
    if check_options is None:
        return
    try:
        check_options(publisher.options)
    except UsageError as error:
        raise ConfigError(f"{publisher.where}: {error}") if publisher.where else error from None


def handle_name(controller: ControllerConfig) -> str:
    """The handle that a controller of the configuration reads."""
    return str(controller.parameters.get("handle_name", DEFAULT_HANDLE_NAME))


def _is_default(controller: ControllerConfig) -> bool:
    """True for the default controller, perhaps with the command line's options: there is one for each handle."""
    return controller.where == DEFAULT_CONTROLLER.where


def _publishers(controller: ControllerConfig) -> tuple[PublisherConfig, ...]:
    return DEFAULT_PUBLISHERS if controller.publishers is None else controller.publishers


def _keeps_nothing(controller: ControllerConfig) -> bool:
    return KEEPERS.isdisjoint(publisher.type for publisher in _publishers(controller))


def _key(config: PublisherConfig) -> tuple[str, str]:
    """What two controllers share: one publisher for each type and set of options."""
    return config.type, repr(sorted(config.options.items()))


class _Post:
    """A controller, under guard, and the handle that it waits for, or publishes."""

    __slots__ = ("controller", "detail", "due", "guard", "handle", "running", "status", "updated")

    def __init__(self, name: str, controller: Any, handle: IndustrialRobotStatusHandle) -> None:
        self.controller = controller
        self.guard = Guard(f"controller '{name}'")
        self.handle = handle
        self.running = False
        self.updated = 0.0
        """When the controller was last updated, or started."""
        self.due = math.inf
        """What its `next_due` said then."""
        self.status: RobotStatus | None = None
        self.detail: Detail | None = None
        """What was in the handle then."""

    def start(self, now: Instant) -> None:
        """Start the controller; its first update is due at once."""
        self.guard.call(None, self.controller.starting, now)
        self.running, self.updated, self.due = True, now.mono, -math.inf

    def update(self, now: Instant) -> None:
        """Update the controller if its handle has changed, or what it waits for has come."""
        status, detail = self.handle.status, self.handle.detail
        if now.mono < self.due and status is self.status and detail is self.detail:
            return
        period, self.updated = now.mono - self.updated, now.mono
        self.status, self.detail = status, detail
        self.guard.call(None, self.controller.update, now, period)
        self.due = self.guard.call(math.inf, self.controller.next_due, now.mono)

    def stop(self, now: Instant) -> None:
        """Stop the controller."""
        self.guard.call(None, self.controller.stopping, now)
        self.running, self.due = False, math.inf


class Plant:
    """What turns frames into published statuses."""

    def __init__(
        self,
        config: Config,
        port: MavlinkPort,
        stdout: TextIO,
        *,
        patient: bool = False,
        metrics: Callable[[Instant], Metrics] | None = None,
    ) -> None:
        """Build the parts. Raises ConfigError for a controller or publisher that cannot be had.

        `metrics` is for the publishers, see `PublisherContext`.
        """
        self._context = PublisherContext({}, port, stdout, patient, self.explain, metrics)
        self.publishers: dict[tuple[str, str], Publisher] = {}
        self._service_due = math.inf
        self.now = NEVER
        """Up to when it has lived."""
        with ExitStack() as undo:
            undo.callback(self._close_publishers)
            self._furnish(config)
            undo.pop_all()

    def _furnish(self, config: Config) -> None:
        """Make what the configuration names, but for the publishers that are there."""
        check(config)
        slots = [Slot(v.system, v.component, v.handle) for v in config.vehicles]
        self.hw = MavlinkRobotHW(config.hardware, slots, config.identity.component)
        self.hw.speak_as(config.identity.system, config.identity.component)
        self._controllers = sorted(config.controllers or (DEFAULT_CONTROLLER,), key=_keeps_nothing)
        self._posts: list[_Post] = []
        self._idle: list[_Post] = []
        """Those of them that do not run."""
        self._posts_due = math.inf
        self._named = {slot.handle for slot in slots}
        """Handles that publish from the start, before their vehicle is heard."""
        self._seen: set[str] = set()
        for controller in self._controllers:  # before a vehicle is heard: what is wrong with an output shows now
            self._publishers(controller)
        self._attend()

    def change(self, config: Config, keep: Container[tuple[int, int]], now: Instant) -> None:
        """Live on by another configuration. The vehicles with the ids `keep` are kept, and the publishers that stay.

        A last status tells that the other vehicles are not known any more. Raises as the constructor does; then some
        parts are gone: change back.
        """
        check(config)
        self.hw.forget(keep)
        self.hw.changed = True  # for the last status of those that are forgotten
        self.tick(now)
        self._stop(now)
        stay = {_key(p) for c in config.controllers or (DEFAULT_CONTROLLER,) for p in _publishers(c)}
        for key in self.publishers.keys() - stay:  # before others are opened: they may want the same port
            self.publishers.pop(key).close()
        before = self.hw
        try:
            self._furnish(config)
        finally:
            self.hw.adopt(before)

    def publishes(self, kind: str) -> bool:
        """Whether there is a publisher of this type."""
        return any(name == kind for name, _ in self.publishers)

    def take(self, frame: Values, now: Instant) -> Tracked | None:
        """Take one frame; the vehicle if it is an autopilot's heartbeat."""
        return self.hw.take(frame, now)

    def explain(self, handle: str, now: Instant) -> dict[str, Any] | None:
        """Why each field of a handle has its value; None if its vehicle was not heard."""
        from .explain import explanation  # it is built on this module, and wanted only while somebody looks

        tracked = self.hw.explained(handle, now)
        return None if tracked is None else explanation(tracked, now)

    def skipped(self, publisher: Publisher) -> int:
        """Messages that were due while this publisher was busy; a third party's controller need not count them."""
        ours = (post.controller for post in self._posts if isinstance(post.controller, IndustrialRobotStatusController))
        return sum(controller.skipped(publisher) for controller in ours)

    def tick(self, now: Instant) -> None:
        """Read the hardware, update the controllers for which something has changed or is due, let the publishers do
        what waits."""
        self.hw.read(now)
        self._attend()
        self.now = now
        if self._idle or self.hw.changed or now.mono >= self._posts_due:
            self._update(now)
        self._service_due = math.inf
        for publisher in self.publishers.values():
            again = publisher.service(now)
            if again is not None:
                self._service_due = min(self._service_due, again)

    def next_due(self, now: float, until: float = -math.inf) -> float:
        """When (monotonic seconds) `tick` has something to do, if no frame arrives before.

        `until` is handed to the hardware, see there.
        """
        if self.hw.changed or (self._idle and any(map(self._may_start, self._idle))):
            return now
        return min(self.hw.next_due(until), self._service_due, self._posts_due)

    def forget(self, now: Instant) -> None:
        """Begin anew with what is heard, as at the start."""
        self._stop(now)
        self.hw.forget()

    def close(self, now: Instant) -> None:
        """Stop the controllers, close the publishers."""
        try:
            self._stop(now)
        finally:
            self._close_publishers()

    def _close_publishers(self) -> None:
        with ExitStack() as steps:  # each is closed, whatever the others raise
            for publisher in self.publishers.values():
                steps.callback(publisher.close)

    def _stop(self, now: Instant) -> None:
        for post in self._posts:
            if post.running:
                post.stop(now)
        self._idle, self._posts_due = list(self._posts), math.inf

    def _update(self, now: Instant) -> None:
        self.hw.changed = False
        for post in filter(self._may_start, self._idle):
            post.start(now)
        self._idle = [post for post in self._idle if not post.running]
        for post in self._posts:
            if post.running:
                post.update(now)
        self._posts_due = min((post.due for post in self._posts), default=math.inf)

    def _may_start(self, post: _Post) -> bool:
        return post.handle.name in self._named or post.handle.detail.link is not LinkState.NEVER_SEEN

    def _attend(self) -> None:
        """Make the controllers of handles that have become known."""
        if len(self.hw.handles) == len(self._seen):
            return
        for name in self.hw.handles.get_names():
            if name in self._seen:
                continue
            self._seen.add(name)
            for controller in self._controllers:
                if _is_default(controller):
                    parameters = {**controller.parameters, "handle_name": name}
                    self._post(dataclasses.replace(controller, parameters=parameters))
                elif handle_name(controller) == name:
                    self._post(controller)

    def _post(self, config: ControllerConfig) -> None:
        """Raises ConfigError if the controller cannot be made."""
        make = plugins.load(plugins.CONTROLLERS, config.type, config.where)
        publishers = self._publishers(config)
        with _explained(f"{config.where}: controller '{config.name}'"):
            controller = make()
            controller.init(self.hw, config.parameters, publishers)
            self._posts.append(_Post(config.name, controller, controller.handle))
            self._idle.append(self._posts[-1])

    def _publishers(self, config: ControllerConfig) -> list[Publisher]:
        """The publishers of a controller; on replay without those for the living."""
        heard = [p for p in _publishers(config) if p.type not in LIVE_PUBLISHERS or not self._context.patient]
        return [self._publisher(p, config.where) for p in sorted(heard, key=lambda p: p.type not in KEEPERS)]

    def _publisher(self, config: PublisherConfig, where: str) -> Publisher:
        """The publisher that there is, or a new one."""
        key = _key(config)
        if key not in self.publishers:
            make: Callable[[PublisherContext], Publisher] = plugins.load(plugins.PUBLISHERS, config.type, where)
            with _explained(f"{where}: publisher '{config.type}'"):
                made = make(self._context._replace(options=config.options))
            ours = config.type in plugins.OURS[plugins.PUBLISHERS]
            self.publishers[key] = made if ours else GuardedPublisher(made, config.type)
        return self.publishers[key]


@contextmanager
def _explained(what: str) -> Iterator[None]:
    """Whatever a third party's code raises while it is made is a ConfigError."""
    try:
        yield
    except MavRobotStatusError:
        raise
    except Exception as error:
        raise ConfigError(f"{what} cannot be made: {type(error).__name__}: {error}") from error
