from __future__ import annotations

from typing import Any

from mav_robot_status.gateway.links.send_budget import MOST_WAITING, SendBudget, Waiting

CHANNEL: Any = None


def message(text: str) -> Waiting:
    return Waiting(CHANNEL, text, 1)


def drained(budget: SendBudget, size: int) -> list[str]:
    """The messages that are sent now; each has this size."""
    sent = []
    while (waiting := budget.next_waiting()) is not None:
        sent.append(waiting.message)
        budget.count(size)
    return sent


def limited(limit: float | None) -> SendBudget:
    budget = SendBudget()
    budget.renew(limit)
    return budget


def test_all_are_served_in_turn_within_the_limit() -> None:
    budget = limited(100)
    served: list[int] = []

    def say(number: int) -> int:
        served.append(number)
        return 25

    for _ in range(3):
        budget.renew(100)
        budget.in_turn(range(6), say)
    assert served == [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5]
    assert (budget.sent, budget.withheld) == (300, 6)


def test_a_waiting_message_is_sent_in_a_later_second() -> None:
    budget = limited(40)
    for name in "abc":
        budget.wait(name, message(name))
    assert drained(budget, 30) == ["a", "b"]
    budget.renew(40)
    assert drained(budget, 30) == ["c"]


def test_a_newer_message_replaces_the_waiting_one_and_keeps_its_place() -> None:
    budget = limited(0.5)
    budget.count(1)
    budget.wait("a", message("old"))
    budget.wait("b", message("b"))
    budget.wait("a", message("new"))
    budget.renew(1000)
    assert drained(budget, 1) == ["new", "b"]
    assert budget.withheld == 1


def test_a_message_that_is_overtaken_waits_no_longer() -> None:
    budget = limited(0.0)
    budget.wait("a", message("old"))
    budget.forget("a")
    budget.forget("b")
    assert budget.withheld == 1
    budget.renew(None)
    assert drained(budget, 1) == []


def test_without_a_limit_everything_is_sent_and_counted() -> None:
    budget = limited(None)
    for number in range(1000):
        budget.wait(number, message("x"))
    assert len(drained(budget, 1000)) == 1000
    assert budget.sent == 1_000_000


def test_the_number_of_waiting_messages_is_bounded() -> None:
    budget = limited(1)
    budget.count(1)
    for number in range(MOST_WAITING + 10):
        budget.wait(number, message("x"))
    budget.renew(None)
    assert len(drained(budget, 1)) == MOST_WAITING
    assert budget.withheld == 10


def test_what_peers_asked_for_has_a_limit_of_its_own() -> None:
    budget = limited(100)
    budget.count(100)
    assert budget.has_room_for_asked
    budget.count_asked(10_000)
    assert not budget.has_room_for_asked
