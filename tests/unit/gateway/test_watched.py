from __future__ import annotations

import dataclasses
import logging
import socket
import time
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway.watched import Rates, Watched, on_a_board
from mav_robot_status.link.udp import UdpLink
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

HERE = Config(links=(LinkConfig("udpin:127.0.0.1:0"),))


@pytest.fixture
def vehicle() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        yield made


def beat(vehicle: socket.socket, watched: Watched, armed: bool = False) -> None:
    link = watched.gateway.stations[0].link
    assert isinstance(link, UdpLink)
    data = encode(Heartbeat(0, 10, 3, 193 if armed else 65, 4, 3), system=1, component=1, sequence=0)
    vehicle.sendto(data, ("127.0.0.1", link.port))


def until(wanted: Callable[[], object], seconds: float = 5.0) -> None:
    deadline = time.monotonic() + seconds
    while not wanted():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_vehicle_that_is_heard_is_on_the_board_and_explained_when_asked_for(vehicle: socket.socket) -> None:
    with Watched(HERE) as watched:
        beat(vehicle, watched)
        until(watched.rows)
        (row,) = watched.rows()
        assert (row.line["system"], row.line["mode"], row.version) == (1, "MANUAL", watched.version)
        assert row.age is not None
        assert 0.0 <= row.age < 5.0
        assert watched.explanation() is None
        watched.explained = row.line["handle"]
        until(watched.explanation)
        found = watched.explanation()
        assert found is not None
        assert found["fields"]["drives_powered"]["rule"] == "disarmed"
        watched.explained = "nobody"
        until(lambda: watched.explanation() is None)


def test_changes_come_the_latest_first(vehicle: socket.socket) -> None:
    with Watched(HERE) as watched:
        beat(vehicle, watched)
        until(watched.rows)
        handle = watched.rows()[0].line["handle"]
        names = [change.name for _, change in watched.changes([handle], 100)]
        assert (names[-1], names[0]) == ("mode", "inhibit")
        beat(vehicle, watched, armed=True)
        until(lambda: ("drives_powered", True) in [(c.name, c.value) for _, c in watched.changes([handle], 100)])
        assert len(watched.changes([handle], 3)) == 3


def test_the_gateway_ends_with_it() -> None:
    with Watched(HERE) as watched:
        assert not watched.wait(0.0)
    assert watched.wait(0.0)


def test_what_ends_the_gateway_is_raised(monkeypatch: pytest.MonkeyPatch, vehicle: socket.socket) -> None:
    def fail(frame: object, now: object) -> None:
        raise LinkError("the device has gone")

    watched = Watched(HERE)
    monkeypatch.setattr(watched.gateway.plant.hw, "take", fail)
    watched.__enter__()
    beat(vehicle, watched)
    assert watched.wait(5.0)
    with pytest.raises(LinkError, match="has gone"):
        watched.__exit__(None, None, None)


def test_it_only_shows_and_gives_to_nobody() -> None:
    config = on_a_board(dataclasses.replace(HERE, outs=HERE.links, forward=True, record="x.tlog"))
    assert (config.outs, config.forward, config.record) == ((), False, None)
    assert [p.type for c in config.controllers for p in c.publishers or ()] == ["board"]


def test_several_links_are_counted(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.ERROR)
    with Watched(dataclasses.replace(HERE, links=HERE.links * 2)) as watched:
        assert watched.connection == "2 links"


# -- rates -------------------------------------------------------------------------------------------------------------


def test_a_rate_is_measured_over_three_seconds() -> None:
    rates = Rates()
    for tick in range(7):
        rates.take(0, tick * 0.5)
        assert rates.at(tick * 0.5) == ({} if tick < 6 else {"HEARTBEAT": 2.0})


def test_a_message_that_has_fallen_silent_has_no_rate() -> None:
    rates = Rates()
    for second in range(5):
        rates.take(1, second)
    assert rates.at(5.0) == {"SYS_STATUS": 1.0}
    assert rates.at(9.0) == {}
    assert Rates().at(0.0) == {}
