"""The `mqtt` publisher with made-up statuses of many robots that change often: a gateway without vehicles.

    python -m tests.system.mqtt_feeder --robots 500 --rate 1 --events 0.1 --seconds 60 mqtt://127.0.0.1:1883/robots

Each robot has a status `rate` times a second. The share `events` of them differs from the status before. Standard
output has one JSON line for each change, written when the publisher has taken it. The last line is the cost.
"""

from __future__ import annotations

import argparse
import io
import json
import logging
import resource
import signal
import time

from mav_robot_status.clock import now as present
from mav_robot_status.interface import Detail, PublisherContext, RobotMode, RobotStatus, RobotStatusMsg, TriState
from mav_robot_status.publishers.mqtt.publisher import MqttPublisher


class NoMavlink:
    """A MAVLink port without peers."""

    def audiences(self) -> list[object]:
        return []

    requests = audiences

    def send(self, message: object, system: int, audience: object) -> None:
        raise AssertionError("nothing is sent")


def message(robot: int, changes: int, unix_us: int, heard: bool = True) -> RobotStatusMsg:
    """A status with the number of its changes as error code."""
    code = changes % 1000
    no = TriState.FALSE
    status = RobotStatus(
        mode=RobotMode.AUTO,
        e_stopped=no,
        drives_powered=no,
        motion_possible=no,
        in_motion=no,
        in_error=TriState(bool(code)),
        error_code=code,
    )
    return RobotStatusMsg(f"robot{robot}", unix_us, status, Detail(1 + robot % 250, 1), 0.1 if heard else None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("--robots", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first robot")
    parser.add_argument("--rate", type=float, default=1.0, help="statuses a second and robot")
    parser.add_argument("--events", type=float, default=0.1, help="share of the statuses that differ")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--changes", type=int, default=0, help="after this many changes, wait until they are delivered")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="of the publisher")
    parser.add_argument("--quiet", action="store_true", help="only the last line")
    asked = parser.parse_args()
    logging.basicConfig(level=logging.WARNING, format="%(message)s")
    signal.signal(signal.SIGTERM, signal.default_int_handler)

    options = {"url": asked.url, "robot": "{handle}", **dict(text.split("=", 1) for text in asked.option)}
    publisher = MqttPublisher(PublisherContext(options, NoMavlink(), io.StringIO()))  # type: ignore[arg-type]
    changes = [0] * asked.robots
    told_all = float("inf")
    told, spent = 0, 0.0
    start = time.monotonic()
    period = 1 / asked.rate / asked.robots
    try:
        turn = 0
        while time.monotonic() - start < asked.seconds:
            if asked.changes and told >= asked.changes:
                told_all = min(told_all, time.monotonic())
                if time.monotonic() - told_all > 1 and not publisher.queued:
                    break
            upto = min(int((time.monotonic() - start) / period), turn + 1000)
            now = present()
            before = time.thread_time()
            for number in range(turn, upto):
                robot, round_ = number % asked.robots, number // asked.robots
                done = asked.changes and told >= asked.changes
                new = round_ == 0 or (not done and int(round_ * asked.events) != int((round_ - 1) * asked.events))
                changes[robot] += new
                publisher.publish(message(asked.first + robot, changes[robot], now.unix_us))
                told += new
                if new and not asked.quiet:
                    print(json.dumps({"robot": robot, "change": changes[robot]}), flush=True)
            publisher.service(now)
            spent += time.thread_time() - before
            turn = upto
            time.sleep(max(0.002, min(0.02, period)))
    except KeyboardInterrupt:
        pass
    seconds = time.monotonic() - start
    publisher.close()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    cost = {
        "told": told,
        "waiting": publisher.queued,
        "dropped": publisher.dropped,
        "seconds": round(seconds, 1),
        "cpu_percent": round(100 * (usage.ru_utime + usage.ru_stime) / seconds, 1),
        "loop_percent": round(100 * spent / seconds, 2),
        "memory_mb": round(usage.ru_maxrss / 1024, 1),
    }
    print(json.dumps(cost), flush=True)


if __name__ == "__main__":
    main()
