"""Who we are on MAVLink: a companion's component beside each vehicle's autopilot.

What we say about a vehicle carries that vehicle's system id and our component: MAV_COMP_ID_ONBOARD_COMPUTER2 (192),
since 191 is MAVROS's. Never a ground station, which would mask a lost one. If another program speaks as our component,
the next free one is taken.
"""

from __future__ import annotations

import logging
from collections import deque
from typing import TYPE_CHECKING, Any, Final

from .definitions import Heartbeat
from .encode import Encoder

if TYPE_CHECKING:
    from .framing import Frame

log = logging.getLogger(__name__)

COMPONENTS: Final = (192, 193, 194, 191)
LONELY_SYSTEM: Final = 245
"""The system id before any vehicle is heard, on links where we must speak first."""
ONBOARD_CONTROLLER, INVALID = 18, 8  # MAV_TYPE, MAV_AUTOPILOT
ACTIVE, CRITICAL = 4, 5  # MAV_STATE
MAVLINK_VERSION: Final = 3
REMEMBERED: Final = 64
"""Heartbeats of ours, for each system, that are known again if a router sends them back: of several channels."""


class Component:
    """Encodes what we send, about one or several vehicles, under one component id."""

    def __init__(self, component: int = COMPONENTS[0], system: int | None = None) -> None:
        self.id = component
        self._system = system
        self._ids = (component, *(c for c in COMPONENTS if c != component))
        self._others: set[tuple[int, int]] = set()
        """Systems and components of `_ids` that other programs speak as: at most 255 times 5."""
        self._encoders: dict[int, Encoder] = {}
        self._systems: set[int] = set()
        """Systems that we speak for."""
        self._sent: dict[int, deque[tuple[int, int, Heartbeat]]] = {}

    def system_for(self, vehicle: int) -> int:
        """Our system id when we speak about this vehicle."""
        return vehicle if self._system is None else self._system

    def speaks_as(self, system: int, component: int) -> bool:
        """Whether these are ids that we have spoken under."""
        return component == self.id and system in self._systems

    def frame(self, message: Any, vehicle: int, encoders: dict[int, Encoder] | None = None) -> bytes:
        """The next frame with `message` about the vehicle with this system id.

        `encoders` are those of the channel that it goes to, each channel counting for itself; None: there is just one.
        """
        system = self.system_for(vehicle)
        if system not in self._systems:
            self._systems.add(system)
            self._step_aside(system)
        encoders = self._encoders if encoders is None else encoders
        encoder = encoders.get(system)
        if encoder is None or encoder.component != self.id:
            encoder = encoders[system] = Encoder(system, self.id)
        sequence = encoder.sequence
        frame = encoder.frame(message)
        if type(message) is Heartbeat:
            sent = self._sent.setdefault(system, deque(maxlen=REMEMBERED))
            sent.append((self.id, sequence, message))
        return frame

    def heartbeat(self, vehicle: int, in_error: bool = False, encoders: dict[int, Encoder] | None = None) -> bytes:
        """Our HEARTBEAT; its state mirrors the vehicle's in_error."""
        state = CRITICAL if in_error else ACTIVE
        return self.frame(Heartbeat(0, ONBOARD_CONTROLLER, INVALID, 0, state, MAVLINK_VERSION), vehicle, encoders)

    def heard(self, frame: Frame) -> None:
        """Look at a HEARTBEAT: if another program speaks as we do, or as we could, keep out of its way."""
        system, component = frame.ids
        if component not in self._ids:
            return
        if (component, frame.sequence, frame.message) in self._sent.get(system, ()):
            return  # our own, come back through a router
        if frame.ids not in self._others:
            self._others.add(frame.ids)
            self._step_aside(system)

    def _step_aside(self, system: int) -> None:
        """Take another component if ours is taken in a system that we speak for. Each is left only once."""
        if system not in self._systems or (system, self.id) not in self._others:
            return
        taken = {component for s, component in self._others if s in self._systems}
        free = next((c for c in self._ids if c not in taken), None)
        if free is None:
            log.warning("other programs speak as %s in system %d: staying %d", self._ids, system, self.id)
            return
        log.warning("another program speaks as %d/%d: taking component %d", system, self.id, free)
        self.id = free
