"""UDP to JSON lines with pymavlink, as users write it: `recv_match` in a loop. Arguments: PORT [RATE [KEY|any]].

`recv_match` gets the types of the messages that it needs; with `any` it returns all messages.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

KINDS = [
    "HEARTBEAT", "SYS_STATUS", "SYSTEM_TIME", "GPS_RAW_INT", "ATTITUDE", "GLOBAL_POSITION_INT", "VFR_HUD",
    "SERVO_OUTPUT_RAW", "STATUSTEXT", "EXTENDED_SYS_STATE", "COMMAND_ACK",
]  # fmt: skip


def main() -> None:
    """Run until stopped."""
    rate = float(sys.argv[2]) if len(sys.argv) > 2 else 10.0
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{sys.argv[1]}", dialect="ardupilotmega")
    third = sys.argv[3] if len(sys.argv) > 3 else ""
    kinds = None if third == "any" else KINDS
    if third and kinds:
        link.setup_signing(bytes.fromhex(third))
    status: dict[str, Any] = {"armed": None, "state": None, "faults": 0, "moving": None, "text": None}
    due = time.monotonic()
    while True:
        wait = max(0.0, due - time.monotonic()) if rate else 1.0
        message = link.recv_match(type=kinds, blocking=True, timeout=wait)
        armed = status["armed"]
        if message is not None:
            _update(status, message)
        if rate and (time.monotonic() >= due or status["armed"] != armed) and status["armed"] is not None:
            print(json.dumps({"stamp": time.time(), **status}), flush=True)
            due = max(due + 1 / rate, time.monotonic())


def _update(status: dict[str, Any], message: Any) -> None:
    kind = message.get_type()
    if kind == "HEARTBEAT":
        status["armed"] = bool(message.base_mode & 128)
        status["state"] = message.system_status
    elif kind == "SYS_STATUS":
        enabled = message.onboard_control_sensors_enabled
        status["faults"] = enabled & ~message.onboard_control_sensors_health
    elif kind == "VFR_HUD":
        status["moving"] = message.groundspeed > 0.3
    elif kind == "STATUSTEXT":
        status["text"] = message.text


if __name__ == "__main__":
    main()
