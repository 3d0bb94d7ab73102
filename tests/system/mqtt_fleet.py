"""The cost of many robots: starts mosquitto, gateways without vehicles and a board, and measures them.

    python -m tests.system.mqtt_fleet --robots 2000 --seconds 60
    python -m tests.system.mqtt_fleet --robots 1000 --brokers 2 --consumers 3

With `--brokers` the gateways publish to that many mosquittos. Each has a bridge to a central one, which the board
reads. With `--consumers` that many clients share one subscription to the events there. Prints one JSON object: the
processor time and memory of each part, and the lost and repeated events.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from typing import Any

from paho.mqtt.client import Client, MQTTMessage, MQTTv5
from paho.mqtt.enums import CallbackAPIVersion

from ..deadline import SOON, allow, wait_until
from ..ports import free_port
from .gateway_process import Gateway
from .mqtt_broker import PREFIX, Broker

FOREVER = 1e6  # s: the gateways run until they are terminated
CONNECTED = 60.0  # s on an idle machine until every robot is on the board


def bridge(name: str, central: str) -> list[str]:
    """The configuration of a site's bridge to the central mosquitto at `central`; docs/how-to/fleet.md shows it."""
    return [
        f"connection {name}",
        f"address {central}",
        f"remote_clientid {name}",
        "bridge_protocol_version mqttv50",
        f"topic {PREFIX}/# out 1",
        "cleansession false",
        "keepalive_interval 10",
        "restart_timeout 1 30",
    ]


class Consumer:
    """One of several clients that share the events: remembers robot and `id` of each event that it receives."""

    def __init__(self, number: int, port: int, group: str = "history") -> None:
        self.ids: list[tuple[str, str]] = []
        self._client = Client(CallbackAPIVersion.VERSION2, f"{group}-{number}", protocol=MQTTv5)
        self._client.on_message = self._take
        subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.connect("127.0.0.1", port, 10)
        self._client.subscribe(f"$share/{group}/{PREFIX}/+/events", 1)
        self._client.loop_start()
        assert subscribed.wait(allow(SOON))

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def _take(self, client: Any, data: Any, message: MQTTMessage) -> None:
        event = json.loads(message.payload)
        self.ids.append((event["robot"], event["id"]))


def cpu(pid: int) -> float:
    """Seconds of processor time used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def memory(pid: int) -> float:
    """Resident memory in MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1024


def vehicles(port: int) -> list[dict[str, Any]]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/vehicles", timeout=allow(10)) as answer:
        found: list[dict[str, Any]] = json.load(answer)
        return found


def live(port: int) -> list[dict[str, Any]]:
    """The vehicles on the board whose link is CONNECTED."""
    return [line for line in vehicles(port) if line["link"]["state"] == "CONNECTED"]


def feeder(url: str, spool: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.system.mqtt_feeder", url, "--option", f"spool={spool}", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def measure(
    robots: int, gateways: int, seconds: float, folder: Path, brokers: int = 0, consumers: int = 0
) -> dict[str, Any]:
    share, http = robots // gateways, free_port()
    with contextlib.ExitStack() as ended:
        central = ended.enter_context(contextlib.closing(Broker(folder)))
        sites = {
            name: ended.enter_context(
                contextlib.closing(Broker(folder / name, *bridge(name, f"127.0.0.1:{central.port}")))
            )
            for name in (f"site-{n}" for n in range(brokers))
        }
        readers = [ended.enter_context(contextlib.closing(Consumer(n, central.port))) for n in range(consumers)]
        board = Gateway("board", central.url, "--http", f"127.0.0.1:{http}")
        ended.callback(board.close)
        board.wait_for_log(r"reading .*/\+")
        near = list(sites.values()) or [central]
        feeders = [
            feeder(
                *(near[n % len(near)].url, folder / f"{n}.sqlite", "--quiet"),
                *("--robots", str(share), "--first", str(n * share), "--seconds", str(FOREVER)),
            )
            for n in range(gateways)
        ]
        for process in feeders:
            ended.callback(process.kill)
        wait_until(lambda: len(live(http)) == share * gateways, CONNECTED, "not every robot is on the board")
        started = {"board": board.process, "central": central.process} | {n: b.process for n, b in sites.items()}
        parts = {name: process.pid for name, process in started.items() if process is not None}
        before, start, ours = {name: cpu(pid) for name, pid in parts.items()}, time.monotonic(), time.process_time()
        time.sleep(seconds)  # the measurement
        passed, ours = time.monotonic() - start, time.process_time() - ours  # here only the consumers do anything
        used = {
            name: {
                "cpu_percent": round(100 * (cpu(pid) - before[name]) / passed, 1),
                "memory_mb": round(memory(pid), 1),
            }
            for name, pid in parts.items()
        }
        connected = len(live(http))
        for process in feeders:
            process.terminate()
        costs = [json.loads(process.communicate()[0].splitlines()[-1]) for process in feeders]
        wait_until(lambda: not live(http), CONNECTED, "a robot's last message, OFFLINE, has not arrived")
        board.stop()
        counted = re.search(r"(\d+) events, (\d+) duplicates, (\d+) missing", board.log[-1])
        assert counted is not None, board.log
    told = sum(cost["told"] for cost in costs)
    return {
        "robots": share * gateways,
        "live_on_the_board": connected,
        "board_cpu_percent": used["board"]["cpu_percent"],
        "board_memory_mb": used["board"]["memory_mb"],
        "brokers": {name: cost for name, cost in used.items() if name != "board"},
        "events_told": told,
        "events_on_the_board": int(counted[1]),
        "events_again": int(counted[2]),
        "events_missing": int(counted[3]),
        "consumers": _shared(readers, told, 100 * ours / passed),
        "gateways": costs,
    }


def _shared(readers: list[Consumer], told: int, percent: float) -> dict[str, Any]:
    """The events of each consumer."""
    ids = [ident for reader in readers for ident in reader.ids]
    return {
        "events": [len(reader.ids) for reader in readers],
        "again": len(ids) - len(set(ids)),
        "missing": told - len(set(ids)) if readers else 0,
        "cpu_percent": round(percent, 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-r", "--robots", type=int, default=2000)
    parser.add_argument("-g", "--gateways", type=int, default=4, help="processes that the robots are shared among")
    parser.add_argument("-b", "--brokers", type=int, default=0, help="mosquittos with a bridge to the central one")
    parser.add_argument("-c", "--consumers", type=int, default=0, help="that share one subscription to the events")
    parser.add_argument("-s", "--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        numbers = (asked.robots, asked.gateways, asked.seconds, Path(folder), asked.brokers, asked.consumers)
        print(json.dumps(measure(*numbers), indent=1))


if __name__ == "__main__":
    main()
