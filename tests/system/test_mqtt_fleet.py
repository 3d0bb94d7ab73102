"""A fleet with several brokers: bridged mosquittos, and consumers that share a subscription."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from ..deadline import Deadline, allow
from .mqtt_broker import MISSING, Broker, Listener
from .mqtt_fleet import bridge, feeder, measure

pytestmark = pytest.mark.skipif(MISSING is not None, reason=str(MISSING))

ENDLESS = ("--seconds", "1e6")
ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / "docs" / "how-to" / "fleet.md"
MEASURES = [
    line.split()[1:]
    for name in ("mqtt.md", "fleet.md")
    for line in (ROOT / "docs" / "how-to" / name).read_text().splitlines()
    if line.startswith(".venv/bin/python -m tests.system.mqtt_fleet")
]


@pytest.mark.slow
def test_every_event_of_two_bridged_sites_reaches_exactly_one_of_three_consumers(tmp_path: Path) -> None:
    found = measure(40, 2, 2.0, tmp_path, brokers=2, consumers=3)
    assert (found["robots"], found["live_on_the_board"]) == (40, 40)
    assert set(found["brokers"]) == {"central", "site-0", "site-1"}
    assert found["events_told"] >= 40
    assert (found["events_on_the_board"], found["events_missing"]) == (found["events_told"], 0)
    shared = found["consumers"]
    assert (sum(shared["events"]), shared["again"], shared["missing"]) == (found["events_told"], 0, 0)
    assert min(shared["events"]) > 0


@pytest.mark.slow
@pytest.mark.parametrize("command", MEASURES, ids=" ".join)
def test_the_documented_measurements_run(command: list[str]) -> None:
    small = ("-r", "8", "-g", "2", "-s", "1")  # the last value of an option counts
    done = subprocess.run([sys.executable, *command, *small], cwd=ROOT, capture_output=True, timeout=allow(60))
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["robots"], found["live_on_the_board"], found["events_missing"]) == (8, 8, 0)


def test_the_documents_have_three_measurements() -> None:
    assert len(MEASURES) == 3


def test_the_documented_bridge_is_the_tested_one() -> None:
    assert "\n".join(bridge("site-a", "central.example:1883")) in DOCUMENT.read_text()


def test_a_disconnected_site_delivers_its_events_and_wills_later(ended: contextlib.ExitStack, tmp_path: Path) -> None:
    central = ended.enter_context(contextlib.closing(Broker(tmp_path, memory=True)))
    site = ended.enter_context(
        contextlib.closing(Broker(tmp_path / "site", *bridge("site-a", f"127.0.0.1:{central.port}")))
    )
    gateway = feeder(site.url, tmp_path / "spool.sqlite", "--quiet", "--rate", "20", "--events", "1", *ENDLESS)
    ended.callback(_end, gateway)
    heard = ended.enter_context(contextlib.closing(Listener(central.port)))
    heard.wait(lambda: len(heard.of("events")) > 20)
    near = ended.enter_context(contextlib.closing(Listener(site.port)))
    central.stop()
    stopped = max(_seqs(heard))
    near.wait(lambda: max(_seqs(near), default=0) > stopped + 40)
    gateway.kill()
    near.wait_for(lambda h: h.text == "CONNECTIONBROKEN")
    last = max(_seqs(near))
    central.start()
    heard.wait_for(lambda h: h.what == "connection" and h.text == "CONNECTIONBROKEN", 20)
    heard.wait(lambda: _seqs(heard) == set(range(1, last + 1)))


def test_the_central_broker_knows_that_a_site_is_gone_and_its_statuses_expire(
    ended: contextlib.ExitStack, tmp_path: Path
) -> None:
    central = ended.enter_context(contextlib.closing(Broker(tmp_path)))
    site = ended.enter_context(
        contextlib.closing(Broker(tmp_path / "site", *bridge("site-a", f"127.0.0.1:{central.port}")))
    )
    gateway = feeder(site.url, tmp_path / "s.sqlite", "--quiet", "--option", "keepalive=2", *ENDLESS)
    ended.callback(_end, gateway)
    deadline = Deadline(20)
    with contextlib.closing(Listener(central.port)) as heard:
        heard.wait_for(lambda h: h.what == "status" and h.text != "")
        heard.wait_for(lambda h: h.text == "ONLINE")
        site.stop(kill=True)  # the robot's will is not published, only the bridge's
        gateway.kill()
    while _retained(central.port) != [("connection", "ONLINE")]:  # until the status expires
        assert deadline.left
    with contextlib.closing(Listener(central.port, prefix="$SYS/broker/connection")) as late:
        late.wait_for(lambda h: (h.robot, h.what, h.text) == ("site-a", "state", "0"))


def _retained(port: int) -> list[tuple[str, str]]:
    with contextlib.closing(Listener(port)) as late:
        late.settle()
        return [(h.what, h.text) for h in late.heard if h.retained]


def _seqs(heard: Listener) -> set[int]:
    return {json.loads(h.text)["seq"] for h in heard.of("events")}


def _end(gateway: subprocess.Popen[str]) -> None:
    gateway.kill()
    gateway.communicate()
