"""Binding to a local port: exclusively, or with an error that names the process that uses it."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable

from mav_robot_status.errors import LinkError
from mav_robot_status.links.owner import port_owner
from mav_robot_status.links.resolve import addresses
from mav_robot_status.links.retry import StateLog
from mav_robot_status.links.url import Url

_PROTOCOLS = {socket.SOCK_DGRAM: "udp", socket.SOCK_STREAM: "tcp"}


class LocalPort:
    """A local port to listen on. Its address may not exist yet: the interface may come up later."""

    def __init__(
        self, url: Url, make: Callable[[int], socket.socket], kind: socket.SocketKind, state_log: StateLog
    ) -> None:
        """`make` returns a new socket of this kind for an address family.

        Raises LinkError for an unknown host.
        """
        self.text = url.words()
        """What the link does, for the log; with the port that the system has picked if port 0 was requested."""
        self._url = url
        self._make = make
        self._state_log = state_log
        try:
            self._family, self._address = addresses(url.host, url.port, kind, socket.AI_PASSIVE)[0]
        except (OSError, ValueError):
            problem = f"{url.host!r} is not a known host; to listen write an address of this machine"
            raise LinkError(problem) from None

    def bind(self) -> socket.socket | None:
        """A bound, listening socket; None while this machine does not have the address.

        Raises LinkError for every other failure. The error names the port and the process that has it.
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
            self._state_log.down(f"{self.text} waits for a network interface with this address")
            return None
        self.text = self._url._replace(port=new.getsockname()[1]).words()
        self._state_log.recovered(f"{self.text}: the address is available now")
        return new

    def try_bind(self) -> socket.socket | None:
        """The same after the start: a failure is logged, not raised."""
        try:
            return self.bind()
        except LinkError as problem:
            self._state_log.down(str(problem))
            return None


def _why_not(error: OSError, url: Url, protocol: str) -> str:
    """One line that says why the port cannot be used, and what to do."""
    where = f"{protocol} port {url.port} on {url.host}"
    if error.errno == errno.EADDRINUSE:
        owner = port_owner(url.port, protocol) or "another program"
        return f"{where} is taken by {owner}; stop it or listen on another port"
    if error.errno == errno.EACCES:
        return f"{where}: no permission; ports below 1024 are the system's, listen on another one"
    return f"{where}: {error.strerror}"
