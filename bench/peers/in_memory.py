"""CPU time of a job that reads from memory, as JSON. Arguments: JOB FILE SIZE. Imports and times only that job.

Jobs: parse frames of a file of `workload.save`, in pieces of SIZE bytes (0: frame by frame); or read a log.
"""

from __future__ import annotations

import json
import os
import sys
import time
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

REPEAT: Final = 8  # passes over the frames


def parse_ours(pieces: list[bytes], _: str) -> Callable[[], int]:
    """Our parser with the messages of a status. It counts lost frames and checks the CRC of each known frame."""
    from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
    from mav_robot_status.mavlink.framing import Parser

    parser = Parser(WANTED_IDS)

    def run() -> int:
        feed = parser.feed
        for _ in range(REPEAT):
            for piece in pieces:
                feed(piece)
        counters = parser.counters
        assert counters.lost == 0 and not counters.bad_crc and not counters.unknown  # noqa: PT018
        return counters.frames

    return run


def parse_pymavlink(pieces: list[bytes], _: str) -> Callable[[], int]:
    """pymavlink's parser with the default dialect of mavutil."""
    from pymavlink.dialects.v20 import ardupilotmega

    mav = ardupilotmega.MAVLink(None)

    def run() -> int:
        parse = mav.parse_buffer
        return sum(len(parse(piece) or ()) for _ in range(REPEAT) for piece in pieces)

    return run


def replay_ours(_: list[bytes], path: str) -> Callable[[], int]:
    """Our replay without publishing."""
    import dataclasses
    import logging
    import re

    from mav_robot_status.config import Config
    from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER
    from mav_robot_status.gateway.replay import replay

    silent = dataclasses.replace(DEFAULT_CONTROLLER, parameters={"publish_rate": 0}, publishers=())
    output = StringIO()
    logging.basicConfig(level=logging.INFO, stream=output)

    def run() -> int:
        replay(Config(controllers=(silent,)), path, StringIO())
        found = re.search(r": (\d+) frames", output.getvalue())
        assert found is not None
        return int(found[1])

    return run


def replay_pymavlink(_: list[bytes], path: str) -> Callable[[], int]:
    """mavutil's log reader."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    log = mavutil.mavlink_connection(path, dialect="ardupilotmega")

    def run() -> int:
        frames = 0
        while True:
            message = log.recv_msg()
            if message is None:
                return frames
            frames += message.get_type() != "BAD_DATA"

    return run


def replay_typed(_: list[bytes], path: str) -> Callable[[], int]:
    """mavutil asked for the messages that a status needs. It builds an index of the log, then reads only these."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
    from mav_robot_status.mavlink.definitions import MESSAGES

    kinds = [MESSAGES[i].name for i in WANTED_IDS]

    def run() -> int:
        log = mavutil.mavlink_connection(path, dialect="ardupilotmega")
        while log.recv_match(type=kinds) is not None:
            pass
        return sum(log.counts.values())

    return run


JOBS: Final[dict[str, Callable[[list[bytes], str], Callable[[], int]]]] = {
    "parse-ours": parse_ours,
    "parse-pymavlink": parse_pymavlink,
    "replay-ours": replay_ours,
    "replay-pymavlink": replay_pymavlink,
    "replay-typed": replay_typed,
}


def pieces_of(path: str, size: int) -> list[bytes]:
    """The frames of a file, one by one or in pieces of `size` bytes."""
    data = Path(path).read_bytes()
    frames = []
    at = 0
    while at < len(data):
        end = at + 2 + int.from_bytes(data[at : at + 2], "little")
        frames.append(data[at + 2 : end])
        at = end
    stream = b"".join(frames)
    return [stream[i : i + size] for i in range(0, len(stream), size)] if size else frames


def main() -> None:
    """Do one job. Print the number of frames and the CPU time."""
    job, path, size = sys.argv[1], sys.argv[2], int(sys.argv[3])
    run: Any = JOBS[job](pieces_of(path, size) if job.startswith("parse") else [], path)
    start = time.process_time()
    frames = run()
    print(json.dumps({"frames": frames, "seconds": time.process_time() - start}))


if __name__ == "__main__":
    main()
