"""Bytes and type hashes, compared with those of rosbags, which computes both from the definitions."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.interface import Detail, LinkState, RobotStatus, RobotStatusMsg
from mav_robot_status.publishers.ros.cdr import HEADER
from mav_robot_status.publishers.ros.diagnostics import diagnostic_status
from mav_robot_status.publishers.ros.hardware_status import devices
from mav_robot_status.publishers.ros.messages import (
    DIAGNOSTIC_ARRAY,
    HARDWARE_STATUS,
    ROBOT_STATUS,
    diagnostic_array,
    hardware_status,
    robot_status,
)
from mav_robot_status.testing.conformance.publisher import CASES, HOSTILE

from .definitions import CONTROL_MSGS, INDUSTRIAL_MSGS
from .statuses import FAILING, RADIO, message, messages

typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed: pip install rosbags")

PLAIN = [RobotStatusMsg("rover", 1_800_000_000_123_456, status, detail, 0.1) for status, detail in CASES]


@pytest.fixture(scope="session")
def store() -> Any:
    """The types of Jazzy and industrial_msgs."""
    made = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, text in {**INDUSTRIAL_MSGS, **CONTROL_MSGS}.items():
        made.register(typesys.get_types_from_msg(text, name))
    return made


@pytest.mark.parametrize("kind", [ROBOT_STATUS, DIAGNOSTIC_ARRAY, HARDWARE_STATUS])
def test_the_type_hash_is_that_of_the_definition(store: Any, kind: Any) -> None:
    assert store.hash_rihs01(kind.ros_name) == kind.hash


def test_a_type_has_the_names_of_ros_and_of_dds() -> None:
    assert ROBOT_STATUS.ros_name == "industrial_msgs/msg/RobotStatus"
    assert ROBOT_STATUS.dds_name == "industrial_msgs::msg::dds_::RobotStatus_"


@given(messages)
def test_any_status_is_encoded_byte_for_byte(store: Any, msg: RobotStatusMsg) -> None:
    assert robot_status(msg) == _by_rosbags(store, ROBOT_STATUS.ros_name, _ros_status(store, msg))


@given(messages)
def test_any_diagnostic_is_encoded_byte_for_byte(store: Any, msg: RobotStatusMsg) -> None:
    assert diagnostic_array(msg) == _by_rosbags(store, DIAGNOSTIC_ARRAY.ros_name, _ros_diagnostics(store, msg))


@given(messages, st.lists(messages, max_size=3))
def test_any_hardware_status_is_encoded_byte_for_byte(
    store: Any, msg: RobotStatusMsg, others: list[RobotStatusMsg]
) -> None:
    latest = {other.handle: other for other in others}
    values = _ros_hardware(store, msg, latest)
    assert hardware_status(msg, latest) == _by_rosbags(store, HARDWARE_STATUS.ros_name, values)


@pytest.mark.parametrize("link", LinkState)
def test_the_hardware_status_of_a_robot_of_which_nothing_is_known_can_be_read(store: Any, link: LinkState) -> None:
    payload = hardware_status(message(RobotStatus(), Detail(1, 1, link=link)), {})
    (one,) = store.deserialize_cdr(payload, HARDWARE_STATUS.ros_name).hardware_device_states
    (state,) = one.hardware_status
    assert (one.device_id, state.health_status, state.operational_mode, state.power_state) == ("rover", 0, 0, 0)
    assert not len(state.error_domain)


@pytest.mark.parametrize("msg", PLAIN)
def test_every_kind_of_status_can_be_read(store: Any, msg: RobotStatusMsg) -> None:
    found = store.deserialize_cdr(robot_status(msg), ROBOT_STATUS.ros_name)
    names = [name for name in RobotStatus._fields if name != "error_code"]
    assert [getattr(found, name).val for name in names] == [int(getattr(msg.status, name)) for name in names]
    (diagnostic,) = store.deserialize_cdr(diagnostic_array(msg), DIAGNOSTIC_ARRAY.ros_name).status
    assert diagnostic.hardware_id == msg.handle


def test_the_header_has_the_time_of_the_status_and_the_handle(store: Any) -> None:
    header = store.deserialize_cdr(robot_status(message()), ROBOT_STATUS.ros_name).header
    assert (header.stamp.sec, header.stamp.nanosec, header.frame_id) == (1_800_000_000, 123_456_000, "rover")


def test_every_error_code_is_listed_and_none_without_an_error(store: Any) -> None:
    def codes(msg: RobotStatusMsg) -> list[int]:
        return list(store.deserialize_cdr(robot_status(msg), ROBOT_STATUS.ros_name).error_codes)

    assert codes(message(FAILING, RADIO)) == [2001, 2003]
    assert codes(message(FAILING)) == [2001]
    assert codes(message()) == []


def test_without_a_link_everything_is_unknown(store: Any) -> None:
    msg = message(RobotStatus(), Detail(1, 1, link=LinkState.LOST))
    found = store.deserialize_cdr(robot_status(msg), ROBOT_STATUS.ros_name)
    assert {getattr(found, name).val for name in RobotStatus._fields[:-1]} == {-1}
    assert not len(found.error_codes)


@pytest.mark.parametrize("unix_us", [-1, 2**31 * 1_000_000, 2**62])
def test_a_time_that_ros_cannot_express_raises_nothing(unix_us: int) -> None:
    assert robot_status(message(unix_us=unix_us)).startswith(HEADER)


def test_a_hostile_text_raises_nothing(store: Any) -> None:
    msg = message(handle=HOSTILE)
    assert store.deserialize_cdr(robot_status(msg), ROBOT_STATUS.ros_name).header.frame_id.startswith('"\\\n?')


def _by_rosbags(store: Any, name: str, values: Any) -> bytes:
    return bytes(store.serialize_cdr(values, name))


def _ros_header(store: Any, msg: RobotStatusMsg, frame_id: str) -> Any:
    types = store.types
    seconds, us = divmod(msg.unix_us, 1_000_000)
    return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](seconds, us * 1000), frame_id)


def _ros_status(store: Any, msg: RobotStatusMsg) -> Any:
    import numpy

    types, status = store.types, msg.status
    mode = types["industrial_msgs/msg/RobotMode"](int(status.mode))
    tri_states = [types["industrial_msgs/msg/TriState"](int(value)) for value in status[1:6]]
    codes = [error.code for error in msg.detail.errors] or [code for code in [status.error_code] if code]
    header = _ros_header(store, msg, _shown(msg.handle))
    return types[ROBOT_STATUS.ros_name](header, mode, *tri_states, numpy.array(codes, dtype=numpy.int32))


def _ros_diagnostics(store: Any, msg: RobotStatusMsg) -> Any:
    types, found = store.types, diagnostic_status(msg)
    values = [types["diagnostic_msgs/msg/KeyValue"](_shown(key), _shown(value)) for key, value in found.values]
    texts = [_shown(text) for text in (found.name, found.message, found.hardware_id)]
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](int(found.level), *texts, values)
    return types[DIAGNOSTIC_ARRAY.ros_name](_ros_header(store, msg, ""), [status])


def _ros_hardware(store: Any, msg: RobotStatusMsg, latest: dict[str, RobotStatusMsg]) -> Any:
    import numpy

    types, found = store.types, []
    for one in devices(msg, latest):
        kinds = numpy.array(one.error_domain, dtype=numpy.uint8)
        details = [types["diagnostic_msgs/msg/KeyValue"](_shown(k), _shown(v)) for k, v in one.state_details]
        numbers = (one.operational_mode, one.power_state, one.connectivity_status)
        texts = map(_shown, (one.manufacturer, one.model, one.firmware_version))
        state = types["control_msgs/msg/GenericHardwareState"](one.health_status, kinds, *numbers, *texts, details)
        seconds, us = divmod(one.unix_us, 1_000_000)
        stamp = types["builtin_interfaces/msg/Time"](seconds, us * 1000)
        header = types["std_msgs/msg/Header"](stamp, _shown(one.device_id))
        make = types["control_msgs/msg/HardwareDeviceStatus"]
        found.append(make(header, _shown(one.device_id), [state], [], [], []))
    handle = _shown(msg.handle)
    return types[HARDWARE_STATUS.ros_name](_ros_header(store, msg, handle), handle, found)


def _shown(text: str) -> str:
    return text.replace("\0", "?")
