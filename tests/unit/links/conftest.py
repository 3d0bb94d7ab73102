"""Host names that become known during a test."""

import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.links import kinds, tcp, udp
from mav_robot_status.links.base import Link
from mav_robot_status.testing.conformance.links import PATIENCE

from .custom_link import NAME, install


class Names:
    """A name server for hosts in `.test`. Links look up an unknown name again without a wait."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.known: dict[str, str] = {}
        self.lookups = 0
        self._really: Any = socket.getaddrinfo
        monkeypatch.setattr(socket, "getaddrinfo", self._getaddrinfo)
        for module in (udp, tcp):
            monkeypatch.setattr(module, "CHECK_AGAIN", 0.0)

    def _getaddrinfo(self, name: bytes, *args: Any, flags: int = 0, **options: Any) -> Any:
        host = name.decode()
        if not host.endswith(".test") or flags & socket.AI_NUMERICHOST:
            return self._really(host, *args, flags=flags, **options)
        self.lookups += 1
        return [
            found
            for address in self.known.get(host, "no such host").split()
            for found in self._really(address, *args, flags=socket.AI_NUMERICHOST, **options)
        ]

    def resolve(self, link: Link, now: float) -> None:
        """Service the link until its lookup has a result."""
        link.service(now)
        while link.due() <= now:
            for thread in threading.enumerate():
                if thread.name.startswith("resolve "):
                    thread.join(PATIENCE)
            link.service(now)


@pytest.fixture
def names(monkeypatch: pytest.MonkeyPatch) -> Names:
    return Names(monkeypatch)


@pytest.fixture
def unix_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a package that adds `unixgram:`, installed for this test."""
    folder = tmp_path / "site"
    folder.mkdir()
    install(folder)
    monkeypatch.syspath_prepend(folder)
    kinds._entry_points.cache_clear()
    yield folder
    kinds._entry_points.cache_clear()
    sys.modules.pop(NAME, None)
