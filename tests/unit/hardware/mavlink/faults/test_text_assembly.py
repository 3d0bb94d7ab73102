from __future__ import annotations

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.faults import text_assembly
from mav_robot_status.hardware.mavlink.faults.text_assembly import (
    EMPTY,
    MOST_CHUNKS,
    MOST_TEXTS,
    TextAssembly,
    heard_chunk,
    overdue,
)
from mav_robot_status.mavlink.definitions import Statustext

NOW = Instant(1000.0, 1_800_000_000_000_000)
FIRST, SECOND = "x" * 50, "y" * 50


def message(text: str | bytes, number: int = 0, chunk: int = 0, severity: int = 4) -> Statustext:
    raw = text.encode() if isinstance(text, str) else text
    return Statustext(severity, raw.ljust(50, b"\0"), number, chunk)


def said(*messages: Statustext) -> tuple[TextAssembly, list[str]]:
    assembly, texts = EMPTY, []
    for one in messages:
        assembly, finished = heard_chunk(assembly, one, NOW)
        texts += [text.text for text in finished]
    return assembly, texts


def test_a_text_without_an_id_is_complete_however_long() -> None:
    assert said(message("short")) == (EMPTY, ["short"])
    assert said(message(FIRST)) == (EMPTY, [FIRST])


def test_trailing_blanks_and_tabs_are_removed_and_empty_texts_dropped() -> None:
    assert said(message("Failsafe activated\t"), message("UNABLE TO ARM".ljust(50)), message(" \t"))[1] == [
        "Failsafe activated",
        "UNABLE TO ARM",
    ]


def test_bytes_after_a_nul_and_invalid_utf8_are_harmless() -> None:
    assert said(message(b"seen\0not seen"), message(b"\xff\xfeok"))[1] == ["seen", "��ok"]


def test_chunks_are_joined_in_any_order_even_within_a_character() -> None:
    assert said(message(FIRST, 7), message("end", 7, 1))[1] == [f"{FIRST}end"]
    assert said(message("end", 7, 1), message(FIRST, 7))[1] == [f"{FIRST}end"]
    assert said(message(FIRST, 7), message("end", 7, 2), message(SECOND, 7, 1))[1] == [f"{FIRST}{SECOND}end"]


def test_a_single_chunk_with_an_id_is_complete_at_once() -> None:
    assert said(message("Takeoff detected", 4)) == (EMPTY, ["Takeoff detected"])


def test_a_text_of_exactly_fifty_characters_ends_with_an_empty_chunk() -> None:
    assert said(message(FIRST, 7), message("", 7, 1))[1] == [FIRST]


def test_texts_with_different_ids_do_not_mix() -> None:
    assert said(message(FIRST, 7), message(SECOND, 8), message("a", 7, 1), message("b", 8, 1))[1] == [
        f"{FIRST}a",
        f"{SECOND}b",
    ]


def test_the_same_chunk_twice_changes_nothing() -> None:
    assert said(message(FIRST, 7), message(FIRST, 7), message("end", 7, 1))[1] == [f"{FIRST}end"]


def test_a_reused_id_ends_the_previous_text() -> None:
    assert said(message(FIRST, 7), message(SECOND, 7), message("end", 7, 1))[1] == [f"{FIRST}...", f"{SECOND}end"]
    assert said(message(FIRST, 7, severity=2), message("end", 7, 1, severity=6))[1] == [f"{FIRST}..."]


def test_an_incomplete_text_is_used_after_two_seconds_without_a_chunk() -> None:
    assembly, _ = said(message(FIRST, 7), message("end", 7, 2))
    assert overdue(assembly, NOW.mono + 1.9) == (assembly, [])
    assembly, (text,) = overdue(assembly, NOW.mono + 2.0)
    assert (assembly, text.text, text.at) == (EMPTY, f"{FIRST}...end", NOW)


def test_a_text_without_its_start_is_dropped() -> None:
    assembly, texts = said(message("end", 7, 1))
    assert texts == []
    assert overdue(assembly, NOW.mono + 2.0) == (EMPTY, [])


def test_each_chunk_restarts_the_timeout() -> None:
    assembly, _ = said(message(FIRST, 7))
    assembly, _ = heard_chunk(assembly, message(SECOND, 7, 1), later(NOW, 1.5))
    assert overdue(assembly, NOW.mono + 3.0)[1] == []
    assert [text.text for text in overdue(assembly, NOW.mono + 3.5)[1]] == [f"{FIRST}{SECOND}..."]


def test_a_chunk_beyond_the_limit_is_ignored() -> None:
    assembly, _ = said(message(FIRST, 7))
    after, texts = heard_chunk(assembly, message("far", 7, MOST_CHUNKS), NOW)
    assert (after, texts) == (assembly, [])
    assert heard_chunk(EMPTY, message("far", 7, 255), NOW) == (EMPTY, [])


def test_the_oldest_text_ends_when_too_many_are_incomplete() -> None:
    assembly, texts = said(*(message(f"{n}".ljust(50, "."), n) for n in range(1, MOST_TEXTS + 2)))
    assert texts == ["1".ljust(50, ".") + text_assembly.HOLE]
    assert [number for number, _ in assembly] == [2, 3, 4, 5]
