"""What many robots on one broker cost: starts mosquitto, gateways without vehicles and a board, and measures.

    python -m tests.system.mqtt_fleet --robots 2000 --seconds 60

Prints one JSON object: what each gateway and the board used, and whether an event was lost.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

from .gateway_process import Gateway
from .mqtt_broker import Broker, free_port

SETTLE = 5.0  # s after which everybody is connected and measuring begins


def cpu(pid: int) -> float:
    """Seconds of processor time used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def vehicles(port: int) -> list[dict[str, Any]]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/vehicles", timeout=10) as answer:
        found: list[dict[str, Any]] = json.load(answer)
        return found


def feeder(url: str, spool: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.system.mqtt_feeder", url, "--option", f"spool={spool}", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def measure(robots: int, gateways: int, seconds: float, folder: Path) -> dict[str, Any]:
    share, http = robots // gateways, free_port()
    with contextlib.ExitStack() as ended:
        broker = ended.enter_context(contextlib.closing(Broker(folder)))
        board = Gateway("board", broker.url, "--http", f"127.0.0.1:{http}")
        ended.callback(board.close)
        board.wait_for_log(r"reading .*/\+")
        feeders = [
            feeder(
                *(broker.url, folder / f"{n}.sqlite", "--quiet", "--robots", str(share), "--first", str(n * share)),
                *("--seconds", str(seconds + SETTLE + 2)),
            )
            for n in range(gateways)
        ]
        for process in feeders:
            ended.callback(process.kill)
        time.sleep(SETTLE)
        assert broker.process is not None
        used, of_broker, start = board.cpu(), cpu(broker.process.pid), time.monotonic()
        time.sleep(seconds)
        passed = time.monotonic() - start
        used, of_broker = board.cpu() - used, cpu(broker.process.pid) - of_broker
        live = [line for line in vehicles(http) if line["link"]["state"] == "CONNECTED"]
        memory = board.memory()
        costs = [json.loads(process.communicate()[0].splitlines()[-1]) for process in feeders]
        time.sleep(1)
        board.stop()
        counted = re.search(r"(\d+) events, (\d+) again, (\d+) missing", board.log[-1])
        assert counted is not None, board.log
    return {
        "robots": share * gateways,
        "live_on_the_board": len(live),
        "board_cpu_percent": round(100 * used / passed, 1),
        "board_memory_mb": round(memory, 1),
        "broker_cpu_percent": round(100 * of_broker / passed, 1),
        "events_told": sum(cost["told"] for cost in costs),
        "events_on_the_board": int(counted[1]),
        "events_again": int(counted[2]),
        "events_missing": int(counted[3]),
        "gateways": costs,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=2000)
    parser.add_argument("--gateways", type=int, default=4, help="processes that the robots are shared among")
    parser.add_argument("--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(asked.robots, asked.gateways, asked.seconds, Path(folder)), indent=1))


if __name__ == "__main__":
    main()
