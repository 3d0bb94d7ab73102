"""Several hardware interfaces as one: ros_control's `CombinedRobotHW`."""

from __future__ import annotations

import logging
import math
from contextlib import ExitStack
from typing import TYPE_CHECKING

from ..interface import RobotHW

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..clock import Instant
    from ..interface import HardwareInterface, IoSource

log = logging.getLogger(__name__)


class CombinedRobotHW(RobotHW):
    """Offers the handles of all its parts. If two parts use the same name, the handle of the first is used."""

    def __init__(self, parts: Sequence[HardwareInterface]) -> None:
        super().__init__()
        self._parts = parts
        self._collected: list[int] = [0] * len(parts)
        """The version of the handles of each part that were collected."""
        self._collect()

    def read(self, now: Instant) -> None:
        """Read each part."""
        for part in self._parts:
            part.read(now)
            if part.changed:
                part.changed, self.changed = False, True
        self._collect()

    def write(self, now: Instant) -> None:
        """Let each part send its due messages."""
        for part in self._parts:
            part.write(now)

    def next_due(self, until: float = -math.inf) -> float:
        """The earliest time of all parts."""
        return min((part.next_due(until) for part in self._parts), default=math.inf)

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in this handle to `now`."""
        for part in self._parts:
            if handle in part.handles.get_names():
                part.explain(handle, now)
                return

    def forget(self) -> None:
        """Reset each part."""
        for part in self._parts:
            part.forget()

    def sources(self) -> Sequence[IoSource]:
        """The sources of all parts."""
        return [source for part in self._parts for source in part.sources()]

    def close(self) -> None:
        """Close each part, even if another one raises."""
        with ExitStack() as steps:
            for part in self._parts:
                steps.callback(part.close)

    def _collect(self) -> None:
        """Collect the handles that were registered or removed since the last call."""
        versions = [part.handles.version for part in self._parts]
        if versions == self._collected:
            return
        self._collected = versions
        offered = {id(handle) for part in self._parts for handle in part.handles}
        for handle in list(self.handles):
            if id(handle) not in offered:
                self.handles.remove_handle(handle.name)
        for part in self._parts:
            self._offer(part)

    def _offer(self, part: HardwareInterface) -> None:
        known = {handle.name: handle for handle in self.handles}
        for handle in part.handles:
            if known.get(handle.name, handle) is not handle:
                log.warning("two hardware interfaces have a handle '%s': the second is ignored", handle.name)
            elif handle.name not in known:
                self.handles.register_handle(handle)
