"""The filter in the kernel: datagrams without a message that a status needs do not wake the gateway.

It is for links whose frames nobody else needs, see `why_not`. The ids that it passes are those of the parsers. So a
vehicle is judged by the same frames with it and without it: a parser returns no others.

Some things need the other datagrams too, for a while. Then the filter is lifted:

- No heartbeat arrives: the log counts everything that does.
- Frames begin in one datagram and end in another: a part of a frame may look like a whole one.
- A second sender speaks on a link with one peer: only all datagrams of that peer show whether it is silent.
"""

from __future__ import annotations

import logging
import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from ..links.base import FilteredLink
from ..links.url import parse
from ..mavlink.bpf import packed, program
from .controller_config import DEFAULT_CONTROLLER, publishers_of
from .plugins import OURS, PUBLISHERS

if TYPE_CHECKING:
    from ..config import Config
    from ..links.base import Link

log = logging.getLogger(__name__)

LIFTED: Final = 60.0
"""Seconds for which it stays lifted after a cut frame or a second sender."""
DRAINED: Final = 1.0
"""Seconds after the filter ends. By then all that it let pass has been read, and sequence numbers are whole again."""
SHOWS_COUNTERS: Final = "http"
"""Our publisher that shows the counters of a connection."""


@lru_cache(maxsize=4)
def _code(wanted: frozenset[int]) -> bytes:
    return packed(program(wanted))


def why_not(config: Config, *, observed: bool = False) -> str | None:
    """Why there is no filter with this configuration; None: there is one on its UDP links."""
    if config.kernel_filter is False:
        return "kernel_filter is false"
    needs_all = (
        ("forward", config.forward),
        ("record", config.record is not None),
        ("signing", config.signing is not None),
        ("an observer", observed),
    )
    who = next((name for name, needs in needs_all if needs), None)
    if who is not None:
        return f"{who} needs every frame"
    if config.kernel_filter is None and (shows := _shows_counters(config)) is not None:
        return f"the publisher {shows} can show how many frames were lost"
    return None


def _shows_counters(config: Config) -> str | None:
    """The first publisher that can show the counters of connections: ours, or any of another package."""
    controllers = config.controllers or (DEFAULT_CONTROLLER,)
    types = (publisher.type for controller in controllers for publisher in publishers_of(controller))
    return next((kind for kind in types if kind == SHOWS_COUNTERS or kind not in OURS[PUBLISHERS]), None)


def words(config: Config) -> list[str]:
    """What `check-config` says about it; nothing for a configuration that has links, but none on UDP."""
    links = [*config.links, *config.outs]
    if not config.hears_mavlink or (links and all(parse(link.url).kind.transport != "udp" for link in links)):
        return []
    reason = why_not(config)
    if reason is not None:
        return [f"kernel_filter: off, {reason}"]
    return ["kernel_filter: on UDP, messages that no status needs are dropped in the kernel; lost ones are not counted"]


class KernelFilter:
    """The filter of one link. `review` is called once a second, with the time in monotonic seconds."""

    __slots__ = ("_allowed", "_lifted_until", "_link", "_passes", "_told", "_whole_since", "counts")

    def __init__(self, link: Link) -> None:
        self._link = link if isinstance(link, FilteredLink) else None
        self._allowed = self._told = False
        self._passes: frozenset[int] | None = None
        """The ids that the kernel passes. None: there is no filter."""
        self._whole_since = -math.inf
        """Since when every datagram arrives. Infinity: not noted yet."""
        self._lifted_until = -math.inf
        self.counts = True
        """Whether gaps in the sequence numbers, and the count of the kernel, mean losses."""

    @property
    def is_on(self) -> bool:
        """Whether the kernel filters now."""
        return self._passes is not None

    def allow(self, on: bool) -> None:
        """Say whether there may be a filter. It ends at once, and begins with a `review`."""
        self._allowed = on
        if not on and self._passes is not None:
            self._end(math.inf)
        if not on and self._told and self._link is not None:
            self._told = False
            log.info("%s: no longer filters in the kernel", getattr(self._link, "text", ""))

    def widen(self, wanted: frozenset[int]) -> None:
        """Pass these ids at once, too."""
        if self._passes is not None and not wanted <= self._passes:
            self._begin(self._passes | wanted)

    def silence(self, since: float, now: float) -> float:
        """The seconds for which a peer, last heard at `since`, has certainly been silent. Lifts the filter."""
        if self._allowed:
            self._lifted_until = now + LIFTED
            if self._passes is not None:
                self._end(now)
        return now - max(since, self._whole_since)

    def review(self, now: float, wanted: frozenset[int], *, heard: bool, cut: bool) -> bool:
        """Begin or end it. `heard`: heartbeats arrive on the link; `cut`: a datagram ended within a frame.

        True: from now on sequence numbers are whole again, so the owner begins to count from here.
        """
        self._whole_since = min(self._whole_since, now)
        if cut:
            self._lifted_until = now + LIFTED
        if self._allowed and heard and now >= self._lifted_until:
            if self._passes != wanted:
                self._begin(wanted)
        elif self._passes is not None:
            self._end(now)
        if self.counts or self._allowed or now - self._whole_since < DRAINED:
            return False
        self.counts = True
        return True

    def _begin(self, wanted: frozenset[int]) -> None:
        if self._link is None or not self._link.filter(_code(wanted)):
            return
        self._passes, self.counts = wanted, False
        if not self._told:
            self._told = True
            text = getattr(self._link, "text", "")
            log.info("%s: filters in the kernel what no status needs; lost frames are not counted", text)

    def _end(self, now: float) -> None:
        if self._link is not None:
            self._link.filter(None)
        self._passes, self._whole_since = None, now
