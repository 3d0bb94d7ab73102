"""Forwards from one UDP port to another with pymavlink. Arguments: PORT OUT."""

from __future__ import annotations

import os
import sys

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil


def main() -> None:
    """Run until stopped."""
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{sys.argv[1]}", dialect="ardupilotmega")
    out = mavutil.mavlink_connection(f"udpout:127.0.0.1:{sys.argv[2]}", dialect="ardupilotmega")
    while True:
        message = link.recv_match(blocking=True)
        if message is not None:
            out.write(message.get_msgbuf())


if __name__ == "__main__":
    main()
