from __future__ import annotations

import dataclasses
import logging
import socket
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from mav_robot_status.config import Config, HardwareConfig, LinkConfig, PublisherConfig
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway import plugins
from mav_robot_status.gateway.background import BackgroundGateway, Rates, on_a_board
from mav_robot_status.links.udp import UdpLink
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import ManualClock
from tests.examples.line_robot import LineRobotHW

from ...deadline import in_time, wait_until


def with_line_robot(load: Callable[[str, str, str], object]) -> Callable[[str, str, str], object]:
    return lambda group, name, where: LineRobotHW if name == "line_robot" else load(group, name, where)


HERE = Config(links=(LinkConfig("udpin:127.0.0.1:0"),))


@pytest.fixture
def vehicle() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        yield made


def beat(vehicle: socket.socket, watched: BackgroundGateway, armed: bool = False) -> None:
    link = watched.gateway.endpoints[0].link
    assert isinstance(link, UdpLink)
    data = encode(Heartbeat(0, 10, 3, 193 if armed else 65, 4, 3), system=1, component=1, sequence=0)
    vehicle.sendto(data, ("127.0.0.1", link.port))


def test_a_detected_vehicle_is_listed_and_can_be_explained(vehicle: socket.socket) -> None:
    with BackgroundGateway(HERE) as watched:
        beat(vehicle, watched)
        wait_until(watched.rows)
        (row,) = watched.rows()
        assert (row.line["system"], row.line["mode"], row.version) == (1, "MANUAL", watched.version)
        assert row.age is not None
        assert row.age >= 0.0
        assert in_time(row.age, 5.0)
        assert watched.explanation() is None
        watched.explained = row.line["handle"]
        wait_until(watched.explanation)
        found = watched.explanation()
        assert found is not None
        assert found["fields"]["drives_powered"]["rule"] == "disarmed"
        watched.explained = "nobody"
        wait_until(lambda: watched.explanation() is None)


def test_the_latest_change_comes_first(vehicle: socket.socket) -> None:
    with BackgroundGateway(HERE) as watched:
        beat(vehicle, watched)
        wait_until(watched.rows)
        handle = watched.rows()[0].line["handle"]
        names = [change.name for _, change in watched.changes([handle], 100)]
        assert (names[-1], names[0]) == ("mode", "inhibit")
        beat(vehicle, watched, armed=True)
        wait_until(lambda: ("drives_powered", True) in [(c.name, c.value) for _, c in watched.changes([handle], 100)])
        assert len(watched.changes([handle], 3)) == 3


def test_the_rates_of_a_vehicle_come_from_the_frames_of_its_link(vehicle: socket.socket) -> None:
    clock = ManualClock()
    watched = BackgroundGateway(HERE, clock.now)
    with closing(watched.gateway) as gateway:
        for _ in range(5):
            beat(vehicle, watched)
            gateway.hardware.all.sources()[0].receive(clock.now(), 64)
            gateway.turn(clock.now())
            clock.advance(1.0)
        (row,) = watched.rows()
    assert row.rates == {"HEARTBEAT": 1.0}


def test_leaving_the_context_stops_the_gateway() -> None:
    with BackgroundGateway(HERE) as watched:
        assert not watched.wait(0.0)
    assert watched.wait(0.0)


def test_the_error_that_ends_the_gateway_is_raised(monkeypatch: pytest.MonkeyPatch, vehicle: socket.socket) -> None:
    def fail(*_: object) -> None:
        raise LinkError("the device has gone")

    watched = BackgroundGateway(HERE)
    monkeypatch.setattr(watched.gateway.hardware.mavlink.vehicles, "on_frame", fail)
    watched.__enter__()
    beat(vehicle, watched)
    assert watched.wait(5.0)
    with pytest.raises(LinkError, match="has gone"):
        watched.__exit__(None, None, None)


def test_the_board_has_no_outs_forwarding_or_recording() -> None:
    config = on_a_board(dataclasses.replace(HERE, outs=HERE.links, forward=True, record="x.tlog"))
    assert (config.outs, config.forward, config.record) == ((), False, None)
    assert [p.type for c in config.controllers for p in c.publishers or ()] == ["board"]


def test_several_links_are_counted(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.ERROR)
    with BackgroundGateway(dataclasses.replace(HERE, links=HERE.links * 2)) as watched:
        assert watched.connection == "2 links"


def test_a_hardware_interface_without_links_is_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "load", with_line_robot(plugins.load))
    config = Config(interfaces=(HardwareConfig("line_robot", "arm", {"port": 0}),))
    with BackgroundGateway(config) as watched:
        wait_until(watched.rows)
        (row,) = watched.rows()
        assert (row.line["handle"], row.line["system"], row.rates) == ("arm", None, {})
        assert (watched.connection, watched.advice) == ("arm", "")


# -- rates -------------------------------------------------------------------------------------------------------------


def test_a_rate_is_measured_over_three_seconds() -> None:
    rates = Rates()
    for tick in range(7):
        rates.take(0, tick * 0.5)
        assert rates.at(tick * 0.5) == ({} if tick < 6 else {"HEARTBEAT": 2.0})


def test_a_message_that_no_longer_arrives_has_no_rate() -> None:
    rates = Rates()
    for second in range(5):
        rates.take(1, second)
    assert rates.at(5.0) == {"SYS_STATUS": 1.0}
    assert rates.at(9.0) == {}
    assert Rates().at(0.0) == {}


def test_other_publishers_can_stand_beside_the_board() -> None:
    (controller,) = on_a_board(HERE, [PublisherConfig("http", {"listen": "127.0.0.1:0"})]).controllers
    assert [publisher.type for publisher in controller.publishers or ()] == ["board", "http"]
    (alone,) = on_a_board(HERE).controllers
    assert [publisher.type for publisher in alone.publishers or ()] == ["board"]
