"""The gateway without its links: hardware, controllers and publishers, fed with frames and instants.

The same for a live link and for a recorded log, so that both give the same lines. No clock, no socket.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Final, TextIO

from ..config import ControllerConfig, PublisherConfig
from ..errors import ConfigError
from ..hardware.robot_hw import MavlinkRobotHW, Slot
from ..interface import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle, LinkState, PublisherContext
from . import plugins

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..clock import Instant
    from ..config import Config
    from ..hardware.robot_hw import Tracked
    from ..interface import MavlinkPort, Publisher
    from ..mavlink.framing import Frame

DEFAULT_PUBLISHERS: Final = (PublisherConfig("json"), PublisherConfig("mavlink"))
DEFAULT_CONTROLLER: Final = ControllerConfig(
    "robot_status_controller", "mav_robot_status/IndustrialRobotStatusController", {}, "default"
)
"""Runs on every handle where the configuration names no controllers."""


def check(config: Config) -> None:
    """Raise ConfigError for a controller or publisher that is not registered, or a handle that nobody registers."""
    for controller in config.controllers:
        plugins.load(plugins.CONTROLLERS, controller.type, controller.where)
        for publisher in _publishers(controller):
            plugins.load(plugins.PUBLISHERS, publisher.type, controller.where)
        name = handle_name(controller)
        if not config.vehicles and name != DEFAULT_HANDLE_NAME:
            raise ConfigError(
                f"{controller.where}: there is no handle '{name}'; without `vehicles` there is "
                f"'{DEFAULT_HANDLE_NAME}', of the first autopilot heard. "
                f"Write `vehicles: [{{handle: {name}}}]` to give it that name"
            )


def handle_name(controller: ControllerConfig) -> str:
    """The handle that a controller of the configuration reads."""
    return str(controller.parameters.get("handle_name", DEFAULT_HANDLE_NAME))


def _publishers(controller: ControllerConfig) -> tuple[PublisherConfig, ...]:
    return DEFAULT_PUBLISHERS if controller.publishers is None else controller.publishers


class _Post:
    """A controller and the handle that it waits for, or publishes."""

    __slots__ = ("controller", "handle", "running")

    def __init__(self, controller: Any, handle: IndustrialRobotStatusHandle) -> None:
        self.controller = controller
        self.handle = handle
        self.running = False


class Plant:
    """What turns frames into published statuses."""

    def __init__(self, config: Config, port: MavlinkPort, stdout: TextIO, *, patient: bool = False) -> None:
        """Build the parts. Raises ConfigError for a controller or publisher that cannot be had."""
        slots = [Slot(v.system, v.component, v.handle) for v in config.vehicles]
        self.hw = MavlinkRobotHW(config.hardware, slots, config.identity.component)
        self._config = config
        self._context = PublisherContext({}, port, stdout, patient)
        self.publishers: dict[tuple[str, str], Publisher] = {}
        self._posts: list[_Post] = []
        self._named = {slot.handle for slot in slots}
        """Handles that publish from the start, before their vehicle is heard."""
        self._seen: set[str] = set()
        self._service_due = math.inf
        self._last: float | None = None
        check(config)
        self._attend()

    def take(self, frame: Frame, now: Instant) -> Tracked | None:
        """Take one frame; the vehicle if it is an autopilot's heartbeat."""
        return self.hw.take(frame, now)

    def tick(self, now: Instant) -> None:
        """Read the hardware, update the controllers, let the publishers do what waits."""
        self.hw.read(now)
        self._attend()
        period = 0.0 if self._last is None else now.mono - self._last
        self._last = now.mono
        for post in self._posts:
            if not post.running and self._may_start(post):
                post.controller.starting(now)
                post.running = True
            if post.running:
                post.controller.update(now, period)
        self._service_due = math.inf
        for publisher in self.publishers.values():
            again = publisher.service(now)
            if again is not None:
                self._service_due = min(self._service_due, again)

    def next_due(self, now: float) -> float:
        """When (monotonic seconds) `tick` has something to do, if no frame arrives before."""
        due = min(self.hw.next_due(), self._service_due)
        for post in self._posts:
            if post.running:
                due = min(due, post.controller.next_due(now))
            elif self._may_start(post):
                return now
        return due

    def forget(self, now: Instant) -> None:
        """Begin anew with what is heard, as at the start."""
        self._stop(now)
        self.hw.forget()

    def close(self, now: Instant) -> None:
        """Stop the controllers, close the publishers."""
        self._stop(now)
        for publisher in self.publishers.values():
            publisher.close()

    def _stop(self, now: Instant) -> None:
        for post in self._posts:
            if post.running:
                post.controller.stopping(now)
                post.running = False

    def _may_start(self, post: _Post) -> bool:
        return post.handle.name in self._named or post.handle.detail.link is not LinkState.NEVER_SEEN

    def _attend(self) -> None:
        """Make the controllers of handles that have become known."""
        for name in self.hw.handles.get_names():
            if name in self._seen:
                continue
            self._seen.add(name)
            for controller in self._config.controllers or (DEFAULT_CONTROLLER,):
                if controller.where == DEFAULT_CONTROLLER.where:
                    # the default controller, perhaps with the command line's options: one for each handle
                    parameters = {**controller.parameters, "handle_name": name}
                    self._post(dataclasses.replace(controller, parameters=parameters))
                elif handle_name(controller) == name:
                    self._post(controller)

    def _post(self, config: ControllerConfig) -> None:
        controller = plugins.load(plugins.CONTROLLERS, config.type, config.where)()
        publishers = [self._publisher(p, config.where) for p in _publishers(config)]
        controller.init(self.hw, config.parameters, publishers)
        self._posts.append(_Post(controller, controller.handle))

    def _publisher(self, config: PublisherConfig, where: str) -> Publisher:
        """One publisher for each type and set of options: two controllers may share an output."""
        key = (config.type, repr(sorted(config.options.items())))
        if key not in self.publishers:
            create: Callable[[PublisherContext], Publisher] = plugins.load(plugins.PUBLISHERS, config.type, where)
            self.publishers[key] = create(self._context._replace(options=config.options))
        return self.publishers[key]
