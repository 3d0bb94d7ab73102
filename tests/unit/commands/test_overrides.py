from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from mav_robot_status.commands.options import given
from mav_robot_status.commands.overrides import configured, loaded, only, overridden, with_publisher
from mav_robot_status.config import Config, ControllerConfig, LinkConfig, PublisherConfig, SigningConfig, VehicleConfig
from mav_robot_status.errors import UsageError
from mav_robot_status.publishers.mqtt.settings import BrokerOptions
from mav_robot_status.publishers.web.settings import HttpOptions

from .said import said

OURS = "mav_robot_status/IndustrialRobotStatusController"
SLOW = ControllerConfig("slow", OURS, {"publish_rate": 1}, "f:1:1", (PublisherConfig("mavlink"),))
FAST = ControllerConfig("fast", OURS, {"handle_name": "rover"}, "f:5:1", (PublisherConfig("json", {"format": "ros1"}),))


def run(*arguments: str) -> argparse.Namespace:
    return said("run", *arguments)


OLD = "has no effect any more: every frame is read, so lost frames are always counted; remove it"


def test_the_kernel_filter_is_accepted_with_a_warning_and_without_effect(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "c.yaml"
    file.write_text("links: [udp:127.0.0.1:1]\nkernel_filter: auto\n")
    config = configured(run("--config", str(file)))
    assert config.links == (LinkConfig("udp:127.0.0.1:1"),)
    assert caplog.messages == [f"{file}:2:1: kernel_filter {OLD}"]
    caplog.clear()
    assert configured(run("udp:127.0.0.1:1", "--no-kernel-filter")) == configured(run("udp:127.0.0.1:1"))
    assert caplog.messages == [f"--no-kernel-filter {OLD}"]


def test_without_options_the_configuration_stays_as_it_is() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), controllers=(SLOW,))
    assert overridden(config, run()) == config


def test_connection_and_out_options_replace_those_of_the_file() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), outs=(LinkConfig("127.0.0.1:2"),))
    changed = overridden(config, run("udp:127.0.0.1:3", "--out", "127.0.0.1:4", "--out", "127.0.0.1:5"))
    assert [link.url for link in changed.links] == ["udp:127.0.0.1:3"]
    assert [out.url for out in changed.outs] == ["127.0.0.1:4", "127.0.0.1:5"]


def test_passive_applies_to_vehicle_links_and_not_to_outs() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), outs=(LinkConfig("127.0.0.1:2"),))
    changed = overridden(config, run("--passive"))
    assert changed.links[0].passive
    assert not changed.outs[0].passive


def test_baud_applies_to_serial_connections() -> None:
    changed = overridden(Config(), run("/dev/ttyUSB0", "udp:127.0.0.1:1", "--baud", "115200"))
    assert [link.url for link in changed.links] == ["/dev/ttyUSB0,115200", "udp:127.0.0.1:1"]


def test_the_rate_applies_to_every_controller() -> None:
    changed = overridden(Config(controllers=(SLOW, FAST)), run("--rate", "4"))
    assert [c.parameters["publish_rate"] for c in changed.controllers] == [4.0, 4.0]
    assert overridden(Config(), run("--rate", "0")).controllers[0].parameters["publish_rate"] == 0.0


def test_json_options_apply_to_the_json_publishers() -> None:
    changed = overridden(Config(controllers=(SLOW, FAST)), run("--json", "x", "--format", "ros2", "--changes-only"))
    assert changed.controllers[0].publishers == (PublisherConfig("mavlink"),)
    assert changed.controllers[1].publishers == (
        PublisherConfig("json", {"format": "ros2", "path": "x", "changes_only": True}),
    )


def test_json_none_removes_the_json_publishers() -> None:
    changed = overridden(Config(), run("--json", "none"))
    assert [p.type for p in changed.controllers[0].publishers or ()] == ["mavlink", "mirror"]


def test_a_json_target_adds_a_publisher_if_the_file_has_none() -> None:
    changed = overridden(Config(controllers=(SLOW,)), run("--json", "x"))
    assert changed.controllers[0].publishers == (PublisherConfig("json", {"path": "x"}), PublisherConfig("mavlink"))


def test_system_keeps_that_vehicle_and_its_controllers() -> None:
    vehicles = VehicleConfig(1, None, "rover"), VehicleConfig(2)
    config = Config(vehicles=vehicles, controllers=(SLOW, FAST))
    assert overridden(config, run("--system", "1")).controllers == (FAST,)
    assert overridden(config, run("--system", "2")).controllers == (SLOW,)
    assert overridden(config, run("--system", "3")).vehicles == (VehicleConfig(3),)


@pytest.mark.parametrize("arguments", [("udp:127.0.0.1:1", "--out", "a.tlog"), ("a:1", "--out", "nothing")])
def test_an_invalid_connection_is_a_user_error(arguments: tuple[str, ...]) -> None:
    with pytest.raises(UsageError):
        overridden(Config(), run(*arguments))


def test_settings_without_a_command_line_option_stay_unchanged() -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:1"),), controllers=(SLOW,), record="x", forward=True)
    for name in ("explain", "doctor", "watch"):
        assert overridden(config, said(name)) == config


def test_the_signing_key_option_keeps_the_rest_of_the_section() -> None:
    section = SigningConfig("file.key", link_id=7)
    changed = overridden(Config(signing=section), run("--signing-key", "mine.key"))
    assert changed.signing == SigningConfig("mine.key", link_id=7)
    assert overridden(Config(), run("--signing-key", "mine.key")).signing == SigningConfig("mine.key")


def test_one_vehicle_of_a_configuration() -> None:
    config = Config(vehicles=(VehicleConfig(1, None, "rover"), VehicleConfig(2)), controllers=(SLOW, FAST))
    assert only(config, 1) == Config(vehicles=config.vehicles[:1], controllers=(FAST,))


def test_page_and_broker_options_replace_those_of_the_file() -> None:
    there = PublisherConfig("http", {"listen": "127.0.0.1:1"}), PublisherConfig("mqtt", {"url": "mqtt://old/x"})
    config = Config(controllers=(ControllerConfig("c", OURS, {}, "f:1:1", there),))
    changed = overridden(config, run("--http", ":8765", "--mqtt", "mqtt://new/x", "--mqtt-robot", "r"))
    assert changed.controllers[0].publishers == (
        PublisherConfig("http", {"listen": ":8765"}),
        PublisherConfig("mqtt", {"url": "mqtt://new/x", "robot": "r"}),
    )


def test_a_page_option_adds_a_publisher() -> None:
    (changed,) = with_publisher("http", (SLOW,), said("demo", "--http", ":1", "--http-open"))
    assert changed.publishers == (PublisherConfig("mavlink"), PublisherConfig("http", {"listen": ":1", "open": True}))
    assert with_publisher("http", (SLOW,), said("demo")) == (SLOW,)


def test_the_port_for_ros_industrial_is_an_option_of_run_and_demo() -> None:
    asked = PublisherConfig("simple_message", {"host": ":11002"})
    assert overridden(Config(controllers=(SLOW,)), run("--simple-message", ":11002")).controllers[0].publishers == (
        PublisherConfig("mavlink"),
        asked,
    )
    (changed,) = with_publisher("simple_message", (SLOW,), said("demo", "--simple-message", ":11002"))
    assert changed.publishers == (PublisherConfig("mavlink"), asked)


def test_the_board_has_the_same_options_except_those_of_a_gateway() -> None:
    options = said("board", "mqtts://b/robots", "--mqtt-user", "u", "--http-token-file", "t", "--alarm")
    assert given(options, BrokerOptions) == {"url": "mqtts://b/robots", "user": "u"}
    assert given(options, HttpOptions) == {"listen": "127.0.0.1:8765", "token_file": "t", "alarm": True}


@pytest.mark.parametrize(
    ("arguments", "missing"),
    [
        (("--http-token-file", "x"), "--http-token-file needs --http HOST:PORT: serve a live web page"),
        (("--http-open",), "--http-open needs --http HOST:PORT: serve a live web page"),
        (("--mqtt-robot", "x"), "--mqtt-robot needs --mqtt URL: publish statuses"),
        (
            ("--mqtt-password-file", "x"),
            "--mqtt-password-file needs --mqtt URL: publish statuses",
        ),
    ],
)
def test_an_option_of_an_unused_publisher_is_a_usage_error(arguments: tuple[str, ...], missing: str) -> None:
    with pytest.raises(UsageError, match=missing):
        overridden(Config(), run(*arguments))


@pytest.mark.parametrize(
    ("name", "example"), [("run", "mav-robot-status udp"), ("watch", "mav-robot-status watch udp")]
)
def test_a_missing_connection_is_an_error_with_an_example_command(name: str, example: str) -> None:
    with pytest.raises(UsageError, match=f"no connection given; write for example {example}"):
        configured(said(name))


def test_the_table_of_px4s_events_replaces_that_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text("hardware: {px4_events: of-the-file.json, v_on: 1}\n")
    assert loaded(run("--config", str(file))).hardware.px4_events == "of-the-file.json"
    for command in ("run", "watch", "explain", "doctor"):
        hardware = loaded(said(command, "--config", str(file), "--px4-events", "mine.json")).hardware
        assert (hardware.px4_events, hardware.v_on) == ("mine.json", 1.0)
    assert loaded(said("report", "flight.tlog", "--px4-events", "mine.json")).hardware.px4_events == "mine.json"


@pytest.mark.parametrize("command", ["run", "explain", "doctor", "watch", "report"])
def test_names_of_the_command_line(command: str) -> None:
    options = said(command, "x.tlog", "--name", "1=Rover-A", "--name", "2.3=a=b")
    assert loaded(options).names == {(1, None): "Rover-A", (2, 3): "a=b"}


def test_a_name_of_the_command_line_replaces_that_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "names.yaml"
    path.write_text("vehicles: [{system: 1, name: old}, {system: 2, name: B}]")
    assert loaded(run("--config", str(path), "--name", "1=new")).names == {(1, None): "new", (2, None): "B"}


def test_one_vehicle_has_one_name() -> None:
    with pytest.raises(UsageError, match=r"--name 1\.2= is given twice: one vehicle has one name"):
        loaded(run("--name", "1.2=a", "--name", "1.2=b"))
