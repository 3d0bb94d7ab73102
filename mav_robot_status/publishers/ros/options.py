"""The options of the ROS 2 output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ...interface.options import Option, Options


@dataclass(frozen=True)
class Ros2Options(Options):
    """The options of the publisher `ros2`."""

    url: Annotated[
        str, Option("publish ROS 2 topics: zenoh://127.0.0.1:7447 or dds://0, the DDS domain", "--ros2", "URL")
    ] = ""
    namespace: Annotated[str, Option("namespace of the ROS 2 topics and node", "--ros2-namespace", "NAME")] = ""
    topic: Annotated[str, Option("name of the topic of each robot")] = "robot_status"
    rate: Annotated[float, Option("messages a second on each topic if nothing changes, Hz", low=0, high=1000)] = 1.0
    hardware_status: Annotated[bool, Option("publish control_msgs/HardwareStatus too, for ros2_control")] = False
