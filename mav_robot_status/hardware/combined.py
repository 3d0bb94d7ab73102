"""Several hardware interfaces as one, and groups of their handles: ros_control's `CombinedRobotHW`."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from contextlib import ExitStack

from ..clock import Instant
from ..interface import (
    GROUP,
    Detail,
    HardwareInterface,
    IndustrialRobotStatusHandle,
    IoSource,
    LinkState,
    RobotHW,
    Vehicle,
)
from .group import Group, combine, last_heard, member_of

log = logging.getLogger(__name__)


class CombinedRobotHW(RobotHW):
    """Offers the handles of all its parts, and one for each group.

    If two parts use the same name, the handle of the first is used. Groups come before parts.
    """

    def __init__(self, parts: Sequence[HardwareInterface], groups: Sequence[Group] = ()) -> None:
        super().__init__()
        self._parts = parts
        self._collected: list[int] = [0] * len(parts)
        """The version of the handles of each part that were collected."""
        self._groups = [(group, IndustrialRobotStatusHandle(group.name)) for group in groups]
        self._outdated = True
        """Whether the groups have to be combined again."""
        for _, handle in self._groups:
            handle.detail = Detail(vehicle=Vehicle(type=GROUP), link=LinkState.NEVER_SEEN)
            self.handles.register_handle(handle)
        self._collect()

    def read(self, now: Instant) -> None:
        """Read each part, and combine the groups."""
        for part in self._parts:
            part.read(now)
            if part.changed:
                part.changed, self.changed, self._outdated = False, True, True
        self._collect()
        for group, handle in self._groups:
            if self._outdated:
                self._combine(group, handle, now)
            handle.heard_at = last_heard([member.heard_at for member in self._members(group)])
        self._outdated = False

    def write(self, now: Instant) -> None:
        """Let each part send its due messages."""
        for part in self._parts:
            part.write(now)

    def next_due(self, until: float = -math.inf) -> float:
        """The earliest time of all parts."""
        return min((part.next_due(until) for part in self._parts), default=math.inf)

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in this handle to `now`."""
        for group, combined in self._groups:
            if group.name == handle:
                for member in self._members(group):
                    self._explain_part(member.name, now)
                self._combine(group, combined, now)
                return
        self._explain_part(handle, now)

    def forget(self) -> None:
        """Reset each part."""
        for part in self._parts:
            part.forget()
        self._outdated = True

    def sources(self) -> Sequence[IoSource]:
        """The sources of all parts."""
        return [source for part in self._parts for source in part.sources()]

    def close(self) -> None:
        """Close each part, even if another one raises."""
        with ExitStack() as steps:
            for part in self._parts:
                steps.callback(part.close)

    def _explain_part(self, handle: str, now: Instant) -> None:
        for part in self._parts:
            if handle in part.handles.get_names():
                part.explain(handle, now)
                return

    def _members(self, group: Group) -> list[IndustrialRobotStatusHandle]:
        """The handles of a group. A member that is not registered yet, because it was not heard, was never seen."""
        known = {handle.name: handle for handle in self.handles}
        groups = {other.name for other, _ in self._groups}
        names = group.handles or [name for name in known if name not in groups]
        return [known.get(name) or _unheard(name) for name in names]

    def _combine(self, group: Group, handle: IndustrialRobotStatusHandle, now: Instant) -> None:
        members = [member_of(member) for member in self._members(group)]
        status, detail, evidence = combine(group, members, handle.detail, now.unix_us)
        self.set_status(handle, status, detail, evidence)

    def _collect(self) -> None:
        """Collect the handles that were registered or removed since the last call."""
        versions = [part.handles.version for part in self._parts]
        if versions == self._collected:
            return
        self._collected, self._outdated = versions, True
        offered = {id(handle) for part in self._parts for handle in part.handles}
        offered |= {id(handle) for _, handle in self._groups}
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


def _unheard(name: str) -> IndustrialRobotStatusHandle:
    handle = IndustrialRobotStatusHandle(name)
    handle.detail = Detail(link=LinkState.NEVER_SEEN)
    return handle
