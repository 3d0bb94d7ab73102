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
REMEMBERED: Final = 16
"""Frames of ours that are known again if a router sends them back."""


class Component:
    """Encodes what we send, about one or several vehicles, under one component id."""

    def __init__(self, component: int = COMPONENTS[0], system: int | None = None) -> None:
        self.id = component
        self._system = system
        self._encoders: dict[int, Encoder] = {}
        self._sent: deque[tuple[int, int, bytes]] = deque(maxlen=REMEMBERED)

    def system_for(self, vehicle: int) -> int:
        """Our system id when we speak about this vehicle."""
        return vehicle if self._system is None else self._system

    def frame(self, message: Any, vehicle: int) -> bytes:
        """The next frame with `message` about the vehicle with this system id."""
        system = self.system_for(vehicle)
        encoder = self._encoders.get(system)
        if encoder is None or encoder.component != self.id:
            encoder = self._encoders[system] = Encoder(system, self.id)
        sequence = encoder.sequence
        frame = encoder.frame(message)
        if type(message) is Heartbeat:
            self._sent.append((system, sequence, frame[10:-2]))
        return frame

    def heartbeat(self, vehicle: int, in_error: bool = False) -> bytes:
        """Our HEARTBEAT; its state mirrors the vehicle's in_error."""
        state = CRITICAL if in_error else ACTIVE
        return self.frame(Heartbeat(0, ONBOARD_CONTROLLER, INVALID, 0, state, MAVLINK_VERSION), vehicle)

    def heard(self, frame: Frame) -> None:
        """Look at a HEARTBEAT: if another program speaks as we do, step aside to the next component id."""
        if frame.component != self.id or frame.system not in self._encoders:
            return
        if (frame.system, frame.sequence, frame.payload) in self._sent:
            return  # our own, come back through a router
        after = COMPONENTS.index(self.id) + 1 if self.id in COMPONENTS else 0
        taken = self.id
        self.id = COMPONENTS[after % len(COMPONENTS)]
        log.warning("another program speaks as %d/%d: taking component %d", frame.system, taken, self.id)
