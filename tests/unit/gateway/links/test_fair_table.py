from __future__ import annotations

from typing import Any

from mav_robot_status.gateway.links.fair_table import LOOK_AGAIN, FairTable


class Sender:
    """A holder of a place that gives way or does not."""

    def __init__(self, source: Any, *, silent: bool = True) -> None:
        self.source = source
        self.silent = silent
        self.asked = 0

    def gives_way(self, now: float) -> bool:
        self.asked += 1
        return self.silent


def admitted(table: FairTable[Sender], sender: Sender, now: float = 0.0) -> bool:
    room, _ = table.make_room(sender.source, now)
    if room:
        table.add(sender)
    return room


def filled(most: int, *, silent: bool) -> tuple[FairTable[Sender], list[Sender]]:
    """A full table of senders that have a host each."""
    table: FairTable[Sender] = FairTable(most)
    senders = [Sender((f"10.0.0.{number}", 14550), silent=silent) for number in range(most)]
    assert all(admitted(table, sender) for sender in senders)
    return table, senders


def test_one_host_holds_at_most_a_quarter_of_the_places() -> None:
    table: FairTable[Sender] = FairTable(16)
    assert [admitted(table, Sender(("10.0.0.9", port), silent=False)) for port in range(6)] == [True] * 4 + [False] * 2
    assert admitted(table, Sender(("10.0.0.8", 0)))


def test_a_newcomer_of_a_host_with_its_share_takes_a_place_of_that_host_only() -> None:
    table: FairTable[Sender] = FairTable(16)
    other = Sender(("10.0.0.8", 0))
    assert admitted(table, other)
    assert all(admitted(table, Sender(("10.0.0.9", port))) for port in range(100))
    assert [source for source in table.holders if source != other.source] == [
        ("10.0.0.9", port) for port in range(96, 100)
    ]
    assert table.holders[other.source] is other


def test_in_a_full_table_the_one_used_least_recently_gives_way() -> None:
    table, senders = filled(8, silent=True)
    table.holders.move_to_end(senders[0].source)
    assert table.make_room(("10.0.1.1", 1), 0.0) == (True, senders[1])
    assert senders[1].source not in table.holders


def test_nobody_who_speaks_gives_way() -> None:
    table, senders = filled(8, silent=False)
    assert not admitted(table, Sender(("10.0.1.1", 1)))
    senders[5].silent = True
    assert admitted(table, Sender(("10.0.1.1", 1)), LOOK_AGAIN)
    assert senders[5].source not in table.holders


def test_a_flood_does_not_search_a_full_table_each_time() -> None:
    table, senders = filled(8, silent=False)
    for number in range(1000):
        assert not admitted(table, Sender((f"10.1.{number // 250}.{number % 250}", 1)), number * LOOK_AGAIN / 1000)
    assert sum(sender.asked for sender in senders) == 8


def test_a_flood_passes_those_who_speak_only_once_in_a_round() -> None:
    table: FairTable[Sender] = FairTable(100)
    speaking = [Sender((f"10.0.0.{number}", 1), silent=False) for number in range(50)]
    for sender in speaking:
        assert admitted(table, sender)
    for number in range(1050):
        assert admitted(table, Sender((f"10.1.{number // 250}.{number % 250}", 1)))
    assert len(table.holders) == 100
    assert all(sender.source in table.holders for sender in speaking)
    assert sum(sender.asked for sender in speaking) < 50 * 25


def test_a_place_that_is_free_again_counts_for_its_host_no_longer() -> None:
    table: FairTable[Sender] = FairTable(8)
    for port in range(100):
        assert admitted(table, Sender(("10.0.0.9", port), silent=False))
        table.remove(("10.0.0.9", port))
    table.remove("nobody")
    assert not table.holders
