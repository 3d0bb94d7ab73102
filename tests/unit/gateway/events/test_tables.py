"""`EventTables` beside a real hub on a UDP port and the fake PX4, on a manual clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.config import Config, LinkConfig
from mav_robot_status.gateway.events.cache import EventTableCache
from mav_robot_status.gateway.events.tables import AGAIN, RATE, SERIAL_RATE
from mav_robot_status.gateway.mavlink_hardware import MavlinkHardware
from mav_robot_status.mavlink.definitions import ComponentMetadata, FileTransferProtocol
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import FakeAutopilot, ManualClock, VehicleFiles, ardurover, event_files, px4
from mav_robot_status.testing.event_table import PATH

FILES = event_files()
BAD = FILES._replace(files={})
TABLE_FILE = FILES.files[PATH]


class Site:
    """One gateway's MAVLink hardware and the autopilots on its only link."""

    def __init__(self, folder: Path, passive: bool = False, requests: Any = "missing") -> None:
        self.clock = ManualClock()
        link = LinkConfig("udpin:127.0.0.1:0", passive=passive)
        self.hardware = MavlinkHardware(Config(links=(link,), requests=requests), self.clock.now)
        self.tables = self.hardware.tables
        self.tables.cache, self.tables.files = EventTableCache(folder), {}
        self.port: int = self.hardware.hub.endpoints[0].link.port  # type: ignore[attr-defined]
        self.autopilots: list[FakeAutopilot] = []

    def add(self, files: VehicleFiles | None, system: int = 1, scenario: Any = px4.READY) -> FakeAutopilot:
        made = FakeAutopilot(scenario, to=("127.0.0.1", self.port), files=files, system=system)
        self.autopilots.append(made)
        return made

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Let the time pass in steps of 20 ms, until something is true."""
        for _ in range(round(seconds / 0.02)):
            now = self.clock.advance(0.02)
            for autopilot in self.autopilots:
                autopilot.poll(now)
            for source in self.hardware.sources():
                source.receive(now, 100)
            self.hardware.read(now)
            self.hardware.write(now)
            if self.tables._worker.busy:
                self.tables._worker.close()  # the disk takes no time on this clock
                self.tables._worker._thread = None
            if until():
                return

    def has(self, *systems: int) -> Callable[[], bool]:
        return lambda: all((system, 1) in (self.tables.files or {}) for system in systems)

    def close(self) -> None:
        self.hardware.close()
        for autopilot in self.autopilots:
            autopilot.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Callable[..., Site]]:
    made: list[Site] = []

    def make(**options: Any) -> Site:
        made.append(Site(tmp_path / "cache", **options))
        return made[-1]

    yield make
    for one in made:
        one.close()


def transfers(autopilot: FakeAutopilot) -> int:
    return len(autopilot.heard("FILE_TRANSFER_PROTOCOL"))


def test_the_table_of_a_px4_is_read_and_kept_in_the_cache(site: Callable[..., Site], tmp_path: Path) -> None:
    one = site()
    one.add(FILES)
    one.run(20, one.has(1))
    assert one.tables.files == {(1, 1): TABLE_FILE}
    assert EventTableCache(tmp_path / "cache").load(FILES.crc) == TABLE_FILE
    other = site()
    vehicle = other.add(FILES)
    other.run(20, lambda: not other.tables.waits_for() and bool(other.tables.offers))
    assert transfers(vehicle) == 0
    assert other.tables.given_up == {}


def test_files_are_decoded_only_while_a_transfer_runs(site: Callable[..., Site]) -> None:
    here = site()
    here.add(FILES)
    here.run(2)
    channel = next(here.hardware.hub.endpoints[0].channels())
    frame = encode(FileTransferProtocol(0, 255, 190, b"x" * 251), system=1, component=1, sequence=0)
    assert channel.parser.feed(frame)[0].message is None
    decoded = False
    for _ in range(1000):
        here.run(0.02)
        decoded = decoded or channel.parser.feed(frame)[0].message is not None
        if here.has(1)():
            break
    assert decoded
    here.run(3)
    assert channel.parser.feed(frame)[0].message is None


def test_vehicles_on_one_link_take_turns_and_share_a_table(site: Callable[..., Site]) -> None:
    here = site()
    vehicles = [here.add(FILES, system) for system in (1, 2, 3)]
    here.run(20, lambda: len(here.tables.offers) == 3 and not here.tables.waits_for())
    assert sum(transfers(vehicle) > 0 for vehicle in vehicles) == 1
    assert here.tables.given_up == {}


def test_a_failure_is_one_log_line_and_tried_again_only_after_a_reboot(
    site: Callable[..., Site], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    here = site()
    vehicle = here.add(BAD)
    here.run(20, lambda: bool(here.tables.given_up))
    asked = transfers(vehicle)
    here.run(AGAIN + 10)
    assert transfers(vehicle) == asked
    assert sum("no table of its events" in record.getMessage() for record in caplog.records) == 1
    assert "FileNotFound" in here.tables.given_up[1, 1]
    vehicle.reboot()
    here.run(20, lambda: transfers(vehicle) > asked)
    assert transfers(vehicle) > asked


def test_offers_that_change_all_the_time_are_followed_once_a_minute(site: Callable[..., Site]) -> None:
    here = site()
    vehicle = here.add(BAD)
    here.run(20, lambda: bool(here.tables.given_up))
    tracked = here.hardware.vehicles.find(1, 1)
    assert tracked is not None
    before = transfers(vehicle)
    for number in range(100):
        here.tables.on_message(tracked, ComponentMetadata(0, number + 1, BAD.uri.encode()), here.clock.now().mono)
        here.run(0.1)
    assert transfers(vehicle) == before
    assert len(here.tables.offers) == 1


@pytest.mark.parametrize("options", [{"passive": True}, {"requests": "none"}])
def test_nothing_is_asked_where_nothing_may_be(options: dict[str, Any], site: Callable[..., Site]) -> None:
    here = site(**options)
    vehicle = here.add(FILES)
    here.run(10)
    assert vehicle.heard("COMMAND_LONG") == []
    tracked = here.hardware.vehicles.find(1, 1)
    assert tracked is not None
    here.tables.on_message(
        tracked, ComponentMetadata(0, FILES.crc, FILES.uri.encode()), here.clock.now().mono
    )  # overheard
    here.run(10)
    assert transfers(vehicle) == 0


def test_only_a_px4_is_asked(site: Callable[..., Site]) -> None:
    here = site()
    rover = here.add(FILES, scenario=ardurover.READY)
    here.run(10)
    assert transfers(rover) == 0
    assert not any(m.param1 == 397 for m in rover.heard("COMMAND_LONG"))


def test_what_is_no_table_is_not_used_and_not_cached(site: Callable[..., Site], tmp_path: Path) -> None:
    here = site()
    here.add(event_files(b"[]"))
    here.run(20, lambda: bool(here.tables.given_up))
    assert "cannot be read" in here.tables.given_up[1, 1]
    assert here.tables.files == {}
    assert not (tmp_path / "cache").exists()


def test_a_vehicle_that_is_gone_is_forgotten(site: Callable[..., Site]) -> None:
    here = site()
    here.add(FILES)
    here.run(20, lambda: bool(here.tables.offers))
    here.tables.due(here.clock.now().mono, lambda system, component: None)
    assert not here.tables.offers


def test_a_serial_link_gets_a_twentieth_of_the_rate() -> None:
    assert RATE == 20 * SERIAL_RATE == 20_000
