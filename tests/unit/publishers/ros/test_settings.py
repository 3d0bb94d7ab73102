from __future__ import annotations

import re

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.publishers.ros.settings import DDS, ZENOH, Ros2Settings, read


@pytest.mark.parametrize(
    ("url", "expected", "name"),
    [
        ("zenoh://router", Ros2Settings(ZENOH, 0, "router", 7447), "Zenoh router router:7447"),
        ("zenoh://10.0.0.1:7448/5", Ros2Settings(ZENOH, 5, "10.0.0.1", 7448), "Zenoh router 10.0.0.1:7448, domain 5"),
        ("zenoh://[::1]:7447/", Ros2Settings(ZENOH, 0, "::1", 7447), "Zenoh router [::1]:7447"),
        ("dds://42", Ros2Settings(DDS, 42), "DDS domain 42"),
        ("dds://", Ros2Settings(DDS, 0), "DDS domain 0"),
    ],
)
def test_an_address_has_a_middleware_and_a_domain(url: str, expected: Ros2Settings, name: str) -> None:
    assert read({"url": url}, {}) == expected
    assert expected.name == name


@pytest.mark.parametrize("url", ["zenoh://router", "dds://"])
def test_the_domain_is_that_of_the_environment_unless_the_address_has_one(url: str) -> None:
    assert read({"url": url}, {"ROS_DOMAIN_ID": "7"}).domain == 7
    assert read({"url": "dds://3"}, {"ROS_DOMAIN_ID": "7"}).domain == 3


@pytest.mark.parametrize(
    "url", ["", "router", "zenoh://", "zenoh://a:99999", "zenoh://a:x", "http://a", "zenoh://a?x=1", "zenoh://u@a"]
)
def test_another_form_gets_a_line_with_the_right_ones(url: str) -> None:
    with pytest.raises(UsageError, match=r"zenoh://127\.0\.0\.1:7447 .* dds://0"):
        read({"url": url}, {})


@pytest.mark.parametrize("url", ["dds://233", "dds://x", "zenoh://a/-1", "zenoh://a/1/2", "dds://٣"])
def test_a_domain_is_a_number_up_to_232(url: str) -> None:
    with pytest.raises(UsageError, match=f"{re.escape(url)}.*from 0 to 232"):
        read({"url": url}, {})


@pytest.mark.parametrize(
    ("environment", "local", "peers"),
    [
        ({}, False, ()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False, ()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT", "ROS_LOCALHOST_ONLY": "0"}, False, ()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, True, ()),
        ({"ROS_LOCALHOST_ONLY": "1"}, True, ()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, True, ()),
        ({"ROS_STATIC_PEERS": "10.0.0.5;;base.local;"}, False, ("10.0.0.5", "base.local")),
    ],
)
def test_the_range_of_the_discovery_is_that_of_ros(
    environment: dict[str, str], local: bool, peers: tuple[str, ...]
) -> None:
    found = read({"url": "dds://5"}, environment)
    assert (found.local, found.peers) == (local, peers)
    assert found.name == "DDS domain 5" + (" (LOCALHOST)" if local else "")
    assert read({"url": "zenoh://router"}, environment) == read({"url": "zenoh://router"}, {})


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (
            "OFF",
            "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: no subscriber could hear the gateway; write LOCALHOST",
        ),
        ("localhost", "must be one of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT, not 'localhost'"),
    ],
)
def test_a_range_without_subscribers_is_an_error(value: str, says: str) -> None:
    with pytest.raises(UsageError, match=says):
        read({"url": "dds://"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": value})


def test_the_topic_of_the_hardware_status_is_not_that_of_the_status() -> None:
    assert read({"url": "dds://", "hardware_status": True}, {}).hardware_status
    with pytest.raises(UsageError, match="topic: hardware_status is that of control_msgs/HardwareStatus"):
        read({"url": "dds://", "hardware_status": True, "topic": "hardware_status"}, {})


def test_a_wrong_domain_of_the_environment_is_named() -> None:
    with pytest.raises(UsageError, match=r"ROS_DOMAIN_ID in the environment: .* not 'abc'"):
        read({"url": "dds://"}, {"ROS_DOMAIN_ID": "abc"})


@pytest.mark.parametrize(("text", "expected"), [("", ""), ("plant", "/plant"), ("/plant/a/", "/plant/a")])
def test_a_namespace_may_start_with_a_slash(text: str, expected: str) -> None:
    assert read({"url": "dds://0", "namespace": text}, {}).namespace == expected


@pytest.mark.parametrize(
    ("name", "value"),
    [("namespace", "a b"), ("namespace", "/1"), ("topic", "a/b"), ("topic", ""), ("topic", "diagnostics")],
)
def test_a_name_that_ros_does_not_allow_is_an_error(name: str, value: str) -> None:
    with pytest.raises(UsageError, match=f"ros2: {name}: ROS does not allow '{value}'"):
        read({"url": "dds://0", name: value}, {})


def test_a_misspelt_option_gets_a_suggestion() -> None:
    with pytest.raises(UsageError, match="did you mean 'namespace'"):
        read({"url": "dds://0", "namspace": "x"}, {})


@pytest.mark.parametrize("rate", [-1, 1001, "x"])
def test_a_rate_is_a_number_of_hertz(rate: object) -> None:
    with pytest.raises(UsageError, match="rate: must be a number from 0 to 1000"):
        read({"url": "dds://0", "rate": rate}, {})
