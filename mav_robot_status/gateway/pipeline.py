"""One turn of the gateway: read the hardware, update the controllers, serve the publishers. No clock, no socket.

A live gateway and a replay use the same pipeline, so both write the same lines.
"""

from __future__ import annotations

import dataclasses
import math
from contextlib import ExitStack
from itertools import count
from operator import attrgetter
from typing import TYPE_CHECKING, Final, TextIO

from ..clock import Instant
from ..controller import IndustrialRobotStatusController
from ..due_times import DueTimes
from ..interface import (
    Inhibit,
    InterfaceManager,
    LinkState,
    PublisherContext,
    RobotStatus,
    RobotStatusMsg,
)
from ..interface.explanation import explanation
from . import plugins
from .controller_config import (
    DEFAULT_CONTROLLER,
    check,
    check_handles,
    handle_name,
    has_no_durable_publisher,
    is_default,
    is_durable,
    is_live_only,
    publisher_key,
    publishers_of,
)
from .guards import as_config_error
from .guards.controller import GuardedController
from .guards.publisher import GuardedPublisher
from .handles import SingleHandles, UnreadHandles

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ..config import Config, ControllerConfig, PublisherConfig
    from ..interface import HardwareInterface, IndustrialRobotStatusHandle, MavlinkPort, Metrics, Publisher
    from ..json_object import JsonObject
    from .observer import Observer

IN_ORDER: Final = attrgetter("number")
NEVER: Final = Instant(0.0, 0)
"""The time of a pipeline that has not run yet."""


class Pipeline:
    """Reads the hardware, and publishes the statuses in its handles."""

    def __init__(
        self,
        config: Config,
        hw: HardwareInterface,
        port: MavlinkPort,
        stdout: TextIO,
        *,
        patient: bool = False,
        metrics: Callable[[Instant], Metrics] | None = None,
        observers: Sequence[Observer] = (),
    ) -> None:
        """Make the controllers and publishers. Raises ConfigError if one of them cannot be made.

        `metrics` is passed to the publishers, see `PublisherContext`.
        """
        self.hw = hw
        self._context = PublisherContext({}, port, stdout, patient, self.explain, metrics)
        self.publishers: dict[tuple[str, str], Publisher] = {}
        self._observers = observers
        self._numbers = count()
        self._service_due = math.inf
        self.now = NEVER
        """The instant of the last tick."""
        with ExitStack() as undo:
            undo.callback(self._close_publishers)
            self._configure(config)
            undo.pop_all()

    def _configure(self, config: Config) -> None:
        """Make the controllers and publishers of a configuration. Publishers that exist are kept."""
        check(config)
        self._named = set(self.hw.handles.get_names())
        """Handles that are published from the start, before a message of their robot arrives."""
        check_handles(config, self._named)
        self._interfaces = InterfaceManager()
        self._interfaces.register_interface(self.hw.handles)
        self._single_handles = SingleHandles(config)
        self._configs = sorted(config.controllers or (DEFAULT_CONTROLLER,), key=has_no_durable_publisher)
        self._unread = UnreadHandles(self._configs)
        self._controllers: list[GuardedController] = []
        self._idle: list[GuardedController] = []
        """The controllers that do not run."""
        self._due: DueTimes[GuardedController] = DueTimes()
        self._served: set[tuple[tuple[str, str], str]] = set()
        """The key of a publisher with the name of a handle that it gets."""
        self._seen: dict[str, IndustrialRobotStatusHandle] = {}
        """The handles that have their controllers."""
        self._version = -1
        """The version of the handles at that time."""
        for controller in self._configs:  # before the first heartbeat, so that a faulty output fails at the start
            self._publishers(publishers_of(controller), controller.where)
        self._serve_handles(NEVER)

    def change(self, config: Config, renewed: Callable[[], HardwareInterface], now: Instant) -> None:
        """Apply another configuration. Publishers that are in both configurations are kept.

        Before this call the hardware forgets the robots that the new configuration lacks. `change` publishes a last
        status of them, and then calls `renewed` for the new hardware. Raises as the constructor does. After an error
        some parts are closed: change back.
        """
        check(config)
        self.tick(now)
        self._stop(now)
        kept = {publisher_key(p) for c in config.controllers or (DEFAULT_CONTROLLER,) for p in publishers_of(c)}
        for key in self.publishers.keys() - kept:  # first close, then open: a new publisher may use the same port
            self.publishers.pop(key).close()
        before, handles = self._served, dict(self._seen)
        self.hw = renewed()
        self._configure(config)
        for key, name in sorted(before - self._served):
            publisher = self.publishers.get(key)
            if publisher is not None:
                self._release(publisher, handles[name], now)

    @staticmethod
    def _release(publisher: Publisher, handle: IndustrialRobotStatusHandle, now: Instant) -> None:
        """Publish that nothing is known of a robot that this publisher gets no more of, and let it forget the robot."""
        detail = handle.detail
        if detail.link is not LinkState.NEVER_SEEN:
            why = Inhibit("LINK_STALE", "the configuration no longer publishes it here", now.unix_us)
            gone = detail.lost(why, LinkState.NEVER_SEEN)
            publisher.publish(RobotStatusMsg(handle.name, now.unix_us, RobotStatus(), gone, None))
            publisher.service(now)
        forget: Callable[[str], None] = getattr(publisher, "forget", _keep)
        forget(handle.name)

    def explain(self, handle: str, now: Instant) -> JsonObject | None:
        """Why each field of a handle has its value. None for an unknown handle, and for a robot never heard."""
        if handle not in self.hw.handles.get_names():
            return None
        self.hw.explain(handle, now)
        found = self.hw.handles.get_handle(handle)
        return None if found.detail.link is LinkState.NEVER_SEEN else explanation(found, now)

    def skipped(self, publisher: Publisher) -> int:
        """Messages that were due while this publisher was busy. Only our own controllers count them."""
        found = (guarded.controller for guarded in self._controllers)
        ours = (controller for controller in found if isinstance(controller, IndustrialRobotStatusController))
        return sum(controller.skipped(publisher) for controller in ours)

    def tick(self, now: Instant) -> None:
        """Read the hardware, update the controllers that are due or whose handle has changed, serve the publishers."""
        self.hw.read(now)
        if self.hw.handles.version != self._version:
            self._serve_handles(now)
        self.now = now
        if self._idle or self.hw.changed or now.mono >= self._due.first:
            self._update(now)
        self._service_due = math.inf
        for publisher in self.publishers.values():
            again = publisher.service(now)
            if again is not None:
                self._service_due = min(self._service_due, again)
        if self._service_due <= now.mono:
            self._look_again(now)
        for observer in self._observers:
            observer.on_tick(self.hw.handles, now)

    def next_due(self, now: float, until: float = -math.inf) -> float:
        """When (monotonic seconds) `tick` has something to do, unless a frame arrives first.

        `until` is passed to `HardwareInterface.next_due`.
        """
        if self.hw.changed or (self._idle and any(map(self._may_start, self._idle))):
            return now
        due = min(self._service_due, self._due.first)
        return min(self.hw.next_due(min(until, due)), due)

    def forget(self, now: Instant) -> None:
        """Return to the state at the start: no robot was heard."""
        self._stop(now)
        self.hw.forget()

    def close(self, now: Instant) -> None:
        """Stop the controllers, close the publishers."""
        try:
            self._stop(now)
        finally:
            self._close_publishers()

    def _close_publishers(self) -> None:
        with ExitStack() as steps:  # close all, even if one raises
            for publisher in self.publishers.values():
                steps.callback(publisher.close)

    def _stop(self, now: Instant) -> None:
        for controller in self._controllers:
            if controller.running:
                controller.stop(now)
        self._idle, self._due = list(self._controllers), DueTimes()

    def _update(self, now: Instant) -> None:
        if self._idle or self.hw.changed:
            self.hw.changed = False
            for controller in filter(self._may_start, self._idle):
                controller.start(now)
            self._idle = [controller for controller in self._idle if not controller.running]
            mono = now.mono  # no call for the many controllers that have nothing to do
            concerned = [
                c
                for c in self._controllers
                if c.handle.status is not c.status or c.handle.detail is not c.detail or mono >= c.due
            ]
        else:
            concerned = sorted(self._due.until(now.mono), key=IN_ORDER)
        for controller in concerned:
            if controller.running:
                controller.update(now)
                self._due.set(controller, controller.due)

    def _look_again(self, now: Instant) -> None:
        """Update all controllers in the next tick: a publisher may take periodic messages again."""
        for controller in self._controllers:
            if controller.running:
                controller.due = now.mono
                self._due.set(controller, now.mono)

    def _may_start(self, controller: GuardedController) -> bool:
        handle = controller.handle
        return handle.name in self._named or handle.detail.link is not LinkState.NEVER_SEEN

    def _serve_handles(self, now: Instant) -> None:
        """End the controllers of removed handles, and make those of new ones."""
        self._version = self.hw.handles.version
        present = {handle.name: handle for handle in self.hw.handles}
        gone = [handle for name, handle in self._seen.items() if present.get(name) is not handle]
        if gone:
            self._end(gone, now)
        for name, handle in present.items():
            if name in self._seen:
                continue
            self._seen[name] = handle
            self._unread.note(name)
            for controller in self._configs:
                if is_default(controller):
                    parameters = {**controller.parameters, "handle_name": name}
                    self._add_controller(dataclasses.replace(controller, parameters=parameters))
                elif handle_name(controller) == name:
                    self._add_controller(controller)

    def _end(self, gone: Sequence[IndustrialRobotStatusHandle], now: Instant) -> None:
        """Publish the last status of these handles, and end their controllers."""
        names = [handle.name for handle in gone]
        for controller in self._controllers:
            if controller.handle.name in names and controller.running:
                controller.update(now)
                controller.stop(now)
                self._due.set(controller, math.inf)
        self._controllers = [c for c in self._controllers if c.handle.name not in names]
        self._idle = [c for c in self._idle if c.handle.name not in names]
        for publisher in self.publishers.values():
            publisher.service(now)  # it hands on what it holds before it forgets the handle
            forget: Callable[[str], None] = getattr(publisher, "forget", _keep)
            for name in names:
                forget(name)
        for name in names:
            del self._seen[name]
        self._served = {(key, name) for key, name in self._served if name in self._seen}

    def _add_controller(self, config: ControllerConfig) -> None:
        """Raises ConfigError if the controller cannot be made."""
        make = plugins.load(plugins.CONTROLLERS, config.type, config.where)
        served = [p for p in publishers_of(config) if self._single_handles.serves(p, config)]
        self._served |= {(publisher_key(p), handle_name(config)) for p in served}
        publishers = self._publishers(served, config.where)
        with as_config_error(f"{config.where}: controller '{config.name}'"):
            controller = make()
            controller.init(self._interfaces, config.parameters, publishers)
            self._controllers.append(GuardedController(config.name, controller, controller.handle, next(self._numbers)))
            self._idle.append(self._controllers[-1])

    def _publishers(self, configs: Iterable[PublisherConfig], where: str) -> list[Publisher]:
        """The publishers, durable ones first. A replay leaves out those that are `live_only`."""
        wanted = [p for p in configs if not (self._context.patient and is_live_only(p, where))]
        wanted.sort(key=lambda p: not is_durable(p, where))
        return [self._publisher(p, where) for p in wanted]

    def _publisher(self, config: PublisherConfig, where: str) -> Publisher:
        """The existing publisher, or a new one."""
        key = publisher_key(config)
        if key not in self.publishers:
            make: Callable[[PublisherContext], Publisher] = plugins.load(plugins.PUBLISHERS, config.type, where)
            with as_config_error(f"{where}: publisher '{config.type}'"):
                made = make(self._context._replace(options=config.options))
            trusted = plugins.is_part_of_this_package(made)
            self.publishers[key] = made if trusted else GuardedPublisher(made, config.type)
        return self.publishers[key]


def _keep(handle: str) -> None:
    """A publisher that keeps nothing for a handle has nothing to forget."""
