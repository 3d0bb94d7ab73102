"""Invalid files: one line with the position, the fault and the valid values."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mav_robot_status.config import load
from mav_robot_status.config.document import parse_document
from mav_robot_status.config.reader import build
from mav_robot_status.errors import ConfigError

OURS = "type: mav_robot_status/IndustrialRobotStatusController"
EXAMPLES = [path.read_text(encoding="utf-8") for path in (Path(__file__).parents[3] / "config").glob("*.yaml")]
PLACE = re.compile(r"f\.yaml:\d+:\d+: \S")

# (the file, the position, the rest of the message or its start)
FAULTS = [
    # hardware interfaces
    ("hardware: [{name: x}]", "1:12", "hardware[0] has no 'type': write {type: mavlink}, or {type: ..., name: ...}"),
    ("hardware: [{type: ur}, {type: ur}]", "1:24", "two hardware interfaces are named 'ur': give each its own 'name'"),
    ("hardware: [{type: mavlink}, {type: mavlink}]", "1:29", "two MAVLink hardware interfaces: keep one, and write"),
    ("hardware: [{type: mavlink, v_om: 1}]", "1:28", "hardware[0] has no key 'v_om': did you mean 'v_on'?"),
    ("hardware: [{type: mavlink, v_on: 0.1}]", "1:34", "v_off (0.15 m/s) must be less than v_on (0.1 m/s)"),
    ("hardware: [ur]", "1:12", "hardware[0] must be a mapping, not 'ur'"),
    # names
    ("vehicles: [{name: x}]", "1:12", "vehicles[0] has no 'system', and must have one"),
    ("vehicles: [{system: auto, name: x}]", "1:21", "system must be a whole number from 1 to 255, not 'auto'"),
    ("vehicles: [{system: 1, name: 5}]", "1:30", "name must be a text (in quotes if it looks like something else)"),
    ("vehicles: [{system: 1, name: ' '}]", "1:30", "name must be a text of 1 to 40 printable characters"),
    ('vehicles: [{system: 1, name: "a\\nb"}]', "1:30", "name must be a text of 1 to 40 printable characters"),
    (f"vehicles: [{{system: 1, name: {'x' * 41}}}]", "1:30", "name must be a text of 1 to 40 printable characters"),
    ("vehicles: [{handle: a, name: ' '}]", "1:30", "name must be a text of 1 to 40 printable characters"),
    (
        "vehicles: [{system: 1, name: x}, {system: 1, name: y}]",
        "1:34",
        "system 1 is given twice: one vehicle has one name",
    ),
    (
        "vehicles: [{system: 1, name: x}, {system: 2, handle: y}]",
        "1:12",
        "vehicles[0] has a name and no 'handle', and would be ignored: vehicles[1] makes the list the",
    ),
    # groups
    ("groups: {robot: {handle: [a]}}", "1:18", "robot has no key 'handle': did you mean 'handles'?"),
    ("groups: {robot: {fields: {in_motoin: any}}}", "1:27", "the key cannot be 'in_motoin': did you mean 'in_motion'?"),
    ("groups: {robot: {fields: {in_motion: some}}}", "1:38", "in_motion cannot be 'some': it is one of: any, all"),
    ("groups: {robot: {fields: {in_motion: {off: x}}}}", "1:39", "in_motion has no key 'off': did you mean 'of'?"),
    ("groups: {robot: {fields: {in_motion: {}}}}", "1:38", "in_motion has no 'of': write {of: HANDLE}, any or all"),
    (
        "groups: {robot: {handles: [arm], fields: {in_motion: {of: amr}}}}",
        "1:54",
        "'amr' is not a member: did you mean 'arm'?",
    ),
    ("groups: {robot: {handles: [robot]}}", "1:28", "'robot' is a group: a group has robots as members; name those"),
    ("groups: {robot: {handles: [arm, arm]}}", "1:28", "'arm' is given twice: one member counts once"),
    (
        "hardware: [{type: ur, name: arm}]\ngroups: {arm: {}}",
        "2:10",
        "a group cannot have the handle 'arm': a robot has it; choose another name",
    ),
    # not YAML
    (
        "links:\n\t- a\n",
        "2:1",
        "while scanning for the next token, found character '\\t' that cannot start any token: ",
    ),
    (
        "hardware: {v_on: 1\n",
        "2:1",
        "while parsing a flow mapping, expected ',' or '}', but got '<stream end>': close ",
    ),
    ("a: b: c", "1:5", "mapping values are not allowed here: check the indentation, and quote"),
    ("links:\n  - a\n - b\n", "3:2", "while parsing a block mapping, expected <block end>, but found"),
    ("requests: 'none\n", "2:1", "while scanning a quoted scalar, found unexpected end of stream: close the quote"),
    (
        "links: []\n---\nouts: []\n",
        "2:1",
        "expected a single document in the stream, but found another document: write",
    ),
    ("a: &x {type: b}\nc: *x\n", "2:4", "aliases (*name) are not allowed here: write the value out"),
    ("links: [*]", "1:10", "while scanning an alias, expected alphabetic or numeric character, but found ']'"),
    ("&a [*a]", "1:5", "aliases (*name) are not allowed here"),
    ("a: " + "[" * 1000, "1:23", "nested more than 20 deep"),
    ("links: [" + "a," * 20000 + "]", "1:40003", "more than 20000 values: this is not a configuration file"),
    ("a: !!python/object:os.system {}", "1:4", "the tag '!!python/object:os.system' means nothing here: remove it"),
    ("requests: !!python/name:os.system ''", "1:11", "the tag '!!python/name:os.system' means nothing here: remove it"),
    ('requests: "\\U00110000"', "1:14", "not YAML: no such character or number"),
    ('requests: "\\ud800"', "1:11", "half a surrogate pair is not a character"),
    ("coalesce: !!int many", "1:11", "'many' does not read as int: quote it if it is a text"),
    ("coalesce: " + "9" * 65, "1:11", "'" + "9" * 37 + "...' is too long for a number"),
    ("requests: none\x00", "1:15", "a control character: remove it"),
    # top level
    ("- links", "1:1", "the configuration must be a mapping, not a list"),
    ("links", "1:1", "the configuration must be a mapping, not 'links'"),
    ("requests: none\nrequests: missing", "2:1", "the key 'requests' is given twice, first at 1:1: remove one"),
    ("[a, b]: c", "1:1", "a key must be a word, not a list"),
    ("\n\nlink: []", "3:1", "'link' is neither a section nor a controller, which has a 'type': did you mean 'links'?"),
    (
        "vehicle: {system: 1}",
        "1:1",
        "'vehicle' is neither a section nor a controller, which has a 'type': did you mean 'vehicles'?",
    ),
    (
        "zzz: {rate: 1}",
        "1:1",
        "'zzz' is neither a section nor a controller, which has a 'type': it is one of: links, outs, vehicles, ",
    ),
    (
        "controllers: []",
        "1:1",
        "'controllers' is neither a section nor a controller, which has a 'type': it is one of: ",
    ),
    ("requests: always", "1:11", "requests cannot be 'always': it is one of: missing, none"),
    ("requests: mising", "1:11", "requests cannot be 'mising': did you mean 'missing'?"),
    ("requests:", "1:10", "requests cannot be empty: it is one of: missing, none"),
    ("coalesce: 10 minutes", "1:11", "coalesce must be a number from 0 to 1 s, not '10 minutes'"),
    ("coalesce: 10", "1:11", "coalesce must be a number from 0 to 1 s, not 10"),
    ("coalesce: -1 ms", "1:11", "coalesce must be a number from 0 to 1 s, not '-1 ms'"),
    ("coalesce: .nan", "1:11", "coalesce must be a number from 0 to 1 s, not .nan"),
    ("coalesce: true", "1:11", "coalesce must be a number from 0 to 1 s, not true"),
    # links
    (
        "links: udp:127.0.0.1:1",
        "1:8",
        "links must be a list ('- ' before each item, or [in brackets]), not 'udp:127.0.0.1:1'",
    ),
    ("links: [5]", "1:9", "links[0] must be a text (in quotes if it looks like something else), not 5"),
    ("links: ['']", "1:9", "links[0] must be a text of one line, 1 to 1000 characters"),
    ('links: ["a\\nb"]', "1:9", "links[0] must be a text of one line, 1 to 1000 characters"),
    ("links: [{url: 'udp:14550', form: [10.0.0.5]}]", "1:28", "links[0] has no key 'form': did you mean 'from'?"),
    ("links: [{url: 'udp:14550', from: 10.0.0.5}]", "1:34", "from must be a list ('- ' before each item, or [in brac"),
    ("links: [{url: 'udp:14550', from: []}]", "1:34", "from names nobody: write the addresses that are heard, or"),
    ("links:\n- url: udp:14550\n  from:\n  - 10.0.0.5\n  - rover", "5:5", "'rover' is not an address or a network"),
    ("links: [{url: 'udp:14550', from: [10.0.0.5/24]}]", "1:35", "'10.0.0.5/24' is not an address or a network"),
    ("links: [{url: 'udp:14550', from: ['fe80::1']}]", "1:34", "'udp:14550?from=fe80::1': fe80::1 is IPv6, and 0.0"),
    ("links: [{url: 'udp:14550?from=10.0.0.5', from: [10.0.0.6]}]", "1:42", "the url names its senders already: write"),
    ("links: [{url: /dev/ttyS0, from: [10.0.0.5]}]", "1:33", "'/dev/ttyS0?from=10.0.0.5': from= is for links on"),
    ("outs: [{url: 'udpout:10.0.0.5:1', from: [10.0.0.5]}]", "1:41", "'udpout:10.0.0.5:1?from=10.0.0.5': from= is for"),
    ("links: [{passive: true}]", "1:9", "links[0] has no 'url': write a connection like udp:127.0.0.1:14550"),
    (
        "links: [{url: 'udp:127.0.0.1:1', pasive: true}]",
        "1:34",
        "links[0] has no key 'pasive': did you mean 'passive'?",
    ),
    ("links:\n- {url: 'udp:127.0.0.1:1', passive: 1}", "2:37", "passive must be true or false, not 1"),
    ("outs: [{url: 'udpout:127.0.0.1:1', passive: true}]", "1:36", "an out cannot be passive: remove 'passive'"),
    (
        *("outs: [{url: 'udpout:127.0.0.1:1', heartbeat_timeout: 9}]", "1:36"),
        "no vehicle is heard on an out: write 'heartbeat_timeout' under a link",
    ),
    (
        "links: [{url: 'udp:127.0.0.1:1', heartbeat_timeout: 0}]",
        "1:53",
        "heartbeat_timeout must be a number from 0.1 to 86400 s",
    ),
    ("links:\n  - url: 'udp://:14540@127.0.0.1:14557'", "2:10", "'udp://:14540@127.0.0.1:14557' is MAVROS's form"),
    ("links: ['udp:127.0.0.1:99999']", "1:9", "'udp:127.0.0.1:99999': a port is 1 to 65535"),
    ("outs: [flight.tlog]", "1:8", "'flight.tlog' is a log, and an out needs a receiver: write one like udpout:"),
    # vehicles, identity
    ("vehicles: [1]", "1:12", "vehicles[0] must be a mapping with the keys system, component, handle, name, not 1"),
    ("vehicles: [{system: 0}]", "1:21", "system must be a whole number from 1 to 255 or 'auto', not 0"),
    ("vehicles: [{system: 1.5}]", "1:21", "system must be a whole number from 1 to 255 or 'auto', not 1.5"),
    ("vehicles: [{component: all}]", "1:24", "component must be a whole number from 1 to 255 or 'any', not 'all'"),
    ("vehicles: [{handel: a}]", "1:13", "vehicles[0] has no key 'handel': did you mean 'handle'?"),
    ("vehicles:\n- {handle: a}\n- {handle: a}", "3:3", "two vehicles have the handle 'a': give each its own 'handle'"),
    (
        "vehicles:\n- {system: 1, handle: a}\n- {system: 1, handle: b}",
        "3:3",
        "system 1 is given twice: one vehicle has ",
    ),
    ("identity: 5", "1:11", "identity must be a mapping with the keys system, component, heartbeat, not 5"),
    ("identity: {component: 0}", "1:23", "component must be a whole number from 1 to 255, not 0"),
    ("identity: {component: auto}", "1:23", "component must be a whole number from 1 to 255, not 'auto'"),
    ("identity: {heartbeat: 1 Hz}", "1:23", "heartbeat must be true or false, not '1 Hz'"),
    # signing
    ("signing: {}", "1:10", "signing has no 'key_file', and must have one"),
    ("signing:", "1:9", "signing has no 'key_file', and must have one"),
    ("signing: {link_id: 1}", "1:10", "signing has no 'key_file', and must have one"),
    ("signing: true", "1:10", "signing must be a mapping with the keys key_file, accept_unsigned, link_id, not true"),
    ("signing: vehicle.key", "1:10", "signing must be a mapping with the keys key_file, accept_unsigned, link_id, not"),
    ("signing: {keyfile: a}", "1:11", "signing has no key 'keyfile': did you mean 'key_file'?"),
    ("signing: {key_file: }", "1:20", "key_file must be a text"),
    ("signing: {key_file: 5}", "1:21", "key_file must be a text (in quotes if it looks like something else), not 5"),
    ("signing: {key_file: a, link_id: 256}", "1:33", "link_id must be a whole number from 0 to 255, not 256"),
    (
        "signing: {key_file: a, accept_unsigned: radio}",
        "1:41",
        "accept_unsigned cannot be 'radio': it is one of: none, radio_status, all",
    ),
    # hardware
    (
        "hardware:\n  heartbeat_timout: 3",
        "2:3",
        "hardware has no key 'heartbeat_timout': did you mean 'heartbeat_timeout'?",
    ),
    (
        "hardware:\n  colour: red",
        "2:3",
        "hardware has no key 'colour': it is one of: heartbeat_timeout, sys_status_timeout,",
    ),
    ("hardware: {heartbeat_timeout: 0}", "1:31", "heartbeat_timeout must be a number from 0.1 to 3600 s, not 0"),
    ("hardware: {v_on: '1'}", "1:18", "v_on must be a number from 0 to 100 m/s, not '1'"),
    ("hardware: {v_on: 1 s}", "1:18", "v_on must be a number from 0 to 100 m/s, not '1 s'"),
    ("hardware: {v_on: [1]}", "1:18", "v_on must be a number from 0 to 100 m/s, not a list"),
    ("hardware: {v_on: 0.1}", "1:18", "v_off (0.15 m/s) must be less than v_on (0.1 m/s)"),
    ("hardware: {v_off: 0.3}", "1:19", "v_off (0.3 m/s) must be less than v_on (0.3 m/s)"),
    (
        "hardware: {v_on_disarmed: 1, v_off_disarmed: 2}",
        "1:46",
        "v_off_disarmed (2 m/s) must be less than v_on_disarmed",
    ),
    ("hardware: {estop_unknown_as: true}", "1:30", "estop_unknown_as cannot be true: it is one of: unknown, false"),
    ("hardware: {ignore_sensors: [3D_MAGG]}", "1:29", "ignore_sensors[0] cannot be '3D_MAGG': did you mean '3D_MAG'?"),
    ("hardware: {ignore_sensors: 3D_MAG}", "1:28", "ignore_sensors must be a list"),
    ("hardware: {mode_overrides: {coptr: {1: AUTO}}}", "1:29", "the key cannot be 'coptr': did you mean 'copter'?"),
    (
        "hardware: {mode_overrides: {copter: {a: AUTO}}}",
        "1:38",
        "copter has no mode 'a' (a name or a custom_mode): it is one of: ",
    ),
    (
        "hardware: {mode_overrides: {rover: {GUIDDE: AUTO}}}",
        "1:37",
        "rover has no mode 'GUIDDE' (a name or a custom_mode): did you mean 'GUIDED'?",
    ),
    (
        "hardware: {mode_overrides: {px4: {mission: AUTO}}}",
        "1:35",
        "px4 has no mode 'mission' (a name or a custom_mode): did you mean 'AUTO.MISSION'?",
    ),
    (
        "hardware: {mode_overrides: {other: {GUIDED: AUTO}}}",
        "1:37",
        "the modes of 'other' have no names here: write the number, custom_mode, not 'GUIDED'",
    ),
    (
        "hardware: {mode_overrides: {rover: {4: AUTO, HOLD: MANUAL}}}",
        "1:46",
        "mode 4 of rover is given twice, as 'HOLD' and with another name",
    ),
    ("hardware: {mode_overrides: {rover: {-1: AUTO}}}", "1:37", "the key must be a whole number from 0 to 4294967295"),
    (
        "hardware: {mode_overrides: {copter: {1: FAST}}}",
        "1:41",
        "1 cannot be 'FAST': it is one of: UNKNOWN, MANUAL, AUTO",
    ),
    ("hardware: {mode_overrides: {copter: AUTO}}", "1:37", "copter must be a mapping, not 'AUTO'"),
    # controllers
    ("c: {type: }", "1:10", "type must be a text"),
    (f"c:\n  {OURS}\n  publish_rat: 1", "3:3", "c has no key 'publish_rat': did you mean 'publish_rate'?"),
    (f"c:\n  {OURS}\n  publish_rate: fast", "3:17", "publish_rate must be a number of at most 1000 Hz, not 'fast'"),
    (f"c:\n  {OURS}\n  publish_rate: .inf", "3:17", "publish_rate must be a number of at most 1000 Hz, not .inf"),
    (f"c:\n  {OURS}\n  publish_rate: 1001", "3:17", "publish_rate must be a number of at most 1000 Hz, not 1001"),
    ("record: flight.bin", "1:9", "cannot record to 'flight.bin': the name must end in .tlog"),
    (f"c:\n  {OURS}\n  publish_on_change: 1", "3:22", "publish_on_change must be true or false, not 1"),
    (f"c:\n  {OURS}\n  handle_name: ''", "3:16", "handle_name must be a text of one line, 1 to 1000 characters"),
    (f"c:\n  {OURS}\n  publishers: json", "3:15", "publishers must be a list"),
    (f"c:\n  {OURS}\n  publishers: [7]", "3:16", "publishers[0] must be a text"),
    (f"c:\n  {OURS}\n  publishers: [{{file: a}}]", "3:16", "publishers[0] has no 'type': write a publisher's name"),
    (
        f"vehicles: [{{handle: a}}]\nc:\n  {OURS}\n  handle_name: b",
        "4:16",
        "there is no handle 'b'; the vehicles have: a",
    ),
    (
        f"vehicles: [{{handle: a}}]\nc:\n  {OURS}",
        "2:1",
        "there is no handle 'industrial_robot_status_handle'; the vehicles",
    ),
]


@pytest.mark.parametrize(("text", "place", "message"), FAULTS, ids=[fault[0][:40] for fault in FAULTS])
def test_a_fault_is_one_line_with_its_position(text: str, place: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        build(parse_document(text, "f.yaml"))
    said = str(caught.value)
    assert said.startswith(f"f.yaml:{place}: {message}")
    assert PLACE.match(said)
    assert "\n" not in said


def test_the_message_starts_with_the_file_name(tmp_path: Path) -> None:
    path = tmp_path / "my robot.yaml"
    path.write_text("requests: none\nlinks: 5\n")
    with pytest.raises(ConfigError, match=re.escape(f"{path}:2:8: links must be a list")):
        load(path)


def test_the_error_names_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: cannot read the configuration: No such file"):
        load(tmp_path / "nowhere.yaml")


def test_a_directory_is_not_a_configuration(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot read the configuration: Is a directory"):
        load(tmp_path)


def test_the_error_gives_the_position_of_invalid_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_bytes("\ufefflinks: []\n# caf".encode() + b"\xe9\n")
    with pytest.raises(ConfigError, match=r"f\.yaml:2:6: not UTF-8 text"):
        load(path)


def test_an_endless_file_is_not_read_to_its_end() -> None:
    with pytest.raises(ConfigError, match="/dev/zero: this is a device: a configuration is a file, or /dev/stdin"):
        load("/dev/zero")


def test_a_pipe_is_no_configuration_unless_a_shell_has_opened_it(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ConfigError, match=f"{pipe}: this is a pipe: a configuration is a file, or /dev/stdin"):
        load(pipe)
    read, write = os.pipe()
    os.write(write, b"links: [udp:14550]")
    os.close(write)
    assert load(f"/dev/fd/{read}").links[0].url == "udp:14550"
    os.close(read)


def test_nested_aliases_cannot_grow_without_bound() -> None:
    levels = "".join(f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 9)}]\n" for i in range(1, 12))
    with pytest.raises(ConfigError, match=r"f\.yaml:2:10: aliases"):
        build(parse_document("l0: &l0 [a]\n" + levels, "f.yaml"))


@settings(max_examples=100, deadline=None)
@given(st.text(alphabet=st.sampled_from(list("ab01 \n\t:-[]{},'\"&*!|>%@#?.\\uUx_+~=<\r\x00\x85\u2028é"))))
def test_any_text_loads_or_raises_a_config_error(text: str) -> None:
    check(text)


KEYS = (
    "links|vehicles|hardware|identity|signing|coalesce|requests|type|url|key_file|handle|system|mode_overrides|copter|"
    "c|77"
)
LEAVES = (
    "~|1|-.inf|0b_|1:1|2026-99-99|auto|10 ms|AUTO|'x|\"\\U00110000\"|!!bool x|!!int ''|!!binary a|!!set {a}|<<|=|*a|"
    "&a b|udp:127.0.0.1:1|mav_robot_status/IndustrialRobotStatusController|"
)
tree = st.recursive(
    st.sampled_from(LEAVES.split("|")),
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]")
        | st.lists(st.tuples(st.sampled_from(KEYS.split("|")), inner), max_size=4).map(
            lambda items: "{" + ", ".join(f"{key}: {value}" for key, value in items) + "}"
        )
    ),
)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(KEYS.split("|")), tree), max_size=5))
def test_any_section_content_loads_or_raises_a_config_error(sections: list[tuple[str, str]]) -> None:
    check("\n".join(f"{key}: {value}" for key, value in sections))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(EXAMPLES), st.data())
def test_a_mutated_example_loads_or_raises_a_config_error(text: str, data: st.DataObject) -> None:
    for _ in range(data.draw(st.integers(1, 3))):
        start, end, to = (data.draw(st.integers(0, len(text))) for _ in range(3))
        piece = data.draw(st.sampled_from([text[start : start + 20], "", "[", "\n", "\t", " 5", "null", "\x00"]))
        text = text[:to] + piece + text[max(to, min(end, to + 20)) :]
    check(text)


def check(text: str) -> None:
    said = "f.yaml:1:1: fine"
    try:
        build(parse_document(text, "f.yaml"))
    except ConfigError as error:
        said = str(error)
    assert PLACE.match(said)
    assert said.isprintable()
