"""`--arm`: what it adds to a configuration, and the lines for its wrong forms."""

from __future__ import annotations

import pytest

from mav_robot_status.commands.arms import with_arms
from mav_robot_status.commands.overrides import configured
from mav_robot_status.config import Config, GroupConfig, HardwareConfig, VehicleConfig
from mav_robot_status.errors import UsageError

from .said import said


@pytest.mark.parametrize(
    ("text", "kind", "options"),
    [
        ("ur:192.168.1.30", "ur", {"host": "192.168.1.30"}),
        ("ur:arm-7.local:30005", "ur", {"host": "arm-7.local", "port": 30005}),
        ("ur:[fe80::1%eth0]:30005", "ur", {"host": "fe80::1%eth0", "port": 30005}),
        ("simple_message:[::1]", "simple_message", {"host": "::1"}),
        ("simple_message:10.0.0.9:50241", "simple_message", {"host": "10.0.0.9", "port": 50241}),
    ],
)
def test_an_arm_is_a_hardware_interface_and_a_member_of_the_group(
    text: str, kind: str, options: dict[str, object]
) -> None:
    config = with_arms(Config(), [text])
    assert config.interfaces == (HardwareConfig(kind, "arm", options),)
    assert config.groups == {"robot": GroupConfig()}


def test_further_arms_have_numbers_and_names_that_are_free() -> None:
    texts = ["ur:a", "ur:b", "simple_message:c"]
    assert [one.name for one in with_arms(Config(), texts).interfaces] == ["arm", "arm2", "arm3"]
    config = Config(interfaces=(HardwareConfig("lift", "arm"),), vehicles=(VehicleConfig(1, None, "arm2"),))
    assert [one.name for one in with_arms(config, texts).interfaces] == ["arm", "arm3", "arm4", "arm5"]


def test_the_groups_of_a_configuration_stay() -> None:
    groups = {"cell": GroupConfig(("arm",))}
    assert with_arms(Config(groups=groups), ["ur:a"]).groups == groups


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["192.168.1.30"], "--arm 192.168.1.30: the types of arms are ur: and simple_message:; write for example"),
        (["ur"], "the types of arms are ur: and simple_message:"),
        (["kuka:10.0.0.1"], "--arm kuka:10.0.0.1: the types of arms are ur: and simple_message:"),
        (["ur:"], "--arm ur:: has no host; write for example --arm ur:192.168.1.30"),
        (["ur:::1"], "--arm ur:::1: an IPv6 address needs brackets; write for example --arm ur:[::1]"),
        (["ur:a b"], "--arm ur:a b: this is not HOST or HOST:PORT; write for example --arm ur:192.168.1.30"),
        (["ur:a:rtde"], "this is not HOST or HOST:PORT"),
        (["ur:a:0"], "--arm ur:a:0: a port is a number from 1 to 65535, not 0"),
        (["ur:a:65536"], "--arm ur:a:65536: a port is a number from 1 to 65535, not 65536"),
        (["ur:a", "ur:a"], "--arm ur:a is given twice: one arm has one handle"),
    ],
)
def test_a_wrong_form_is_one_line_that_says_what_would_be_right(texts: list[str], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        with_arms(Config(), texts)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_robot_with_the_name_of_the_group_is_an_error() -> None:
    with pytest.raises(UsageError, match="--arm makes the group 'robot', but a robot of the configuration has"):
        with_arms(Config(vehicles=(VehicleConfig(1, None, "robot"),)), ["ur:a"])


@pytest.mark.parametrize("command", ["run", "watch", "explain", "doctor"])
def test_with_an_arm_no_connection_is_needed(command: str) -> None:
    assert configured(said(command, "--arm", "ur:a")).links == ()
    with pytest.raises(UsageError, match="no connection given"):
        configured(said(command))
