"""UDP to JSON lines in little Python: a `recv` with a time-out, our parser, a line ten times a second. Argument: PORT.

It reads one link and one vehicle, and knows neither time-outs nor rules. So it is about the floor for Python.
"""

from __future__ import annotations

import json
import socket
import sys
import time
from typing import Any

from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.mavlink.decode import text
from mav_robot_status.mavlink.framing import Parser

HEARTBEAT, SYS_STATUS, VFR_HUD, STATUSTEXT = 0, 1, 74, 253
PERIOD = 0.1  # s


def main() -> None:
    """Run until stopped."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", int(sys.argv[1])))
    feed = Parser(WANTED_IDS).feed
    status: dict[str, Any] = {"armed": None, "state": None, "faults": 0, "moving": None, "text": None}
    due = time.monotonic()
    while True:
        link.settimeout(max(0.001, due - time.monotonic()))
        try:
            data = link.recv(2048)
        except TimeoutError:
            data = b""
        armed = status["armed"]
        for frame in feed(data):
            _update(status, frame[0], frame[3])
        if (time.monotonic() >= due or status["armed"] != armed) and status["armed"] is not None:
            print(json.dumps({"stamp": time.time(), **status}), flush=True)
            due = max(due + PERIOD, time.monotonic())


def _update(status: dict[str, Any], kind: int, message: Any) -> None:
    if kind == HEARTBEAT:
        status["armed"] = bool(message.base_mode & 128)
        status["state"] = message.system_status
    elif kind == SYS_STATUS:
        enabled = message.onboard_control_sensors_enabled
        status["faults"] = enabled & ~message.onboard_control_sensors_health
    elif kind == VFR_HUD:
        status["moving"] = message.groundspeed > 0.3
    elif kind == STATUSTEXT:
        status["text"] = text(message.text)


if __name__ == "__main__":
    main()
