"""Having a port of this machine: for us alone, or a line that says who has it."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable

from mav_robot_status.errors import LinkError
from mav_robot_status.link.owner import port_owner
from mav_robot_status.link.resolve import addresses
from mav_robot_status.link.retry import Changes
from mav_robot_status.link.url import Url

_PROTOCOLS = {socket.SOCK_DGRAM: "udp", socket.SOCK_STREAM: "tcp"}


class Place:
    """A port at an address of this machine, which may not have that address yet: its interface may come up later."""

    def __init__(
        self, url: Url, make: Callable[[int], socket.socket], kind: socket.SocketKind, changes: Changes
    ) -> None:
        """`make` gives a new socket, of this kind, for an address family.

        Raises LinkError for a host that is not known.
        """
        self.text = url.words()
        """What is done, in words; names the port that it became if any free one was asked for."""
        self._url = url
        self._make = make
        self._changes = changes
        try:
            self._family, self._address = addresses(url.host, url.port, kind, socket.AI_PASSIVE)[0]
        except (OSError, ValueError):
            problem = f"{url.host!r} is not a known host; to listen write an address of this machine"
            raise LinkError(problem) from None

    def take(self) -> socket.socket | None:
        """A socket that is bound and listens; None while this machine does not have the address.

        Raises LinkError for every other reason, with the port and who has it.
        """
        try:
            new = self._make(self._family)
        except OSError as error:
            raise LinkError(f"{self.text} is not possible: {error.strerror}") from None
        try:
            new.bind(self._address)
            if new.type == socket.SOCK_STREAM:
                new.listen()
        except OSError as error:
            new.close()
            if error.errno != errno.EADDRNOTAVAIL:
                raise LinkError(_why_not(error, self._url, _PROTOCOLS[new.type])) from None
            self._changes.bad(f"{self.text} waits for an interface with this address")
            return None
        self.text = self._url._replace(port=new.getsockname()[1]).words()
        self._changes.good_again(f"{self.text}: the address is there now")
        return new

    def take_late(self) -> socket.socket | None:
        """The same after the start, when nothing is an error: somebody may have taken the port meanwhile."""
        try:
            return self.take()
        except LinkError as problem:
            self._changes.bad(str(problem))
            return None


def _why_not(error: OSError, url: Url, protocol: str) -> str:
    """One line for a person whose port could not be had."""
    where = f"{protocol} port {url.port} on {url.host}"
    if error.errno == errno.EADDRINUSE:
        owner = port_owner(url.port, protocol) or "another program"
        return f"{where} is taken by {owner}; stop it or listen on another port"
    if error.errno == errno.EACCES:
        return f"{where}: no permission; ports below 1024 are the system's, listen on another one"
    return f"{where}: {error.strerror}"
