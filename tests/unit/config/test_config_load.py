"""Valid files: the values they give and their description."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from dataclasses import fields
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from mav_robot_status.config import (
    Config,
    ControllerConfig,
    IdentityConfig,
    LinkConfig,
    PublisherConfig,
    SigningConfig,
    VehicleConfig,
    describe,
    load,
)
from mav_robot_status.errors import ConfigError
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import RobotMode
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.signing import UNSIGNED_IDS

EXAMPLES = sorted((Path(__file__).parents[3] / "config").glob("*.yaml"))

CONTRACT = """\
    links:                                              # URLs, or mappings
      - udp:127.0.0.1:14550
      - {url: "/dev/ttyAMA0:921600", passive: true}
    outs: ["udpout:192.168.1.20:14550"]
    vehicles:
      - {system: 1, handle: industrial_robot_status_handle}
    identity: {system: auto, component: 192}
    hardware: {heartbeat_timeout: 3.5, hover_is_motion: true}
    requests: missing                                                # or none

    robot_status_controller:                            # any other top-level mapping with a type is a controller
      type: mav_robot_status/IndustrialRobotStatusController
      handle_name: industrial_robot_status_handle       # the default
      publish_rate: 10                                  # Hz, the default; 0 publishes nothing periodically
      publish_on_change: true                           # the default
      publishers: [json, mavlink]                       # names, or mappings with a type and options
"""

PASTED = """\
# as in the documentation of industrial_robot_status_controller
robot_status_controller:
  type: industrial_robot_status_controller/IndustrialRobotStatusController
  handle_name: industrial_robot_status_handle
  publish_rate: 10.0
"""


def loaded(tmp_path: Path, text: str) -> Config:
    path = tmp_path / "c.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)


def test_there_are_examples() -> None:
    assert {"one_vehicle_udp.yaml", "two_controllers.yaml", "two_vehicles.yaml"} <= {path.name for path in EXAMPLES}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_every_example_loads_and_is_described(path: Path) -> None:
    config = load(path)
    lines = describe(config)
    assert config.links
    assert config.controllers
    for vehicle in config.vehicles:
        assert any(vehicle.handle in line for line in lines)
    for controller in config.controllers:
        assert any(line.startswith(f"controller {controller.name}: ") for line in lines)


def test_the_stanza_of_the_contract_has_the_documented_meaning(tmp_path: Path) -> None:
    config = loaded(tmp_path, CONTRACT)
    publishers = (PublisherConfig("json"), PublisherConfig("mavlink"))
    assert config == Config(
        links=(LinkConfig("udp:127.0.0.1:14550"), LinkConfig("/dev/ttyAMA0:921600", passive=True)),
        outs=(LinkConfig("udpout:192.168.1.20:14550"),),
        vehicles=(VehicleConfig(1, None, "industrial_robot_status_handle"),),
        controllers=(
            ControllerConfig(
                name="robot_status_controller",
                type="mav_robot_status/IndustrialRobotStatusController",
                parameters={
                    "handle_name": "industrial_robot_status_handle",
                    "publish_rate": 10,
                    "publish_on_change": True,
                    "publishers": ["json", "mavlink"],
                },
                where=f"{tmp_path / 'c.yaml'}:11:5",
                publishers=publishers,
            ),
        ),
    )


def test_the_stanza_of_the_contract_is_the_one_in_the_document() -> None:
    contract = Path(__file__).parents[3] / "docs" / "reference" / "contract.md"
    assert textwrap.dedent(CONTRACT) in contract.read_text(encoding="utf-8")


def test_a_stanza_pasted_from_ros_control_loads(tmp_path: Path) -> None:
    config = loaded(tmp_path, PASTED)
    (controller,) = config.controllers
    assert controller.type == "industrial_robot_status_controller/IndustrialRobotStatusController"
    assert controller.parameters == {"handle_name": "industrial_robot_status_handle", "publish_rate": 10.0}
    assert controller.publishers is None
    assert config.vehicles == ()


@pytest.mark.parametrize(
    "text", ["", "\n", "# nothing\n", "---\n", "---\n...\n", "{}", "links:\nhardware:\n", "\ufeff"]
)
def test_an_empty_file_gives_the_defaults(tmp_path: Path, text: str) -> None:
    assert loaded(tmp_path, text) == Config()


def test_every_hardware_option_is_read(tmp_path: Path) -> None:
    text = """\
hardware:
  heartbeat_timeout: 5
  sys_status_timeout: 800 ms
  hover_is_motion: false
  manual_blocks_motion: yes
  estop_unknown_as: false
  estop_assume_visible: true
  watch_outputs: off
  link_loss_is_error: true
  treat_hil_as_live: true
  text_hold_s: 0
  v_on: 1
  v_off: 0.5
  v_on_disarmed: 2
  v_off_disarmed: 1.5
  mode_overrides: {copter: {77: AUTO, 78: MANUAL}, other: {4294967295: UNKNOWN}}
  ignore_sensors: [3D_MAG, LEAK]
  request_events: false
  px4_events: events.json
"""
    hardware = loaded(tmp_path, text).hardware
    assert hardware == HardwareOptions(
        heartbeat_timeout=5.0,
        sys_status_timeout=0.8,
        hover_is_motion=False,
        manual_blocks_motion=True,
        estop_unknown_as="false",
        estop_assume_visible=True,
        watch_outputs=False,
        link_loss_is_error=True,
        treat_hil_as_live=True,
        text_hold_s=0.0,
        v_on=1.0,
        v_off=0.5,
        v_on_disarmed=2.0,
        v_off_disarmed=1.5,
        mode_overrides={
            "copter": {77: RobotMode.AUTO, 78: RobotMode.MANUAL},
            "other": {4294967295: RobotMode.UNKNOWN},
        },
        ignore_sensors=frozenset({"3D_MAG", "LEAK"}),
        request_events=False,
        px4_events="events.json",
    )
    assert isinstance(hardware.heartbeat_timeout, float)
    default = HardwareOptions()
    assert all(getattr(hardware, option.name) != getattr(default, option.name) for option in fields(default))


@pytest.mark.parametrize(
    ("text", "seconds"), [("0", 0.0), ("0.01", 0.01), ("10 ms", 0.01), ("10ms", 0.01), ("'0.5 s'", 0.5), ("1", 1.0)]
)
def test_a_duration_may_have_a_unit(tmp_path: Path, text: str, seconds: float) -> None:
    assert loaded(tmp_path, f"coalesce: {text}").coalesce == pytest.approx(seconds)


def test_auto_and_any_are_none(tmp_path: Path) -> None:
    config = loaded(tmp_path, "vehicles: [{system: auto, component: any, handle: a}]\nidentity: {system: auto}")
    assert config.vehicles == (VehicleConfig(None, None, "a"),)
    assert config.identity == IdentityConfig(None, 192, True)


def test_signing_requires_only_a_key(tmp_path: Path) -> None:
    config = loaded(tmp_path, "signing: {key_file: vehicle.key}")
    assert config.signing == SigningConfig("vehicle.key", "radio_status", 192)
    config = loaded(tmp_path, "signing: {key_file: ~/vehicle.key, accept_unsigned: none, link_id: 0}")
    assert config.signing == SigningConfig("~/vehicle.key", "none", 0)


@pytest.mark.parametrize(("text", "path"), [("none", None), ("flight.tlog", "flight.tlog")])
def test_a_recording_is_a_file_or_none(tmp_path: Path, text: str, path: str | None) -> None:
    assert loaded(tmp_path, f"record: {text}").record == path


@pytest.mark.parametrize("text", ["1", "[a.tlog]", "{}"])
def test_a_recording_that_is_not_a_string_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigError, match="record must be a text"):
        loaded(tmp_path, f"record: {text}")


@pytest.mark.parametrize(("text", "sent"), [("auto", None), ("true", True), ("false", False)])
def test_whether_a_link_carries_robot_status_is_yes_no_or_auto(tmp_path: Path, text: str, sent: bool | None) -> None:
    config = loaded(tmp_path, f"links: [{{url: 'udp:127.0.0.1:14550', robot_status: {text}}}]")
    assert config.links[0].robot_status is sent


def test_without_signing_there_is_none(tmp_path: Path) -> None:
    assert loaded(tmp_path, "signing: none").signing is None


def test_the_values_for_unsigned_frames_equal_those_of_the_verifier() -> None:
    assert get_args(get_type_hints(SigningConfig)["accept_unsigned"]) == tuple(UNSIGNED_IDS)


@pytest.mark.parametrize(
    ("accept", "words"),
    [
        ("none", "nothing is accepted unsigned"),
        ("radio_status", "nothing but RADIO_STATUS is accepted unsigned"),
        ("all", "everything is accepted unsigned, so nothing received is protected"),
    ],
)
def test_signing_is_described(tmp_path: Path, accept: str, words: str) -> None:
    config = loaded(tmp_path, f"signing: {{key_file: vehicle.key, accept_unsigned: {accept}, link_id: 7}}")
    assert f"signing: with the key in vehicle.key, link ids from 7 on; {words}" in describe(config)


def test_a_publisher_may_have_options(tmp_path: Path) -> None:
    text = (
        "c:\n  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  publishers: [json, {type: json, file: out.jsonl, nested: {1: [2, null]}}]\n"
    )
    (controller,) = loaded(tmp_path, text).controllers
    second = PublisherConfig("json", {"file": "out.jsonl", "nested": {"1": [2, None]}})
    assert controller.publishers == (PublisherConfig("json"), second)


def test_the_parameters_of_another_controller_type_are_not_checked(tmp_path: Path) -> None:
    (controller,) = loaded(tmp_path, "mine: {type: theirs/Controller, publish_rate: fast, day: 2026-11-20}").controllers
    assert controller.parameters == {"publish_rate": "fast", "day": "2026-11-20"}
    assert controller.publishers is None


def test_the_outputs_of_another_controller_type_are_read_as_usual(tmp_path: Path) -> None:
    config = loaded(tmp_path, "mine: {type: other/Controller, publishers: [{type: json, path: a.jsonl}], x: 1}")
    assert config.controllers[0].publishers == (PublisherConfig("json", {"path": "a.jsonl"}),)
    assert config.controllers[0].parameters["x"] == 1


def test_a_file_is_described_line_by_line(tmp_path: Path) -> None:
    text = """\
vehicles: [{system: 2, component: 1, handle: a}, {handle: b}]
identity: {system: 7, heartbeat: false}
hardware: {v_on: 0.4, ignore_sensors: [GPS, AHRS], mode_overrides: {copter: {77: AUTO}}, watch_outputs: false}
requests: none
coalesce: 10 ms
one: {type: mav_robot_status/IndustrialRobotStatusController, handle_name: a, publishers: [json, mavlink]}
two:
  type: mav_robot_status/IndustrialRobotStatusController
  handle_name: b
  publish_rate: -1
  publish_on_change: false
three: {type: theirs/Controller, colour: red}
"""
    assert describe(loaded(tmp_path, text)) == [
        "link: none in the file; give one on the command line",
        "vehicle: system 2, component 1 -> handle 'a'",
        "vehicle: the first system heard that no other entry names, any autopilot component -> handle 'b'",
        "identity: system 7, component 192, without a HEARTBEAT of its own",
        "hardware: watch_outputs = false (default true)",
        "hardware: v_on = 0.4 (default 0.3)",
        "hardware: mode_overrides = copter: {77: AUTO} (default none)",
        "hardware: ignore_sensors = AHRS, GPS (default none)",
        "requests: nothing is requested from the autopilot",
        "coalesce: input gathers for 10 ms before it is read",
        "controller one: handle 'a' at 10 Hz and on change to json, mavlink",
        "controller two: handle 'b' never to the default publisher",
        "controller three: type theirs/Controller, which checks its own parameters (colour)",
    ]


def test_what_passes_through_and_what_is_sent_on_a_link_is_described(tmp_path: Path) -> None:
    text = """\
links:
  - {url: "udp:14550", robot_status: false, speech_limit: 500, heartbeat_timeout: 5 s}
  - {url: "udp:14551", robot_status: true, speech_limit: 0}
  - {url: "udp:14552", passive: true}
forward: true
record: flight.tlog
max_gap: 10 s
"""
    lines = describe(loaded(tmp_path, text))
    assert [line.partition(" (")[2] for line in lines if line.startswith("link: ")] == [
        "ROBOT_STATUS is not sent there; at most 500 B/s are sent unasked; "
        "a vehicle there is lost after 5 s without a heartbeat)",
        "ROBOT_STATUS is sent there; no limit on what is sent)",
        "passive: nothing is sent there)",
    ]
    assert "forward: every frame between the links and the outs" in lines
    assert "record: everything received and sent, to flight.tlog" in lines
    assert "max_gap: a longer silence of a log than 10 s, after the link is lost, gives one line" in lines


def test_an_empty_configuration_is_described_by_the_defaults() -> None:
    assert describe(Config()) == [
        "link: none in the file; give one on the command line",
        "vehicle: every autopilot that is heard, each with a handle of its own",
        "identity: the vehicle's own system, component 192, with a HEARTBEAT of its own",
        "requests: messages that a status needs and that do not arrive",
        "controller: the default one for each handle",
    ]


def test_yaml_is_imported_only_when_a_file_is_read() -> None:
    code = "import sys, mav_robot_status.config as c; c.Config(); sys.exit('yaml' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# -- hardware interfaces -----------------------------------------------------------------------------------------------


def test_a_hardware_list_holds_the_mavlink_options_and_the_other_interfaces(tmp_path: Path) -> None:
    text = "hardware:\n  - {type: mavlink, v_on: 0.4}\n  - {type: ur, name: arm, port: 30004}\n  - {type: ur2}\n"
    config = loaded(tmp_path, text)
    assert config.hardware.v_on == 0.4
    arm, second = config.interfaces
    assert (arm.type, arm.name, arm.options) == ("ur", "arm", {"port": 30004})
    assert arm.where.endswith(":3:5")
    assert (second.name, second.options) == ("ur2", {})
    assert "hardware: 'arm' of type ur (port: 30004)" in describe(config)


def test_mavlink_is_received_with_links_or_without_other_interfaces(tmp_path: Path) -> None:
    links, arm = "links: ['udp:127.0.0.1:1']\n", "hardware: [{type: ur}]\n"
    assert [loaded(tmp_path, text).hears_mavlink for text in ("", links, links + arm, arm)] == [True, True, True, False]


def test_the_time_out_of_a_link_is_read_and_described(tmp_path: Path) -> None:
    file = tmp_path / "satellite.yaml"
    file.write_text(
        'links: [{url: "udp:127.0.0.1:14550", heartbeat_timeout: 120 s, passive: true}, "udp:127.0.0.1:1"]\n'
    )
    config = load(str(file))
    assert [link.heartbeat_timeout for link in config.links] == [120.0, None]
    assert describe(config)[0] == (
        "link: listening on 127.0.0.1:14550/udp (passive: nothing is sent there; "
        "a vehicle there is lost after 120 s without a heartbeat)"
    )


def test_entries_that_only_name_vehicles_expect_none(tmp_path: Path) -> None:
    path = tmp_path / "names.yaml"
    path.write_text("vehicles: [{system: 1, name: Rover-A}, {system: 2, component: 3, name: Copter B}]")
    config = load(path)
    assert config.vehicles == ()
    assert config.names == {(1, None): "Rover-A", (2, 3): "Copter B"}
    assert "vehicle: every autopilot that is heard, each with a handle of its own" in describe(config)
    assert "name: system 2, component 3 is called 'Copter B'" in describe(config)


def test_an_expected_vehicle_can_have_a_name(tmp_path: Path) -> None:
    path = tmp_path / "names.yaml"
    path.write_text("vehicles: [{system: 1, handle: rover, name: Rover-A}, {handle: boat, name: none}]")
    config = load(path)
    assert config.vehicles == (VehicleConfig(1, None, "rover", "Rover-A"), VehicleConfig(None, None, "boat"))
    assert "vehicle: system 1, any autopilot component -> handle 'rover', called 'Rover-A'" in describe(config)


def test_a_mode_can_be_overridden_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "modes.yaml"
    path.write_text(
        "hardware: {mode_overrides: {rover: {GUIDED: MANUAL, hold: UNKNOWN, 77: AUTO}, px4: {AUTO.MISSION: MANUAL}}}"
    )
    assert load(path).hardware.mode_overrides == {
        "rover": {15: RobotMode.MANUAL, 4: RobotMode.UNKNOWN, 77: RobotMode.AUTO},
        "px4": {4 << 16 | 4 << 24: RobotMode.MANUAL},
    }


def test_the_addresses_that_a_link_hears_are_a_list_or_a_part_of_its_url(tmp_path: Path) -> None:
    many = [f"10.0.{number // 250}.{number % 250}" for number in range(300)]
    config = loaded(
        tmp_path,
        "links:\n"
        "  - {url: 'udp:0.0.0.0:14550', from: [10.0.0.5, 10.0.0.0/24], passive: true}\n"
        "  - udp:0.0.0.0:14551?from=10.0.0.5\n"
        f"  - {{url: udp:14552, from: {many}}}\n"
        "outs:\n"
        "  - {url: 'tcpin:[::]:5760', from: ['fe80::1']}\n",
    )
    assert [link.url for link in config.links[:2]] == [
        "udp:0.0.0.0:14550?from=10.0.0.5,10.0.0.0/24",
        "udp:0.0.0.0:14551?from=10.0.0.5",
    ]
    assert config.links[0].passive
    assert parse(config.links[2].url).senders == tuple(many)
    lines = describe(config)
    assert (
        "link: listening on 0.0.0.0:14550/udp, from 10.0.0.5, 10.0.0.0/24 only (passive: nothing is sent there)"
        in lines
    )
    assert "out: listening on [::]:5760/tcp, from fe80::1 only" in lines
