import logging
import math
import os
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway.links.link_hub import LinkHub
from mav_robot_status.links import Address, LinkKind, Received, Url, kinds
from mav_robot_status.links.guarded import RETRY, STABLE_AFTER, GuardedLink, open_guarded
from mav_robot_status.links.url import parse

FIRST = RETRY[0]


class Faulty:
    """A link of another package: raises in the method that a test selects."""

    stream = False
    text = "faulty link"
    fails = ""
    opened: list["Faulty"]

    def __init__(self, url: Url) -> None:
        self._check("__init__")
        self.opened.append(self)
        self.closed = 0
        self.pieces: Any = []
        self._read, self._write = os.pipe()

    def _check(self, method: str) -> None:
        if method == Faulty.fails:
            raise ValueError("no such thing")

    @property
    def dropped(self) -> int:
        self._check("dropped")
        return 2

    def fileno(self) -> int:
        self._check("fileno")
        return self._read

    def receive(self, limit: int = 64) -> list[Received]:
        self._check("receive")
        return self.pieces  # type: ignore[no-any-return]

    def send(self, data: bytes, to: Address = None) -> bool:
        self._check("send")
        return True

    def due(self) -> float:
        self._check("due")
        return math.inf if Faulty.fails != "service" else -math.inf

    def service(self, now: float) -> None:
        self._check("service")

    def close(self) -> None:
        self.closed += 1
        if self.closed == 1:
            os.close(self._read)
            os.close(self._write)
        self._check("close")


FAULTY = LinkKind("faulty", ("faulty",), "faulty:X", "faulty {device}", "faulty:x", "raises", Faulty)
URL = Url(FAULTY, "", 0, "x", 0, "faulty:x")


@pytest.fixture(autouse=True)
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Faulty]]:
    made: list[Faulty] = []
    monkeypatch.setattr(Faulty, "fails", "")
    monkeypatch.setattr(Faulty, "opened", made, raising=False)
    yield made
    Faulty.fails = ""
    for link in made:
        if not link.closed:
            link.close()


@pytest.fixture
def link() -> GuardedLink:
    return GuardedLink(URL, lambda: 0.0)


CALLS: dict[str, Callable[[GuardedLink], object]] = {
    "receive": lambda link: link.receive(),
    "send": lambda link: link.send(b"x"),
    "fileno": lambda link: link.fileno(),
    "due": lambda link: link.due(),
    "dropped": lambda link: link.dropped,
    "service": lambda link: link.service(0.0),
}


def test_a_guarded_link_passes_every_call(link: GuardedLink, opened: list[Faulty]) -> None:
    opened[0].pieces = [Received(b"x", "a")]
    assert link.receive() == [Received(b"x", "a")]
    assert link.send(b"x")
    assert (link.text, link.stream, link.dropped, link.due()) == ("faulty link", False, 2, math.inf)
    assert link.fileno() == opened[0].fileno()


@pytest.mark.parametrize("method", CALLS)
def test_a_link_that_raises_is_logged_once_and_closed(
    method: str, link: GuardedLink, opened: list[Faulty], caplog: pytest.LogCaptureFixture
) -> None:
    Faulty.fails = method
    for _ in range(3):
        CALLS[method](link)
    assert [record.message for record in caplog.records] == [
        "faulty link has failed: ValueError: no such thing; it is closed, trying again"
    ]
    assert caplog.records[0].exc_info
    assert opened[0].closed == 1
    assert (link.fileno(), link.receive(), link.send(b"x")) == (-1, [], False)


def test_a_failed_link_opens_again_after_a_wait(link: GuardedLink, opened: list[Faulty]) -> None:
    Faulty.fails = "receive"
    link.receive()
    Faulty.fails = ""
    assert link.due() == -math.inf
    link.service(100.0)
    assert link.due() == 100.0 + FIRST
    link.service(100.0)
    assert len(opened) == 1
    link.service(100.0 + FIRST)
    assert len(opened) == 2
    assert link.fileno() == opened[1].fileno()
    assert link.send(b"x")


def test_the_wait_doubles_until_the_link_is_stable(
    link: GuardedLink, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.INFO)
    now, waits = 0.0, []
    for _ in range(3):
        Faulty.fails = "receive"
        link.receive()
        Faulty.fails = ""
        link.service(now)
        waits.append(round(link.due() - now, 6))
        now = link.due()
        link.service(now)
    assert waits == [FIRST, 2 * FIRST, 4 * FIRST]
    link.service(now)
    assert link.due() == now + STABLE_AFTER
    link.service(now + STABLE_AFTER)
    assert link.due() == math.inf
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert caplog.records[1].message == "faulty link: works again"
    Faulty.fails = "receive"
    link.receive()
    Faulty.fails = ""
    link.service(now)
    assert link.due() == now + FIRST


def test_a_link_that_does_not_open_again_is_tried_again(
    link: GuardedLink, opened: list[Faulty], caplog: pytest.LogCaptureFixture
) -> None:
    Faulty.fails = "receive"
    link.receive()
    Faulty.fails = "__init__"
    now = 0.0
    link.service(now)
    for _ in range(4):
        now = link.due()
        link.service(now)
    assert [record.message for record in caplog.records][1:] == ["faulty:x: ValueError: no such thing, trying again"]
    Faulty.fails = ""
    link.service(link.due())
    assert len(opened) == 2


def test_drops_survive_a_failure_and_count_the_sends_without_a_link(link: GuardedLink) -> None:
    assert link.dropped == 2
    Faulty.fails = "send"
    assert not link.send(b"x")
    assert not link.send(b"x")
    assert link.dropped == 4


@pytest.mark.parametrize("pieces", [None, 7, ["text"], [("text", "a")], [(b"x", [])], [(b"x", "a", "b")]])
def test_a_result_that_is_not_a_list_of_pieces_is_a_failure(
    pieces: object, link: GuardedLink, opened: list[Faulty]
) -> None:
    opened[0].pieces = pieces
    assert link.receive() == []
    assert opened[0].closed


def test_a_closed_link_stays_closed_even_if_closing_raises(link: GuardedLink, opened: list[Faulty]) -> None:
    Faulty.fails = "close"
    link.close()
    link.close()
    link.service(1e9)
    assert (link.due(), link.fileno(), len(opened)) == (math.inf, -1, 1)


def test_a_link_that_cannot_be_opened_at_the_start_is_a_link_error() -> None:
    Faulty.fails = "__init__"
    with pytest.raises(LinkError, match="faulty:x: ValueError: no such thing"):
        GuardedLink(URL)


def test_only_links_of_other_packages_are_guarded() -> None:
    link = open_guarded(parse("udpin:127.0.0.1:0"))
    link.close()
    assert not isinstance(link, GuardedLink)
    assert isinstance(open_guarded(URL), GuardedLink)


@pytest.mark.parametrize("method", ["receive", "send"])
def test_a_link_that_raises_does_not_end_the_gateway(
    method: str, opened: list[Faulty], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kinds, "installed", lambda scheme: FAULTY if scheme == "faulty" else None)
    now = Instant(0.0, 0)
    hub = LinkHub(Config(links=(LinkConfig("faulty:x"), LinkConfig("udpout:127.0.0.1:9"))), lambda: now)
    Faulty.fails = method
    for endpoint in hub.endpoints:
        hub.receiver.receive(endpoint, now)
    hub.speak((), now.mono)
    hub.close()
    assert opened[0].closed == 1
