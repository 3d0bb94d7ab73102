"""Our identity on MAVLink: a companion computer beside the autopilot of each vehicle.

A message about a vehicle has the system id of that vehicle and our component id, MAV_COMP_ID_ONBOARD_COMPUTER2 (192);
MAVROS uses 191. We never identify as a ground station: that would hide the loss of a real one. If another program uses
our component id, we change to the next free one.
"""

from __future__ import annotations

import logging
from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from .definitions import Heartbeat
from .encode import Encoder
from .enumerations import (
    MAV_AUTOPILOT_INVALID,
    MAV_STATE_ACTIVE,
    MAV_STATE_CRITICAL,
    MAV_TYPE_GCS,
    MAV_TYPE_ONBOARD_CONTROLLER,
)

if TYPE_CHECKING:
    from .framing import Frame

log = logging.getLogger(__name__)

COMPONENTS: Final = (192, 193, 194, 191)
DEFAULT_SYSTEM: Final = 245
"""The system id before the first vehicle is known, on links where we must send first."""
MAVLINK_VERSION: Final = 3
GROUND_STATION: Final = 255
"""The default of ArduPilot's SYSID_MYGCS, and of all ground stations."""
GROUND_STATION_SILENCE: Final = 60
"""Seconds after which a ground station is forgotten."""
SENT_KEPT: Final = 64
"""How many of our heartbeats we remember for each system, over all channels: a router may send them back to us."""


class Component:
    """Encodes our messages about one or several vehicles, with one component id."""

    def __init__(self, component: int = COMPONENTS[0], system: int | None = None) -> None:
        self.id = component
        self._system = system
        self._ids = (component, *(c for c in COMPONENTS if c != component))
        self._others: set[tuple[int, int]] = set()
        """Ids that other programs use, if the component is one of `_ids`: at most 255 times 5."""
        self._encoders: dict[int, Encoder] = {}
        self._systems: set[int] = set()
        """Systems under whose id we have sent."""
        self._ground_stations: dict[int, int] = {}
        """Systems that a ground station uses, with the seconds since its last HEARTBEAT."""
        self._warned: set[int] = set()
        self._sent: dict[int, deque[tuple[int, int, Heartbeat]]] = {}

    def system_for(self, vehicle: int) -> int:
        """Our system id in messages about this vehicle."""
        return vehicle if self._system is None else self._system

    def speaks_as(self, system: int, component: int) -> bool:
        """Whether we have sent with these ids."""
        return component == self.id and system in self._systems

    def frame(self, message: NamedTuple, vehicle: int, encoders: dict[int, Encoder] | None = None) -> bytes:
        """The next frame with `message` about the vehicle with this system id.

        `encoders` belong to the channel of the receiver, because each channel counts its own frames; None: there is
        only one channel.
        """
        system = self.system_for(vehicle)
        if system not in self._systems:
            self._systems.add(system)
            self._change_component(system)
        encoders = self._encoders if encoders is None else encoders
        encoder = encoders.get(system)
        if encoder is None or encoder.component != self.id:
            encoder = encoders[system] = Encoder(system, self.id)
        sequence = encoder.sequence
        frame = encoder.frame(message)
        if type(message) is Heartbeat:
            sent = self._sent.setdefault(system, deque(maxlen=SENT_KEPT))
            sent.append((self.id, sequence, message))
        return frame

    def heartbeat(self, vehicle: int, in_error: bool = False, encoders: dict[int, Encoder] | None = None) -> bytes:
        """Our HEARTBEAT. Its system_status is CRITICAL if the vehicle is in error."""
        state = MAV_STATE_CRITICAL if in_error else MAV_STATE_ACTIVE
        message = Heartbeat(0, MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, 0, state, MAVLINK_VERSION)
        return self.frame(message, vehicle, encoders)

    def may_beat(self, vehicle: int) -> bool:
        """Whether our HEARTBEAT about this vehicle may be sent. It must not pass for that of a ground station.

        ArduPilot takes every HEARTBEAT of the system SYSID_MYGCS, by default 255, as a sign of life of its ground
        station, and does not begin its failsafe while they arrive.
        """
        system = self.system_for(vehicle)
        if system != GROUND_STATION and system not in self._ground_stations:
            return True
        if system not in self._warned:
            self._warned.add(system)
            log.warning(
                "no HEARTBEAT of ours as system %d: a ground station uses this id, and autopilots would not notice its "
                "loss; give it, or us (identity: {system: ...}), another id",
                system,
            )
        return False

    def pass_second(self) -> None:
        """A second has passed: forget the ground stations that are silent."""
        ages = self._ground_stations.items()
        self._ground_stations = {system: age + 1 for system, age in ages if age < GROUND_STATION_SILENCE}

    def observe(self, frame: Frame) -> None:
        """Process a received HEARTBEAT: if another program uses our component id, change ours."""
        system, component = frame.ids
        if frame.message.type == MAV_TYPE_GCS:
            self._ground_stations[system] = 0
        if component not in self._ids:
            return
        if (component, frame.sequence, frame.message) in self._sent.get(system, ()):
            return  # ours: a router has sent it back
        if frame.ids not in self._others:
            self._others.add(frame.ids)
            self._change_component(system)

    def _change_component(self, system: int) -> None:
        """Change to a free component id if ours is in use in one of our systems. Leaves each id only once."""
        if system not in self._systems or (system, self.id) not in self._others:
            return
        used = {component for s, component in self._others if s in self._systems}
        free = next((c for c in self._ids if c not in used), None)
        if free is None:
            log.warning(
                "other programs use all of the components %s in system %d: keeping component %d",
                self._ids,
                system,
                self.id,
            )
            return
        log.warning("another program uses the ids %d/%d: changing to component %d", system, self.id, free)
        self.id = free
