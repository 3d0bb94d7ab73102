"""The forms of rmw_zenoh's design document, and those that zenoh-ros2-sdk reads and writes."""

from __future__ import annotations

import struct

import pytest

from mav_robot_status.publishers.ros.messages import ROBOT_STATUS
from mav_robot_status.publishers.ros.transport import Endpoint
from mav_robot_status.publishers.ros.zenoh_keys import (
    attachment,
    endpoint,
    gid,
    message_key,
    node_token,
    publisher_token,
)

NAME = "industrial_msgs::msg::dds_::RobotStatus_"
TOKEN = publisher_token(5, "aa", "/plant", 1, "/plant/rover/robot_status", ROBOT_STATUS)


def test_the_key_of_a_message() -> None:
    assert message_key(0, "/rover/robot_status", ROBOT_STATUS) == f"0/rover/robot_status/{NAME}/{ROBOT_STATUS.hash}"


def test_the_tokens() -> None:
    assert node_token(0, "aa", "") == "@ros2_lv/0/aa/0/0/NN/%/%/mav_robot_status"
    assert node_token(5, "aa", "/plant") == "@ros2_lv/5/aa/0/0/NN/%/%plant/mav_robot_status"
    assert (
        "@ros2_lv/5/aa/0/1/MP/%/%plant/mav_robot_status/%plant%rover%robot_status/"
        f"{NAME}/{ROBOT_STATUS.hash}/::,10:,:,:,,"
    ) == TOKEN


def test_a_token_can_be_read_again() -> None:
    node, topic = "/plant/mav_robot_status", "/plant/rover/robot_status"
    assert endpoint(TOKEN) == Endpoint(5, node, topic, NAME, ROBOT_STATUS.hash)


@pytest.mark.parametrize(
    "other", ["", "a/b", node_token(0, "aa", ""), TOKEN + "/x", TOKEN.replace("/5/", "/x/"), TOKEN.replace("@", "")]
)
def test_another_key_is_no_endpoint(other: str) -> None:
    assert endpoint(other) is None


def test_the_attachment_has_number_time_and_gid() -> None:
    found = attachment(3, 1_800_000_000_000_000_001, gid(TOKEN))
    assert len(found) == 33
    assert struct.unpack("<qqB", found[:17]) == (3, 1_800_000_000_000_000_001, 16)
    assert found[17:] == gid(TOKEN) != gid(TOKEN + "x")


def test_zenoh_ros2_sdk_reads_the_same_in_a_token() -> None:
    pytest.importorskip("zenoh_ros2_sdk", reason="zenoh-ros2-sdk is not installed: pip install zenoh-ros2-sdk")
    from zenoh_ros2_sdk.attachment import Attachment
    from zenoh_ros2_sdk.entity import EndpointEntity, EntityKind, NodeEntity
    from zenoh_ros2_sdk.keyexpr import endpoint_liveliness_keyexpr, topic_keyexpr
    from zenoh_ros2_sdk.qos import DEFAULT_QOS_PROFILE

    node = NodeEntity(domain_id=5, session_id="aa", node_id=0, node_name="mav_robot_status", namespace="/plant")
    theirs = EndpointEntity(
        node=node,
        entity_id=1,
        kind=EntityKind.PUBLISHER,
        name="/plant/rover/robot_status",
        dds_type_name=ROBOT_STATUS.dds_name,
        type_hash=ROBOT_STATUS.hash,
        qos=DEFAULT_QOS_PROFILE.encode(),
        gid=b"",
    )
    assert endpoint_liveliness_keyexpr(theirs) == TOKEN
    assert topic_keyexpr(5, "/x", ROBOT_STATUS.dds_name, ROBOT_STATUS.hash) == message_key(5, "/x", ROBOT_STATUS)
    assert Attachment.from_bytes(attachment(3, 4, gid(TOKEN))).gid == gid(TOKEN)
