"""A subscriber of ROS 2 itself, for the Python of a distribution: `SECONDS [TYPE [QUALITY]]`. It prints JSON lines.

TYPE is DiagnosticArray or another one of diagnostic_msgs. QUALITY: `default`, `late` (transient local), `watched`
(with a deadline and a lease, whose events are printed) or `strict` (a deadline that no gateway offers).
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import diagnostic_msgs.msg
import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile

TOPIC = "/diagnostics"


def say(**members: Any) -> None:
    print(json.dumps(members), flush=True)


def heard(message: Any) -> None:
    for status in message.status:
        level = status.level[0] if isinstance(status.level, bytes) else status.level
        values = {value.key: value.value for value in status.values}
        say(level=level, message=status.message, hardware_id=status.hardware_id, values=values)


def main(seconds: str, kind: str = "DiagnosticArray", quality: str = "default") -> None:
    qos, events = QoSProfile(depth=10), None
    if quality == "late":
        qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
    if quality == "strict":
        qos.deadline = Duration(nanoseconds=1_000_000)
    if quality == "watched":
        qos.deadline, qos.liveliness = Duration(seconds=3), LivelinessPolicy.AUTOMATIC
        qos.liveliness_lease_duration = Duration(seconds=3)
        events = SubscriptionEventCallbacks(
            deadline=lambda event: say(event="deadline missed"),
            liveliness=lambda event: say(event="liveliness", alive=event.alive_count),
        )
    rclpy.init()
    node = rclpy.create_node("viewer")
    node.create_subscription(getattr(diagnostic_msgs.msg, kind), TOPIC, heard, qos, event_callbacks=events)
    print("ready", flush=True)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)


main(*sys.argv[1:])
