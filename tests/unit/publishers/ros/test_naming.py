from __future__ import annotations

import logging
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.interface import DEFAULT_HANDLE_NAME
from mav_robot_status.publishers.ros.naming import LONGEST, Topics, clean, is_name

ALLOWED = re.compile(r"(/[A-Za-z](_?[A-Za-z0-9])*)+")
"""https://design.ros2.org/articles/topic_and_service_names.html, without hidden names."""


@pytest.mark.parametrize(
    ("handle", "topic"),
    [
        (DEFAULT_HANDLE_NAME, "/robot_status"),
        (f"{DEFAULT_HANDLE_NAME}/2.1", "/robot_2_1/robot_status"),
        ("rover", "/rover/robot_status"),
        ("plant/Rover 2", "/plant/Rover_2/robot_status"),
        ("__rover--a//b_", "/rover_a/b/robot_status"),
        ("Größe", "/Gr_e/robot_status"),
        ("飛", "/robot/robot_status"),
    ],
)
def test_a_handle_has_a_topic_that_ros_allows(handle: str, topic: str) -> None:
    assert Topics("", "robot_status").of(handle) == topic


def test_topics_are_in_the_namespace() -> None:
    topics = Topics("/plant/a", "status")
    assert [topics.of(name) for name in (DEFAULT_HANDLE_NAME, "rover")] == ["/plant/a/status", "/plant/a/rover/status"]


@given(st.lists(st.text(alphabet="ab1_-/. \ud800é", max_size=6), unique=True, max_size=8))
def test_two_handles_never_share_a_topic(handles: list[str]) -> None:
    topics = Topics("", "robot_status")
    found = [topics.of(handle) for handle in handles]
    assert len(set(found)) == len(found)
    assert all(map(ALLOWED.fullmatch, found)), found
    assert [topics.of(handle) for handle in handles] == found


def test_names_that_differ_only_in_what_ros_does_not_allow_get_a_mark_of_their_own() -> None:
    topics, again = Topics("", "s"), Topics("", "s")
    assert topics.of("rover-a") == "/rover_a/s"
    assert re.fullmatch(r"/rover_a_[0-9a-f]{6}/s", topics.of("rover a"))
    again.of("rover_a")
    assert again.of("rover a") == topics.of("rover a")


def test_the_topic_of_a_handle_that_is_gone_is_free() -> None:
    topics = Topics("", "s")
    topics.of("rover-a")
    assert topics.forget("rover-a") == "/rover_a/s"
    assert topics.of("rover a") == "/rover_a/s"
    assert topics.forget("nobody") is None


def test_a_name_is_bounded() -> None:
    assert len(clean("x" * 1000)) == LONGEST
    assert ALLOWED.fullmatch("/" + clean("a/" * 1000))


def test_each_topic_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    topics = Topics("", "s")
    for _ in range(3):
        topics.of("rover a")
    assert caplog.messages == ["ros2: 'rover a' is on the topic /rover_a/s"]


@pytest.mark.parametrize(
    ("text", "allowed"), [("a_1", True), ("a__b", False), ("_a", False), ("1", False), ("", False)]
)
def test_what_a_person_writes_must_be_allowed(text: str, allowed: bool) -> None:
    assert is_name(text) is allowed
