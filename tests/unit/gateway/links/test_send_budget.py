from __future__ import annotations

from typing import Any

from mav_robot_status.gateway.links.send_budget import MOST_WAITING, Speech, Waiting

CHANNEL: Any = None


def message(text: str) -> Waiting:
    return Waiting(CHANNEL, text, 1)


def drained(speech: Speech, size: int) -> list[str]:
    """The messages that are sent now; each has this size."""
    sent = []
    while (waiting := speech.next_waiting()) is not None:
        sent.append(waiting.message)
        speech.count(size)
    return sent


def limited(limit: float | None) -> Speech:
    speech = Speech()
    speech.renew(limit)
    return speech


def test_all_are_served_in_turn_within_the_limit() -> None:
    speech = limited(100)
    served: list[int] = []

    def say(number: int) -> int:
        served.append(number)
        return 25

    for _ in range(3):
        speech.renew(100)
        speech.in_turn(range(6), say)
    assert served == [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5]
    assert (speech.said, speech.withheld) == (300, 6)


def test_a_waiting_message_is_sent_in_a_later_second() -> None:
    speech = limited(40)
    for name in "abc":
        speech.wait(name, message(name))
    assert drained(speech, 30) == ["a", "b"]
    speech.renew(40)
    assert drained(speech, 30) == ["c"]


def test_a_newer_message_replaces_the_waiting_one_and_keeps_its_place() -> None:
    speech = limited(0.5)
    speech.count(1)
    speech.wait("a", message("old"))
    speech.wait("b", message("b"))
    speech.wait("a", message("new"))
    speech.renew(1000)
    assert drained(speech, 1) == ["new", "b"]
    assert speech.withheld == 1


def test_a_message_that_is_overtaken_waits_no_longer() -> None:
    speech = limited(0.0)
    speech.wait("a", message("old"))
    speech.forget("a")
    speech.forget("b")
    assert speech.withheld == 1
    speech.renew(None)
    assert drained(speech, 1) == []


def test_without_a_limit_everything_is_sent_and_counted() -> None:
    speech = limited(None)
    for number in range(1000):
        speech.wait(number, message("x"))
    assert len(drained(speech, 1000)) == 1000
    assert speech.said == 1_000_000


def test_the_number_of_waiting_messages_is_bounded() -> None:
    speech = limited(1)
    speech.count(1)
    for number in range(MOST_WAITING + 10):
        speech.wait(number, message("x"))
    speech.renew(None)
    assert len(drained(speech, 1)) == MOST_WAITING
    assert speech.withheld == 10


def test_what_peers_asked_for_has_a_limit_of_its_own() -> None:
    speech = limited(100)
    speech.count(100)
    assert speech.has_room_for_asked
    speech.count_asked(10_000)
    assert not speech.has_room_for_asked
