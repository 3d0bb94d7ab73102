"""Which addresses a link that listens hears: `from=10.0.0.5,10.0.0.0/24`. All others are dropped and counted."""

from __future__ import annotations

import logging
import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from mav_robot_status.errors import UsageError
from mav_robot_status.paced_log import PacedLog

if TYPE_CHECKING:
    from ipaddress import IPv4Address, IPv6Address

    from mav_robot_status.links.kind import Url

log = logging.getLogger(__name__)

KNOWN: Final = 1024
"""Addresses of which the answer is kept."""
FORM: Final = "an address or a network, such as 10.0.0.5 or 10.0.0.0/24"


class Senders:
    """The addresses that one link hears, and the log line for those that it refuses."""

    def __init__(self, url: Url, what: str) -> None:
        """`what` is refused, one of them in words: `datagram`."""
        self._what = what
        self._said = ",".join(url.senders)
        self.everybody = not url.senders
        """Whether every address is heard."""
        if not self.everybody:
            import ipaddress  # only a link with from= needs it

            networks = [ipaddress.ip_network(sender) for sender in url.senders]
            self._is_one = lru_cache(KNOWN)(lambda host: any(_address(host) in network for network in networks))
        self._refused = 0
        self._last = ""
        self._tell = PacedLog(log)

    def admits(self, host: str) -> bool:
        """Whether this address is heard. Counts it if not."""
        if self.everybody or self._is_one(host):
            return True
        self._refused += 1
        self._last = host
        return False

    def due(self) -> float:
        """When `service` has a line to log, in monotonic seconds."""
        return self._tell.due if self._refused else math.inf

    def service(self, now: float, text: str) -> None:
        """Log what was refused, if that is due. `text` says what the link does."""
        if now < self.due():
            return
        what = f"{self._refused} {self._what}{'' if self._refused == 1 else 's'}"
        line = f"{text}: refused {what} from {self._last}, which is not in from={self._said}"
        self._tell(logging.WARNING, now, line)
        self._refused = 0


def sender(text: str) -> str:
    """An entry of `from`, as it is written back. Raises UsageError, one line that says what would be right."""
    import ipaddress

    try:
        network = ipaddress.ip_network(text)
    except ValueError:
        raise UsageError(f"{text!r} is not {FORM}{_nearest(text)}") from None
    address = getattr(network.network_address, "ipv4_mapped", None)
    if address is not None and network.prefixlen == network.max_prefixlen:
        return str(address)
    return str(network.network_address) if network.prefixlen == network.max_prefixlen else str(network)


def family(text: str) -> int:
    """4 or 6 for a numeric host or a checked entry; 0 for a name."""
    import ipaddress

    try:
        return ipaddress.ip_network(text.partition("%")[0]).version
    except ValueError:
        return 0


def _nearest(text: str) -> str:
    """What the user has probably meant."""
    import ipaddress

    host, _, port = text.rpartition(":")
    for near in (text.strip("[] "), host.strip("[] ") if port.isdigit() else ""):
        try:
            network = ipaddress.ip_network(near, strict=False)
        except ValueError:
            continue
        exact = near.partition("/")[0]
        return f"; write {exact}" + (f" or {network}" if "/" in near else "")
    return " (no host name: names can be forged)" if text[:1].isalpha() and ":" not in text else ""


def _address(host: str) -> IPv4Address | IPv6Address:
    """The address of a sender. A socket for both families shows an IPv4 address as `::ffff:10.0.0.5`."""
    import ipaddress

    address = ipaddress.ip_address(host)
    return getattr(address, "ipv4_mapped", None) or address
