from __future__ import annotations

import json
import logging
import os
import random
import resource
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.errors import LinkError
from mav_robot_status.publishers.mqtt import spool as module
from mav_robot_status.publishers.mqtt.spool import CLOCK_SET, MOST_REPLACED, OVERHEAD, RETRY, SWEEP, Event, Spool
from mav_robot_status.publishers.mqtt.spool_file import connect


@pytest.fixture
def path(tmp_path: Path) -> str:
    return str(tmp_path / "folder" / "spool.sqlite")


@pytest.fixture
def spool(path: str) -> Iterator[Spool]:
    made = Spool(path, 10_000, 100.0)
    yield made
    made.close(0.0, 0.0)


def add(spool: Spool, text: str, robot: str = "r", at: float = 0.0) -> None:
    spool.add(Event(spool._place + 1, robot, at, text))


def fill(spool: Spool, *texts: str, robot: str = "r", at: float = 0.0, now: float = 0.0) -> None:
    for text in texts:
        add(spool, text, robot, at)
    spool.flush(now, at)


def texts(spool: Spool, robot: str = "r", place: int = 0, limit: int = 100) -> list[str]:
    return [event.text for event in spool.after(robot, place, limit)]


def test_events_come_back_in_order_and_by_robot(spool: Spool) -> None:
    fill(spool, "a", "b")
    fill(spool, "x", robot="other")
    fill(spool, "c")
    assert texts(spool) == ["a", "b", "c"]
    assert texts(spool, "other") == ["x"]
    first = spool.after("r", 0, 1)[0]
    assert texts(spool, place=first.place, limit=1) == ["b"]
    assert sorted(spool.robots()) == ["other", "r"]
    assert spool.waiting == 4


def test_delivered_events_are_not_returned_again(spool: Spool) -> None:
    fill(spool, "a", "b")
    spool.done(spool.after("r", 0, 1)[0])
    assert texts(spool) == ["b"]
    spool.flush(0.0, 0.0)
    assert texts(spool) == ["b"]
    assert spool.waiting == 1


def test_waiting_events_survive_their_process(path: str) -> None:
    killed = Spool(path, 10_000, 100.0)
    fill(killed, "a", "b")
    killed._db.close()  # as the kernel does, without a close of the spool
    again = Spool(path, 10_000, 100.0)
    fill(again, "c")
    assert texts(again) == ["a", "b", "c"]
    again.close(0.0, 0.0)


def test_places_still_rise_after_everything_was_delivered(path: str) -> None:
    made = Spool(path, 10_000, 100.0)
    fill(made, "a", "b")
    for event in made.after("r", 0, 2):
        made.done(event)
    made.flush(0.0, 0.0)
    made.close(0.0, 0.0)
    again = Spool(path, 10_000, 100.0)
    assert (again.last, again.waiting) == (2, 0)
    again.close(0.0, 0.0)


def test_last_is_the_place_of_the_last_event_on_disk(spool: Spool) -> None:
    add(spool, "a", "late")
    assert (spool.last, spool.robots()) == (0, ["late"])
    spool.flush(0.0, 0.0)
    assert (spool.last, spool.robots()) == (1, ["late"])


def test_a_second_gateway_needs_another_file(spool: Spool, path: str) -> None:
    fill(spool, "a")
    with pytest.raises(LinkError, match="give each its own --mqtt-spool"):
        Spool(path, 10_000, 100.0)


def test_a_file_that_cannot_be_created_is_an_error_of_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LinkError, match="cannot store events in"):
        Spool(str(tmp_path / "file" / "spool"), 10_000, 100.0)


def test_a_corrupt_file_is_renamed_and_replaced(path: str, caplog: pytest.LogCaptureFixture) -> None:
    os.makedirs(os.path.dirname(path))
    Path(path).write_bytes(b"no database" * 1000)
    made = Spool(path, 10_000, 100.0)
    fill(made, "a")
    assert texts(made) == ["a"]
    made.close(0.0, 0.0)
    assert Path(f"{path}.broken").read_bytes().startswith(b"no database")
    assert f"{path} is damaged (file is not a database): it is now {path}.broken" in caplog.text


def large(path: str, count: int = 1000) -> None:
    """A spool of some hundred kilobytes, as a gateway that has ended leaves it."""
    made = Spool(path, 1 << 30, 1e9)
    for number in range(count):
        add(made, f"{number:05}" + "x" * 450, "rs"[number % 2])
        if number % 5000 == 0:
            made.flush(0.0, 0.0)
    made.close(0.0, 0.0)


def overwrite(path: str, data: bytes = b"", start: float = 0.5, end: float = 0.75) -> None:
    """Overwrite the third quarter, or another part."""
    with open(path, "r+b") as file:
        size = os.path.getsize(path)
        first, length = int(size * start), int(size * (end - start))
        file.seek(first)
        file.write((data or random.Random(1).randbytes(length))[:length])


def test_a_file_that_was_damaged_before_the_start_is_set_aside(path: str, caplog: pytest.LogCaptureFixture) -> None:
    large(path)
    caplog.clear()
    overwrite(path)
    damaged = Path(path).read_bytes()
    made = Spool(path, 1 << 30, 1e9)
    fill(made, "a")
    assert (texts(made), made.waiting, made.failed) == (["a"], 1, False)
    made.close(0.0, 0.0)
    assert Path(f"{path}.broken").read_bytes() == damaged
    assert [record.getMessage() for record in caplog.records][:-1] == [
        f"mqtt: {path} is damaged (database disk image is malformed): it is now {path}.broken, and a new one is used; "
        "the events that waited in it are not delivered"
    ]
    again = Spool(path, 1 << 30, 1e9)
    assert texts(again) == ["a"]
    again.close(0.0, 0.0)


def test_a_file_that_is_damaged_while_it_is_used_is_set_aside(path: str, caplog: pytest.LogCaptureFixture) -> None:
    large(path, 20_000)  # more than SQLite's cache
    caplog.clear()
    made = Spool(path, 1 << 30, 1e9)
    for event in made.after("r", 0, 10):
        made.done(event)
    made.flush(0.0, 0.0)
    overwrite(path)
    assert made.waiting == 19_990
    add(made, "in memory")
    reached, place = 0, 0
    while events := made.after("r", place, 100):
        reached, place = reached + len(events), events[-1].place
    assert 10 <= reached < 9_000
    assert texts(made) == ["in memory"]
    fill(made, "later", now=1.0)
    assert (texts(made), made.waiting, made.last) == (["in memory", "later"], 2, 20_002)
    assert made.dropped == {"r": 9_990, "s": 10_000}
    assert [record.getMessage() for record in caplog.records] == [
        f"mqtt: {path} is damaged (database disk image is malformed): it is now {path}.broken, and a new one is used; "
        "19990 events that waited in it are not delivered"
    ]
    made.close(2.0, 0.0)
    again = Spool(path, 1 << 30, 1e9)
    assert (texts(again), again.dropped["s"]) == (["in memory", "later"], 10_000)
    again.close(0.0, 0.0)


def test_of_two_damaged_files_the_last_one_is_kept_with_its_log(path: str) -> None:
    for number in range(2):
        large(path)
        overwrite(path, b"%d" % number * 1_000_000)
        Path(f"{path}-wal").write_bytes(b"%d" % number)
        Spool(path, 1 << 30, 1e9).close(0.0, 0.0)
    files = sorted(os.listdir(os.path.dirname(path)))
    assert [name.removeprefix("spool.sqlite") for name in files if "broken" in name] in (
        [".broken"],
        [".broken", ".broken-wal"],
    )
    assert b"1111" in Path(f"{path}.broken").read_bytes()


@pytest.mark.parametrize("at", range(100))
def test_no_byte_of_the_header_keeps_a_gateway_from_its_spool(path: str, at: int) -> None:
    large(path, 10)
    with open(path, "r+b") as file:
        file.seek(at)
        byte = file.read(1)[0]
        file.seek(at)
        file.write(bytes((byte ^ 0x55,)))
    made = Spool(path, 1 << 30, 1e9)
    fill(made, "a", robot="new")
    fill(made, now=1.0)
    assert texts(made, "new") == ["a"]
    assert not made.failed
    made.close(2.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(0.0, 1.0),
    length=st.sampled_from([1, 20, 4096, 40_000]),
    piece=st.one_of(st.binary(min_size=1, max_size=20), st.just(b"\0")),
    running=st.booleans(),
)
def test_no_damage_ends_a_spool(
    tmp_path_factory: pytest.TempPathFactory, start: float, length: int, piece: bytes, running: bool
) -> None:
    path = str(tmp_path_factory.mktemp("spool") / "s")
    large(path, 300)
    made = Spool(path, 1 << 30, 100.0) if running else None
    if made:
        made._db.execute("PRAGMA cache_size = 0")
    overwrite(path, piece * length, start, min(1.0, start + length / os.path.getsize(path)))
    made = made or Spool(path, 1 << 30, 100.0)
    for number in range(4):
        for robot in {*made.robots(), "r"}:
            for event in made.after(robot, 0, 50):
                made.done(event)
        add(made, "new", "n")
        made.flush(number * SWEEP, CLOCK_SET + number * SWEEP)
    assert "new" in texts(made, "n")
    made.close(100.0, CLOCK_SET)
    Spool(path, 1 << 30, 100.0).close(0.0, 0.0)


def test_a_file_that_is_damaged_again_and_again_is_replaced_by_memory(
    path: str, caplog: pytest.LogCaptureFixture
) -> None:
    made = Spool(path, 10_000, 100.0)
    fill(made, "a", "b")
    for _ in range(MOST_REPLACED + 3):
        made._replace(sqlite3.DatabaseError("malformed"))
        if not made._in_memory:
            fill(made, "lost")
    fill(made, "c")
    assert (texts(made), made.settled) == (["c"], made.last)
    assert "it cannot be replaced (it was damaged too often), and events wait in memory" in caplog.text
    made.close(0.0, 0.0)


def test_on_a_full_disk_a_new_spool_is_in_memory(
    path: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(name: str) -> sqlite3.Connection:
        if name == path:
            raise sqlite3.OperationalError("database or disk is full")
        return connect(name)

    monkeypatch.setattr(module, "connect", full)
    made = Spool(path, 10_000, 100.0)
    fill(made, "a")
    assert (texts(made), made.waiting, made.settled) == (["a"], 1, 0)  # the journal keeps it
    assert [r.getMessage() for r in caplog.records] == [
        f"mqtt: {path}: database or disk is full; events wait in memory until the next start"
    ]
    made.close(0.0, 0.0)


def test_a_limit_on_the_size_of_files_loses_no_event_while_there_is_memory(spool: Spool, path: str) -> None:
    fill(spool, "a")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (os.path.getsize(f"{path}-wal"), before[1]))
    try:
        for number in range(5):
            fill(spool, f"{number}" * 1000, now=number * 2 * RETRY)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert spool.failed
    assert len(texts(spool)) == 6
    spool.flush(100.0, 0.0)
    assert (spool.failed, len(texts(spool)), spool.settled) == (False, 6, 6)
    assert not os.path.exists(f"{path}.broken")


def test_the_oldest_events_are_dropped_beyond_the_size_limit(path: str, caplog: pytest.LogCaptureFixture) -> None:
    made = Spool(path, 3 * (OVERHEAD + 1), 100.0)
    fill(made, "a", "b", "c", "d", "e")
    assert texts(made) == ["c", "d", "e"]
    assert (made.waiting, made.dropped["r"]) == (3, 2)
    assert "2 events were dropped" in caplog.text
    made.close(0.0, 0.0)
    again = Spool(path, 3 * (OVERHEAD + 1), 100.0)
    assert again.dropped["r"] == 2
    again.close(0.0, 0.0)


def test_events_beyond_the_age_limit_are_dropped(spool: Spool) -> None:
    fill(spool, "a", at=CLOCK_SET)
    fill(spool, "b", at=CLOCK_SET + 90.0, now=90.0)
    spool.flush(150.0, CLOCK_SET + 150.0)
    assert texts(spool) == ["b"]
    assert spool.dropped["r"] == 1


@pytest.mark.parametrize("before", [5.0, CLOCK_SET])
def test_a_clock_that_is_set_does_not_make_the_events_of_this_process_old(spool: Spool, before: float) -> None:
    fill(spool, "a", at=before)
    spool.flush(SWEEP, before + SWEEP)
    spool.flush(2 * SWEEP, CLOCK_SET + 864_000.0)
    assert texts(spool) == ["a"]
    spool.flush(200.0, CLOCK_SET + 864_200.0)
    assert texts(spool) == (["a"] if before < CLOCK_SET else [])


def test_the_events_of_an_earlier_process_age_by_the_clock(path: str) -> None:
    earlier = Spool(path, 10_000, 100.0)
    fill(earlier, "a", at=CLOCK_SET)
    earlier.close(0.0, CLOCK_SET)
    made = Spool(path, 10_000, 100.0)
    made.flush(5.0, CLOCK_SET + 50.0)
    made.flush(5.0 + SWEEP, CLOCK_SET + 864_000.0)
    assert texts(made) == []
    made.close(0.0, 0.0)


def test_an_event_dropped_before_its_acknowledgement_counts_once(path: str) -> None:
    made = Spool(path, 2 * (OVERHEAD + 1), 100.0)
    fill(made, "a", "b")
    on_its_way = made.after("r", 0, 1)[0]
    fill(made, "c")
    made.done(on_its_way)
    made.flush(0.0, 0.0)
    assert (made.waiting, texts(made)) == (2, ["b", "c"])
    made.close(0.0, 0.0)


def test_while_the_disk_is_full_events_wait_in_memory(spool: Spool, caplog: pytest.LogCaptureFixture) -> None:
    fill(spool, "a")
    pages = spool._db.execute("PRAGMA page_count").fetchone()[0]
    spool._db.execute(f"PRAGMA max_page_count = {pages}")
    fill(spool, "b" * 8000)
    fill(spool, "c", now=2 * RETRY)
    assert spool.failed
    assert (spool.last, spool.settled) == (1, 1)
    assert [text[0] for text in texts(spool)] == ["a", "b", "c"]
    for event in spool.after("r", 0, 2):
        spool.done(event)
    assert texts(spool) == ["c"]
    add(spool, "d" * 8000)
    spool.flush(4 * RETRY, 0.0)
    assert (spool.last, spool.settled) == (1, 2)  # the second was delivered from memory, and never was on disk
    spool._db.execute("PRAGMA max_page_count = 100000")
    spool.flush(6 * RETRY, 0.0)
    assert not spool.failed
    assert ([text[0] for text in texts(spool)], spool.waiting, spool.settled) == (["c", "d"], 2, 4)
    assert len([r for r in caplog.records if r.levelno == logging.WARNING]) == 2


def test_the_number_of_events_in_memory_is_bounded(spool: Spool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_UNWRITTEN", 3)
    for text in "abcde":
        add(spool, text)
    assert texts(spool) == ["c", "d", "e"]
    assert spool.dropped["r"] == 2


def test_the_file_does_not_grow_beyond_its_limit(path: str) -> None:
    made = Spool(path, 50_000, 100.0)
    for number in range(3000):
        fill(made, json.dumps({"number": number, "rest": "x" * 100}))
    made.close(0.0, 0.0)
    assert os.path.getsize(path) < 200_000


@settings(max_examples=30, deadline=None)
@given(
    steps=st.lists(st.tuples(st.sampled_from(["add", "done", "flush", "again"]), st.sampled_from("rs")), max_size=60)
)
def test_no_sequence_of_calls_loses_an_event_or_changes_the_order(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, str]]
) -> None:
    path = str(tmp_path_factory.mktemp("spool") / "s")
    made, expected = Spool(path, 1 << 30, 1e9), {"r": list[str](), "s": list[str]()}
    for number, (what, robot) in enumerate(steps):
        if what == "add":
            add(made, str(number), robot)
            expected[robot].append(str(number))
        elif what == "done" and (first := made.after(robot, 0, 1)):
            made.done(first[0])
            assert expected[robot].pop(0) == first[0].text
        elif what == "flush":
            made.flush(float(number), 0.0)
        elif what == "again":
            made.close(float(number), 0.0)
            made = Spool(path, 1 << 30, 1e9)
        for name, wanted in expected.items():
            assert texts(made, name) == wanted
    made.close(1e6, 0.0)
    with sqlite3.connect(path) as db:
        assert db.execute("SELECT count(*) FROM events").fetchone()[0] == sum(map(len, expected.values()))
    db.close()
