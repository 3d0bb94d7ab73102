"""Names of hosts that become known during a test."""

import socket
import threading
from typing import Any

import pytest

from mav_robot_status.link import tcp, udp
from mav_robot_status.link.base import Link

from .ends import PATIENCE


class Names:
    """Answers for the name server, for hosts in `.test`; an unknown one is asked for again."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.known: dict[str, str] = {}
        self.asked = 0
        self._really: Any = socket.getaddrinfo
        monkeypatch.setattr(socket, "getaddrinfo", self._getaddrinfo)
        for module in (udp, tcp):
            monkeypatch.setattr(module, "ASK_AGAIN", 0.0)

    def _getaddrinfo(self, host: str, *args: Any, flags: int = 0, **options: Any) -> Any:
        if not host.endswith(".test") or flags & socket.AI_NUMERICHOST:
            return self._really(host, *args, flags=flags, **options)
        self.asked += 1
        return [
            found
            for address in self.known.get(host, "no such host").split()
            for found in self._really(address, *args, flags=socket.AI_NUMERICHOST, **options)
        ]

    def ask(self, link: Link, now: float) -> None:
        """Serve the link until it has its answer."""
        link.service(now)
        while link.due() <= now:
            for thread in threading.enumerate():
                if thread.name.startswith("resolve "):
                    thread.join(PATIENCE)
            link.service(now)


@pytest.fixture
def names(monkeypatch: pytest.MonkeyPatch) -> Names:
    return Names(monkeypatch)
