"""Finds a port or a serial device that is given twice. Pure: opens nothing."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Final, NamedTuple

from ..errors import UsageError
from ..links.url import parse

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ..config import Config

EVERY: Final = ("0.0.0.0", "::")
"""The hosts that mean every address of this computer, of IPv4 and of IPv6."""


class Taken(NamedTuple):
    """What a part of the configuration takes for itself: a local port, or a serial device."""

    transport: str
    """`udp`, `tcp` or `serial`."""
    host: str
    port: int
    """0 for a serial device."""
    device: str
    """Empty for a port."""
    text: str
    """The part, as the user wrote it."""


def of_links(config: Config) -> Iterator[Taken]:
    """What the links and the outs take. For port 0 the system chooses a free port, so it is left out."""
    for link in (*config.links, *config.outs):
        url = parse(link.url)
        if url.kind.is_serial:
            yield Taken("serial", "", 0, url.device, link.url)
        elif url.kind.listens and url.port:
            yield Taken(url.kind.transport, url.host, url.port, "", link.url)


def check_taken(taken: Iterable[Taken]) -> None:
    """Raise UsageError for the first port or device that two parts take."""
    for one, other in combinations(taken, 2):
        if one[0] == other[0] and one[2:4] == other[2:4] and _overlap(one.host, other.host):
            what = one.device or f"{one.transport} port {one.port}"
            where = f"as {one.text}" if one.text == other.text else f"as {one.text} and as {other.text}"
            raise UsageError(f"{what} is given twice, {where}; leave one out, or write another")


def _overlap(one: str, other: str) -> bool:
    """Whether two hosts can be one address of this computer. An IPv4 address is never an IPv6 address."""
    return one == other or ((":" in one) is (":" in other) and (one in EVERY or other in EVERY))
