"""The MAVLink hardware interface on live links: connects `MavlinkRobotHW` to a `LinkHub`.

It sends our heartbeat and the requests for missing messages, and logs while no autopilot is heard.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from ..config import Config
from ..hardware.mavlink.interface import MavlinkRobotHW
from ..hardware.mavlink.px4_events.parsing import parse
from ..hardware.mavlink.vehicle import ExpectedVehicle
from ..mavlink.commands import ROBOT_STATUS
from .controller_config import publishes
from .events.cache import EventTableCache, default_folder
from .events.file import event_table
from .events.tables import EventTables
from .links.link_hub import LinkHub
from .pace import MOST_AT_ONCE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..clock import Instant
    from ..hardware.mavlink.belief import Belief
    from ..hardware.mavlink.px4_events import EventTable
    from ..interface import IndustrialRobotStatusInterface, IoSource
    from ..mavlink.framing import Frame
    from .links.channel import Channel
    from .links.endpoint import Endpoint
    from .observer import Observer

log = logging.getLogger(__name__)

AT_ONCE: Final = -math.inf
HEARTBEAT_PERIOD: Final = 1.0  # s
FIRST_SILENCE, LATER_SILENCE = 3.5, 30.0  # s without an autopilot until the first log line, and between later ones


def robot_hw(
    config: Config,
    beliefs: dict[tuple[int, int], Belief] | None = None,
    table: EventTable | None = None,
) -> MavlinkRobotHW:
    """The vehicles of a configuration, in the state before the first heartbeat.

    `table` is that of the configuration, if it was read already. Raises UsageError if it cannot be read.
    """
    slots = [ExpectedVehicle(v.system, v.component, v.handle, v.name) for v in config.vehicles]
    vehicles = MavlinkRobotHW(config.hardware, slots, config.identity.component, beliefs, config.names)
    vehicles.speak_as(config.identity.system, config.identity.component)
    vehicles.use_event_table(None, table or event_table(config))
    return vehicles


def wants_tables(config: Config) -> bool:
    """Whether a PX4 is asked for the table of its events: not if a file has it."""
    return config.requests == "missing" and config.hardware.px4_events is None


class MavlinkHardware:
    """A `HardwareInterface`: the vehicles on the links of a configuration. Each link is a source."""

    def __init__(
        self, config: Config, clock: Callable[[], Instant], observers: Sequence[Observer] = (), *, opens: bool = True
    ) -> None:
        """Open the links; with `opens` False only `open` does it. Raises LinkError, UsageError."""
        self._event_table = event_table(config)
        self.hub = LinkHub(config if opens else Config(), clock, observers)
        self.vehicles = robot_hw(config, self.hub.members.beliefs, self._event_table)
        self.handles: IndustrialRobotStatusInterface = self.vehicles.handles
        self.tables = EventTables(
            self.hub,
            lambda ids, table: self.vehicles.use_event_table(ids, table),  # `renew` makes other vehicles
            parse,
            cache=EventTableCache(default_folder()),
        )
        self.changed = False
        self.observers = observers
        self._waiting: list[tuple[Instant, Frame, Channel]] = []
        """Frames that arrived before they were read, with their times. The next `read` takes them in order."""
        self._read_at = -math.inf
        self._heartbeat_due = AT_ONCE
        self._silent_at = clock().mono + FIRST_SILENCE
        self._configure(config)

    def open(self) -> None:
        """Open the links, once. Raises LinkError, UsageError."""
        self.hub.open(self._config)
        self._configure(self._config)

    def _configure(self, config: Config) -> None:
        self._config = config
        self.vehicles.asks = config.requests == "missing" and not all(link.passive for link in config.links)
        why = "(requests: none)" if config.requests == "none" else "(passive)"
        self.vehicles.never_asked = f"mav-robot-status does not ask for it {why}."
        self._want_tables(config)
        if publishes(config, "mavlink"):
            self.hub.receiver.commands.offered |= {ROBOT_STATUS}
        self._sources = tuple(LinkSource(endpoint, self) for endpoint in self.hub.endpoints)

    def _want_tables(self, config: Config) -> None:
        """Whether the tables of PX4's events are looked for, in the cache and on the vehicles."""
        self.tables.wanted = wants_tables(config)
        self.vehicles.ask_for_tables(self.tables.wanted)
        self.vehicles.on_file = self.tables.on_message

    # reload

    def change(self, config: Config) -> None:
        """Open and close links for this configuration, and forget the vehicles heard only on closed links.

        Afterwards call `read`, publish the last statuses, and call `renew`. Raises LinkError, UsageError. After an
        error some links are closed: change back.
        """
        table = event_table(config)
        self.hub.change(config)
        # a waiting frame of a closed link would bring its vehicle back
        self._waiting = [one for one in self._waiting if one[2].endpoint in self.hub.endpoints]
        self._event_table = table
        self.vehicles.forget(self.hub.members.vehicles())
        self.vehicles.changed = True
        self._configure(config)

    def renew(self) -> None:
        """Use the vehicles and options of the new configuration. Vehicles in both configurations keep their state."""
        before, self.vehicles = self.vehicles, robot_hw(self._config, self.hub.members.beliefs, self._event_table)
        self.vehicles.adopt(before)
        self.vehicles.asks = before.asks
        self._want_tables(self._config)
        self.handles = self.vehicles.handles

    # receiving

    def sources(self) -> Sequence[IoSource]:
        """The links."""
        return self._sources

    def receive_late(self, endpoint: Endpoint, now: Instant, limit: int) -> None:
        """Receive on a link whose input may be old."""
        for at, received in self.hub.receiver.receive_late(endpoint, now, limit):
            self._waiting += [(at, frame, channel) for frame, channel in received]

    def _process_waiting(self) -> None:
        """Process the frames of all links in the order of their arrival, as if they had been read at once.

        Time does not go back: a frame older than the last `read` is left out.
        """
        waiting, self._waiting = sorted(self._waiting, key=lambda frame: frame[0].mono), []
        vehicles = self.vehicles
        for at, frame, channel in waiting:
            if at.mono < self._read_at:
                continue
            if vehicles.deadline < at.mono:
                vehicles.read(at)
            self.process([(frame, channel)], at)

    def process(self, received: Sequence[tuple[Frame, Channel]], now: Instant) -> None:
        """Process frames that arrived at `now`. The observers get those of vehicles."""
        hub, on_frame = self.hub, self.vehicles.on_frame
        for frame, channel in received:
            vehicle = on_frame(frame, now, channel, hub.receiver.lag(frame))
            if vehicle is not None and vehicle.ids is not None:
                hub.members.heard_vehicle(vehicle.ids, channel, now.mono)
        for observer in self.observers:
            for frame, channel in received:
                vehicle = self.vehicles.find(*frame.ids)
                if vehicle is not None and vehicle.belief.channel is channel:
                    observer.on_frame(frame, now)

    # a turn

    def read(self, now: Instant) -> None:
        """Update the handles to `now`."""
        hub, vehicles = self.hub, self.vehicles
        hub.receiver.needs_turn = False
        if self._waiting:
            self._process_waiting()
        self._read_at = now.mono
        vehicles.read(now)
        if vehicles.changed:
            vehicles.changed, self.changed = False, True

    def write(self, now: Instant) -> None:
        """Send the due requests and heartbeats."""
        if self.vehicles.asks and (self.hub.members.has_passive or now.mono >= self.vehicles.requests_due):
            for ask in self.vehicles.due_requests(now, self.hub.members.passive_vehicles(), self.hub.may_ask):
                # the autopilot acknowledges to these ids
                self.vehicles.speak_as(self._config.identity.system, self.hub.sender.component.id)
                self.hub.ask(ask)
        if now.mono >= self.tables.next_due:
            for ask in self.tables.due(now.mono, self.vehicles.find):
                self.hub.ask(ask)
        if self.hub.sender.signing_policy is not None:
            self.hub.sender.signing_policy.keep(now.mono)
        if now.mono >= self._heartbeat_due:
            late = now.mono - self._heartbeat_due > HEARTBEAT_PERIOD
            self._heartbeat_due = (now.mono if late else self._heartbeat_due) + HEARTBEAT_PERIOD
            self.hub.speak(self.vehicles.vehicles, now.mono)
        if now.mono >= self._silent_at:
            self._log_silence(now.mono)

    def _log_silence(self, now: float) -> None:
        if any(self.vehicles.vehicles):
            self._silent_at = math.inf
            return
        self._silent_at = now + LATER_SILENCE
        self.hub.log_silence()

    def next_due(self, until: float = -math.inf) -> float:
        """When there is something to do. At once (-inf) after a frame that may change a status."""
        if self.hub.receiver.needs_turn:
            return AT_ONCE
        timer = min(self._heartbeat_due, self._silent_at, self.tables.next_due)
        return min(self.vehicles.next_due(min(until, timer)), timer)

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in this handle to `now`."""
        self.vehicles.explain(handle, now)

    def waits_for(self) -> list[str]:
        """What the vehicles were asked for and may still answer, one line for each vehicle."""
        return [*self.vehicles.waits_for(), *self.tables.waits_for()] if self.vehicles.asks else []

    def forget(self) -> None:
        """Forget all vehicles."""
        self.vehicles.forget()

    def close(self) -> None:
        """Close the links, and log the counters."""
        for vehicle in self.vehicles.vehicles:
            if vehicle.losses and vehicle.ids is not None:
                times = "once" if vehicle.losses == 1 else f"{vehicle.losses} times"
                log.info("vehicle %d.%d was lost %s", *vehicle.ids, times)
        self.tables.close()
        self.hub.close()


class LinkSource:
    """One link of a hub, as a source."""

    __slots__ = ("_connections", "_endpoint", "_hardware", "_hub", "close", "fileno", "next_due")

    def __init__(self, endpoint: Endpoint, hardware: MavlinkHardware) -> None:
        self._endpoint = endpoint
        self._connections = endpoint.connections
        self._hardware = hardware
        self._hub = hardware.hub
        self.fileno, self.next_due, self.close = endpoint.link.fileno, endpoint.link.due, endpoint.link.close

    def receive(self, now: Instant, limit: int) -> int:
        """Read the pending input, and process its frames. Returns the number of datagrams."""
        receiver = self._hub.receiver
        if receiver.late:
            self._hardware.receive_late(self._endpoint, now, limit)
            return MOST_AT_ONCE
        received, number = receiver.receive(self._endpoint, now, limit)
        if received:
            if self._endpoint.connections != self._connections:
                self._connections = self._endpoint.connections
                self._hardware.vehicles.reconnected(self._hub.members.vehicles_on(self._endpoint), now.mono)
                self._hub.members.reconnected(self._endpoint)
            self._hardware.process(received, now)
        return number

    def service(self, now: Instant) -> None:
        """Connect or reconnect."""
        self._endpoint.link.service(now.mono)
