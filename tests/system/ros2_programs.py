"""Programs of a ROS 2 network, each in a process of its own and on the loopback interface only.

`python -m tests.system.ros2_programs router PORT`, `zenoh PORT`, `dds DOMAIN`. The subscribers print each message of
`/robot_status` and `/diagnostics` as a JSON line, in the order of arrival. All print `ready` first, and end with their
standard input.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from mav_robot_status.publishers.ros.messages import DIAGNOSTIC_ARRAY, ROBOT_STATUS

from ..unit.publishers.ros.definitions import INDUSTRIAL_MSGS

TRI_STATES = ("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")
DIAGNOSTIC_MSGS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "diagnostic_msgs/msg/KeyValue": "string key\nstring value",
    "diagnostic_msgs/msg/DiagnosticStatus": (
        "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status",
}

_WRITING = threading.Lock()


def router(port: int) -> None:
    """What rmw_zenohd is: a Zenoh router."""
    import zenoh

    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config):
        _until_the_input_ends()


def zenoh(port: int) -> None:
    """The subscriber of zenoh-ros2-sdk, with rosbags as its decoder."""
    from zenoh_ros2_sdk import ROS2Subscriber
    from zenoh_ros2_sdk.session import ZenohSession

    session = ZenohSession.get_instance("127.0.0.1", port)
    definitions = {**DIAGNOSTIC_MSGS, **INDUSTRIAL_MSGS}
    for name, text in definitions.items():
        session.register_message_type(text, name)
    for topic, kind, show in (("/robot_status", ROBOT_STATUS, of_ros), ("/diagnostics", DIAGNOSTIC_ARRAY, _array)):
        ROS2Subscriber(
            topic,
            kind.ros_name,
            _printer(show),
            msg_definition=definitions[kind.ros_name],
            type_hash=kind.hash,
            domain_id=0,
            router_port=port,
            node_name="viewer",
        )
    _until_the_input_ends()
    session.close()


def dds(domain: int) -> None:
    """Readers of Cyclone DDS."""
    from cyclonedds.core import Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.qos import Policy
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    from mav_robot_status.publishers.ros.dds_types import TYPES

    participant = DomainParticipant(domain)
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000))
    topics = (("rt/robot_status", "RobotStatus", of_ros), ("rt/diagnostics", "DiagnosticArray", _array))
    readers = [(DataReader(participant, Topic(participant, t, TYPES[k]), qos), _printer(s)) for t, k, s in topics]

    def take() -> None:
        while True:
            for reader, show in readers:
                for message in reader.take(1000):
                    show(message)
            time.sleep(0.01)

    threading.Thread(target=take, daemon=True).start()
    _until_the_input_ends()


def _printer(show: Callable[[Any], dict[str, Any]]) -> Callable[[Any], None]:
    def write(message: Any) -> None:
        with _WRITING:  # Zenoh has a thread for each subscriber
            print(json.dumps(show(message)), flush=True)

    return write


def of_ros(message: Any) -> dict[str, Any]:
    """A RobotStatus as plain values."""
    return {
        "ns": message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec,
        "handle": message.header.frame_id,
        "mode": message.mode.val,
        **{name: getattr(message, name).val for name in TRI_STATES},
        "error_codes": [int(code) for code in message.error_codes],
    }


def _array(message: Any) -> dict[str, Any]:
    (status,) = message.status
    values = {value.key: value.value for value in status.values}
    return {"level": int(status.level), "message": status.message, "hardware_id": status.hardware_id, "values": values}


def _until_the_input_ends() -> None:
    print("ready", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    {"router": router, "zenoh": zenoh, "dds": dds}[sys.argv[1]](int(sys.argv[2]))
