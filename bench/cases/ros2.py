"""One vehicle whose status goes to ROS 2 at 10 Hz, over Zenoh and over DDS, on the loopback interface."""

from __future__ import annotations

import importlib.util
import os
import sys
from contextlib import ExitStack

from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import Child, free_port
from ..results import OURS, Sample, Skip

SHARE, RESIDENT = "CPU, % of a core", "resident, MB"
FRAMES = 80  # a second
SECONDS, KNOWN = 8.0, 3.0
NOTHING = "nothing published"
NEEDS = {"Zenoh at 10 Hz": "zenoh", "DDS at 10 Hz": "cyclonedds"}
"""What is measured, and the module that it needs."""
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General></Domain></CycloneDDS>"
)
ROUTER = """
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    import signal
    signal.pause()
"""


def measure(bench: Bench) -> Found:
    """One round. The baseline is the same gateway without an output."""
    yield from _gateway(bench, NOTHING, "[]")
    for setup, module in NEEDS.items():
        if importlib.util.find_spec(module) is None:
            yield Skip(setup, OURS, f"{module} is not installed")
            continue
        with ExitStack() as ended:
            url = "dds://79"
            if module == "zenoh":
                router = free_port()
                ended.enter_context(Child([sys.executable, "-c", ROUTER, str(router)]))
                url = f"zenoh://127.0.0.1:{router}"
            yield from _gateway(bench, setup, f'[{{type: ros2, url: "{url}", rate: 10}}]')


def _gateway(bench: Bench, setup: str, publishers: str) -> Found:
    config = bench.place / "ros2.yaml"
    config.write_text(
        "robot_status_controller:\n  type: mav_robot_status/IndustrialRobotStatusController\n"
        f"  publishers: {publishers}\n"
    )
    port = free_port()
    command = bench.contenders.ours(f"udpin:127.0.0.1:{port}", "--passive", "--config", str(config))
    env = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
    with Child(command, env=env) as child, Feed(bench.frames(), port) as feed:
        child.listens(port)
        feed.warm_up(FRAMES, 1.0 if bench.quick else KNOWN)
        fed = feed.measure(child, FRAMES, bench.lasting(SECONDS))
        yield Sample(setup, SHARE, OURS, fed.share, fed.note)
        yield Sample(setup, RESIDENT, OURS, child.memory())


CASE = Case("ros2", "ROS 2: one vehicle, 80 frames/s", measure)
