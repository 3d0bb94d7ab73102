"""A fleet that has outgrown one broker: bridged mosquittos, and consumers that share the work."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .mqtt_broker import MISSING, Broker, Listener
from .mqtt_fleet import bridge, feeder, measure

pytestmark = pytest.mark.skipif(MISSING is not None, reason=str(MISSING))

ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / "docs" / "fleet.md"
MEASURES = [
    line.split()[1:]
    for name in ("mqtt.md", "fleet.md")
    for line in (ROOT / "docs" / name).read_text().splitlines()
    if line.startswith(".venv/bin/python -m tests.system.mqtt_fleet")
]


def test_every_event_of_two_bridged_sites_is_got_by_exactly_one_of_three_consumers(tmp_path: Path) -> None:
    found = measure(40, 2, 4.0, tmp_path, brokers=2, consumers=3)
    assert (found["robots"], found["live_on_the_board"]) == (40, 40)
    assert set(found["brokers"]) == {"central", "site-0", "site-1"}
    assert found["events_told"] >= 40
    assert (found["events_on_the_board"], found["events_missing"]) == (found["events_told"], 0)
    shared = found["consumers"]
    assert (sum(shared["events"]), shared["again"], shared["missing"]) == (found["events_told"], 0, 0)
    assert min(shared["events"]) > 0


@pytest.mark.parametrize("command", MEASURES, ids=" ".join)
def test_the_commands_that_measure_do(command: list[str]) -> None:
    small = ("-r", "8", "-g", "2", "-s", "1")  # the last of an option counts
    done = subprocess.run([sys.executable, *command, *small], cwd=ROOT, capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["robots"], found["live_on_the_board"], found["events_missing"]) == (8, 8, 0)


def test_the_measures_were_found() -> None:
    assert len(MEASURES) == 3


def test_the_bridge_that_is_documented_is_the_one_that_runs_here() -> None:
    assert "\n".join(bridge("site-a", "central.example:1883")) in DOCUMENT.read_text()


def test_a_site_that_was_cut_off_brings_its_events_and_its_wills_later(
    ended: contextlib.ExitStack, tmp_path: Path
) -> None:
    central = ended.enter_context(contextlib.closing(Broker(tmp_path, memory=True)))
    site = ended.enter_context(
        contextlib.closing(Broker(tmp_path / "site", *bridge("site-a", f"127.0.0.1:{central.port}")))
    )
    gateway = feeder(site.url, tmp_path / "spool.sqlite", "--quiet", "--rate", "20", "--events", "1", "--seconds", "60")
    ended.callback(_end, gateway)
    heard = ended.enter_context(contextlib.closing(Listener(central.port)))
    heard.wait(lambda: len(heard.of("events")) > 20)
    central.stop()
    time.sleep(2)
    gateway.kill()  # at the site the will is said at once
    time.sleep(1)
    central.start()
    heard.wait_for(lambda h: h.what == "connection" and h.text == "CONNECTIONBROKEN", 20)
    # more than 20 came before, 40 or so are of the two seconds without a central broker
    heard.wait(lambda: len(seqs := _seqs(heard)) > 55 and seqs == set(range(1, max(seqs) + 1)))


def test_the_central_broker_knows_that_a_site_is_gone_and_its_statuses_expire(
    ended: contextlib.ExitStack, tmp_path: Path
) -> None:
    central = ended.enter_context(contextlib.closing(Broker(tmp_path)))
    site = ended.enter_context(
        contextlib.closing(Broker(tmp_path / "site", *bridge("site-a", f"127.0.0.1:{central.port}")))
    )
    gateway = feeder(site.url, tmp_path / "s.sqlite", "--quiet", "--option", "keepalive=2", "--seconds", "60")
    ended.callback(_end, gateway)
    with contextlib.closing(Listener(central.port)) as heard:
        heard.wait_for(lambda h: h.what == "status" and h.text != "")
        heard.wait_for(lambda h: h.text == "ONLINE")
        site.stop(kill=True)  # nobody says the robot's will, only the bridge's
        gateway.kill()
        time.sleep(6)  # the keep-alive one and a half times, and what mosquitto takes to look for what has expired
    with contextlib.closing(Listener(central.port)) as late:
        late.wait_for(lambda h: h.what == "connection" and h.text == "ONLINE")
        time.sleep(0.3)
        assert [h.what for h in late.heard] == ["connection"]
    with contextlib.closing(Listener(central.port, prefix="$SYS/broker/connection")) as late:
        late.wait_for(lambda h: (h.robot, h.what, h.text) == ("site-a", "state", "0"))


def _seqs(heard: Listener) -> set[int]:
    return {json.loads(h.text)["seq"] for h in heard.of("events")}


def _end(gateway: subprocess.Popen[str]) -> None:
    gateway.kill()
    gateway.communicate()
