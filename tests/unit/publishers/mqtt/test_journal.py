from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.clock import now as present
from mav_robot_status.errors import LinkError
from mav_robot_status.publishers.mqtt import journal as module
from mav_robot_status.publishers.mqtt.journal import LONGEST, SIZE, Journal
from mav_robot_status.publishers.mqtt.spool import Event


def event(place: int, text: str = "{}") -> Event:
    return Event(place, "r", 0.0, text)


@pytest.fixture
def path(tmp_path: Path) -> str:
    return str(tmp_path / "new")


def left(path: str, last: int = 0) -> list[int]:
    """The places of the events that a newly started gateway finds."""
    with closing(Journal(path, last)) as journal:
        return [event.place for event in journal.left]


def test_an_appended_event_is_in_the_file_at_once(path: str) -> None:
    with closing(Journal(path, 0)) as journal:
        for place in range(1, 4):
            journal.append(event(place, '{"text": "Führerstand\\n"}'))
            assert left(path) == list(range(1, place + 1))
    with closing(Journal(path, 0)) as again:
        assert (again.left[0], again.place) == (event(1, '{"text": "Führerstand\\n"}'), 3)


def test_events_in_the_spool_are_not_delivered_again(path: str) -> None:
    with closing(Journal(path, 0)) as journal:
        for place in (1, 2, 3):
            journal.append(event(place))
    assert left(path, 2) == [3]
    assert left(path, 3) == []


def test_writing_restarts_at_the_beginning_only_when_the_spool_has_everything(path: str) -> None:
    with closing(Journal(path, 0)) as journal:
        for place in (1, 2, 3):
            journal.append(event(place))
        journal.forget(2)
        journal.append(event(4))
        assert left(path) == [1, 2, 3, 4]
        journal.forget(4)
        journal.append(event(5))
        assert left(path) == [5]  # and not the older records behind it


def test_a_restarted_gateway_appends_to_the_events_of_the_last_run(path: str) -> None:
    with closing(Journal(path, 0)) as journal:
        journal.append(event(1))
    with closing(Journal(path, 0)) as journal:
        journal.append(event(2))
        assert left(path) == [1, 2]


def test_the_file_never_grows(path: str) -> None:
    with closing(Journal(path, 0)) as journal:
        for place in range(1, 40):
            journal.append(event(place, "x" * 100_000))
        assert left(path) == list(range(1, 11))
        assert os.path.getsize(path) == SIZE
        journal.forget(39)
        journal.append(event(40))
        assert left(path) == [40]


@settings(max_examples=40, deadline=None)
@given(cut=st.integers(0, 400), rubbish=st.binary(max_size=300))
def test_a_record_that_a_power_failure_cut_is_skipped(
    tmp_path_factory: pytest.TempPathFactory, cut: int, rubbish: bytes
) -> None:
    path = tmp_path_factory.mktemp("journal") / "new"
    with closing(Journal(str(path), 0)) as journal:
        for place in range(1, 6):
            journal.append(event(place, json.dumps({"number": place})))
    data = path.read_bytes()
    path.write_bytes(data[:cut] + rubbish + data[cut + len(rubbish) :])
    whole = left(str(path))
    assert whole == list(range(1, len(whole) + 1))
    assert len(whole) >= data[:cut].count(b"\n")


@pytest.fixture
def hanging(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], None]]:
    """A disk on which writes block until the returned function is called."""
    free, write = threading.Event(), os.pwrite

    def hang(fd: int, data: bytes, offset: int) -> int:
        free.wait()
        return write(fd, data, offset)

    monkeypatch.setattr(os, "pwrite", hang)
    yield free.set
    free.set()


def test_a_hanging_disk_delays_the_gateway_once_and_briefly(
    path: str, hanging: Callable[[], None], caplog: pytest.LogCaptureFixture
) -> None:
    with closing(Journal(path, 0)) as journal:
        start = present().mono
        for place in range(1, 101):
            journal.append(event(place))
        assert LONGEST <= present().mono - start < 10 * LONGEST
        hanging()
        while journal._pending.qsize():  # the thread writes the events that wait
            pass
        journal.append(event(101))
        assert left(path) == list(range(1, 102))
    assert caplog.text.count("the disk wrote no event within") == 1
    assert "100 events were published before they were on the disk" in caplog.text


def test_the_number_of_events_that_wait_for_a_hanging_disk_is_bounded(
    path: str, hanging: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_PENDING", 10)
    with closing(Journal(path, 0)) as journal:
        for place in range(1, 101):
            journal.append(event(place))
        assert journal._pending.qsize() <= 10
        hanging()


def test_a_file_that_cannot_be_created_is_an_error_of_one_line(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot store events in .*Is a directory"):
        Journal(str(tmp_path), 0)
