from __future__ import annotations

import argparse
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from mav_robot_status import __version__
from mav_robot_status.cli import _parser, main, overridden
from mav_robot_status.config import Config, ControllerConfig, LinkConfig, PublisherConfig, VehicleConfig
from mav_robot_status.errors import UsageError

OURS = "mav_robot_status/IndustrialRobotStatusController"
SLOW = ControllerConfig("slow", OURS, {"publish_rate": 1}, "f:1:1", (PublisherConfig("mavlink"),))
FAST = ControllerConfig("fast", OURS, {"handle_name": "rover"}, "f:5:1", (PublisherConfig("json", {"format": "ros1"}),))


@pytest.fixture(autouse=True)
def sigterm() -> Iterator[None]:
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


def options(*arguments: str) -> argparse.Namespace:
    return _parser().parse_args(["run", *arguments])


def test_without_options_the_configuration_stays_as_it_is() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), controllers=(SLOW,))
    assert overridden(config, options()) == config


def test_connections_and_outs_replace_those_of_the_file() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), outs=(LinkConfig("127.0.0.1:2"),))
    changed = overridden(config, options("udp:127.0.0.1:3", "--out", "127.0.0.1:4", "--out", "127.0.0.1:5"))
    assert [link.url for link in changed.links] == ["udp:127.0.0.1:3"]
    assert [out.url for out in changed.outs] == ["127.0.0.1:4", "127.0.0.1:5"]


def test_passive_concerns_the_vehicle_links_and_not_the_outs() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), outs=(LinkConfig("127.0.0.1:2"),))
    changed = overridden(config, options("--passive"))
    assert changed.links[0].passive
    assert not changed.outs[0].passive


def test_baud_is_for_serial_connections() -> None:
    changed = overridden(Config(), options("/dev/ttyUSB0", "udp:127.0.0.1:1", "--baud", "115200"))
    assert [link.url for link in changed.links] == ["/dev/ttyUSB0,115200", "udp:127.0.0.1:1"]


def test_the_rate_is_every_controllers() -> None:
    changed = overridden(Config(controllers=(SLOW, FAST)), options("--rate", "4"))
    assert [c.parameters["publish_rate"] for c in changed.controllers] == [4.0, 4.0]
    assert overridden(Config(), options("--rate", "0")).controllers[0].parameters["publish_rate"] == 0.0


def test_json_options_go_to_the_json_publishers() -> None:
    changed = overridden(Config(controllers=(SLOW, FAST)), options("--json", "x", "--format", "ros2", "--changes-only"))
    assert changed.controllers[0].publishers == (PublisherConfig("mavlink"),)
    assert changed.controllers[1].publishers == (
        PublisherConfig("json", {"format": "ros2", "path": "x", "changes_only": True}),
    )


def test_json_none_takes_the_json_publishers_away() -> None:
    changed = overridden(Config(), options("--json", "none"))
    assert [p.type for p in changed.controllers[0].publishers or ()] == ["mavlink", "mirror"]


def test_a_json_target_adds_a_publisher_where_the_file_has_none() -> None:
    changed = overridden(Config(controllers=(SLOW,)), options("--json", "x"))
    assert changed.controllers[0].publishers == (PublisherConfig("json", {"path": "x"}), PublisherConfig("mavlink"))


def test_system_keeps_that_vehicle_and_its_controllers() -> None:
    vehicles = VehicleConfig(1, None, "rover"), VehicleConfig(2)
    config = Config(vehicles=vehicles, controllers=(SLOW, FAST))
    assert overridden(config, options("--system", "1")).controllers == (FAST,)
    assert overridden(config, options("--system", "2")).controllers == (SLOW,)
    assert overridden(config, options("--system", "3")).vehicles == (VehicleConfig(3),)


@pytest.mark.parametrize("arguments", [("udp:127.0.0.1:1", "--out", "a.tlog"), ("a:1", "--out", "nothing")])
def test_a_connection_that_cannot_be_is_an_error_for_the_person(arguments: tuple[str, ...]) -> None:
    with pytest.raises(UsageError):
        overridden(Config(), options(*arguments))


@pytest.mark.parametrize(
    "arguments",
    [("--rate", "nan"), ("--rate", "inf"), ("--rate", "x"), ("--system", "0"), ("--system", "1.5"), ("--baud", "-1")],
)
def test_numbers_that_make_no_sense_are_usage_errors(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["udp:127.0.0.1:0", *arguments])
    assert ended.value.code == 2
    assert repr(arguments[1]) in capsys.readouterr().err


def test_a_log_is_replayed_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["a.tlog", "udp:127.0.0.1:0", "-q"]) == 2
    assert "replayed alone" in capsys.readouterr().err


def test_no_connection_is_one_line_and_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert capsys.readouterr().err.startswith("mav-robot-status: no connection given")


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert (ended.value.code, capsys.readouterr().out) == (0, f"mav-robot-status {__version__}\n")


def test_check_config_says_what_it_means(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "c.yaml"
    config.write_text("links: [udp:127.0.0.1:14550]\n")
    assert main(["check-config", str(config)]) == 0
    assert "listening on 127.0.0.1:14550/udp" in capsys.readouterr().out


def test_dialect_writes_where_it_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dialect", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        str(tmp_path / "mav_robot_status.xml"), str(tmp_path / "mav_robot_status.lua"),
    ]  # fmt: skip
    assert sorted(os.listdir(tmp_path)) == ["mav_robot_status.lua", "mav_robot_status.xml"]
