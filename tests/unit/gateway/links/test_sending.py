"""What a sender sends when, without a socket."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.gateway.links.send_budget import ASKED_LIMIT, SendBudget
from mav_robot_status.gateway.links.sending import Sender
from mav_robot_status.mavlink.definitions import RobotStatus
from mav_robot_status.testing import ManualClock


class Link:
    """One out with a limit."""

    is_out = True

    def __init__(self, limit: float | None) -> None:
        self.budget = SendBudget()
        self.budget.renew(limit)


class End:
    """The channel of a peer that may have asked for an interval."""

    def __init__(self, limit: float | None) -> None:
        self.endpoint = Link(limit)
        self.interval: float | None = None
        self.systems: frozenset[int] = frozenset()


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """drives_powered of each message that was sent."""
    found: list[int] = []

    def send(self: Sender, channel: Any, message: Any, system: int) -> int:
        found.append(message.drives_powered)
        return 36

    monkeypatch.setattr(Sender, "send", send)
    return found


def status(powered: int) -> RobotStatus:
    return RobotStatus(0, 0, 0, 1, 1, 1, 0, powered, powered, 0, 0)


@pytest.fixture
def sender() -> Sender:
    return Sender(ManualClock())


def test_a_status_that_waits_is_not_sent_after_a_newer_one_that_the_peer_has_asked_for(
    sender: Sender, sent: list[int]
) -> None:
    end: Any = End(0.0)
    sender.send_unasked(end, status(0), 1)
    assert sent == []
    end.interval = 60.0
    sender.send_unasked(end, status(1), 1)
    end.endpoint.budget.renew(None)
    sender._send_waiting(end.endpoint.budget)
    assert sent == [1]


def test_a_status_beyond_what_peers_may_ask_for_waits(sender: Sender, sent: list[int]) -> None:
    end: Any = End(0.0)
    end.interval = 60.0
    end.endpoint.budget.count_asked(int(ASKED_LIMIT) + 1)
    sender.send_unasked(end, status(0), 1)
    sender.send_unasked(end, status(1), 1)
    assert sent == []
    end.endpoint.budget.renew(1000.0)
    sender._send_waiting(end.endpoint.budget)
    assert sent == [1]
