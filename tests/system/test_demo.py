"""`demo` through the installed command: the live table, JSON lines, a sample autopilot for others, a fleet."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import socket
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mav_robot_status.testing import BY_NAME, decode
from mav_robot_status.testing.scenario import Action, ending

from ..deadline import Deadline, wait_until
from ..ports import free_port
from .gateway_process import Gateway, run
from .screen import Screen


@pytest.fixture
def demo(ended: contextlib.ExitStack) -> Callable[..., Screen]:
    """Start `demo` on a terminal."""
    return lambda *arguments, **options: ended.enter_context(contextlib.closing(Screen("demo", *arguments, **options)))


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    """Another program that listens."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        udp.settimeout(0.1)
        yield udp


def heard(listener: socket.socket, enough: Callable[[set[int]], bool]) -> set[int]:
    """The system ids of the autopilots that are heard, until they are enough."""
    found: set[int] = set()
    deadline = Deadline()
    while not enough(found):
        assert deadline.left, f"heard only {found}"
        with contextlib.suppress(TimeoutError):
            messages = decode(listener.recv(2000))
            found |= {m.get_srcSystem() for m in messages if m.get_type() == "HEARTBEAT" and m.autopilot != 8}
    return found


def test_a_terminal_shows_the_live_table_and_the_story(demo: Callable[..., Screen]) -> None:
    screen = demo()
    screen.wait_for_text("power on: the autopilot initialises")
    screen.wait_for_text("⊘ CANNOT ARM     1.1 ")
    screen.wait_for_text("“PreArm: GPS 1: Bad fix”")
    assert screen.text[0].startswith("demo  1 robot")
    assert "Ctrl-C: quit" in screen.text[-1]
    assert '{"stamp"' not in "".join(screen.text)
    screen.type("\x03")
    assert screen.wait_for_end() == 0
    assert screen.attributes() == screen.before
    assert b"Traceback" not in screen.raw


def test_with_json_a_terminal_gets_lines(demo: Callable[..., Screen]) -> None:
    screen = demo("--json", columns=120)
    screen.wait_for_text('{"stamp": "20')
    screen.process.send_signal(signal.SIGTERM)
    assert screen.wait_for_end() == 0


def test_a_small_ascii_terminal_shows_the_fleet(demo: Callable[..., Screen]) -> None:
    screen = demo("--vehicles", "3", columns=40, lines=10, LC_ALL="C")
    screen.wait_for(lambda lines: "3 robots" in lines[0], "three robots")
    assert screen.raw.isascii()
    assert all(len(line) <= 40 for line in screen.text)
    screen.process.send_signal(signal.SIGTERM)
    assert screen.wait_for_end() == 0


@pytest.mark.slow
def test_out_is_a_sample_autopilot_for_the_other_commands(gateway: Callable[..., Gateway]) -> None:
    url = f"udp:127.0.0.1:{free_port()}"
    demo = gateway("demo", "--out", url)
    demo.wait_for_lines(1)
    other = gateway(url)
    # it answers what the other one asks, as an autopilot does
    line = other.wait_for(lambda line: line["vehicle"].get("firmware") == "4.5.6", what="an answer")
    assert line.status["handle"] == "industrial_robot_status_handle"
    assert other.stop() == 0
    explained = json.loads(run("explain", url, "--as-json").stdout.splitlines()[0])
    assert explained["vehicle"]["type"] == "GROUND_ROVER"
    assert demo.stop(signal.SIGINT) == 0


def test_a_fleet_has_several_types_and_problems(gateway: Callable[..., Gateway], listener: socket.socket) -> None:
    demo = gateway("demo", "--vehicles", "16", "--out", f"udpout:127.0.0.1:{listener.getsockname()[1]}")
    assert heard(listener, lambda found: len(found) == 16) == set(range(1, 17))

    def known() -> dict[int, dict[str, Any]] | None:
        found = {line.status["system"]: line.status for line in list(demo.lines)}
        return found if len(found) == 16 else None

    statuses = wait_until(known)
    assert len({status["vehicle"]["type"] for status in statuses.values()}) >= 5
    demo.wait_for(lambda line: line["e_stopped"] is True, what="an emergency stop")
    demo.wait_for(lambda line: line["in_error"] is True, what="an error")
    assert demo.stop() == 0


def test_http_serves_the_page_and_needs_no_address(gateway: Callable[..., Gateway]) -> None:
    demo = gateway("demo", "--http", f"127.0.0.1:{free_port()}")
    url = demo.wait_for_log(r"the page is at (http://\S+)")[1]
    with urllib.request.urlopen(url, timeout=10) as page:
        assert page.status == 200
    assert demo.stop() == 0
    assert re.search(r"--http \[HOST:PORT\]", run("demo", "--help").stdout)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--vehicles", "255"), "'255' is not a number of vehicles; write 1 to 254"),
        (("--vehicles", "0"), "'0' is not a number of vehicles; write 1 to 254"),
        (("--out", "tcp:127.0.0.1:5760"), "the demo sends on UDP; write --out udp:127.0.0.1:14550"),
        (("--out", "/dev/ttyACM0"), "the demo sends on UDP; write --out udp:127.0.0.1:14550"),
        (("--vehicles", "3", "--mobile-manipulator"), "--vehicles and --mobile-manipulator are two demos"),
    ],
)
def test_what_cannot_be_is_one_line(arguments: tuple[str, ...], told: str) -> None:
    done = run("demo", *arguments)
    assert done.returncode == 2
    assert told in done.stderr
    assert "Traceback" not in done.stderr


def test_every_scenario_can_be_played_in_a_loop() -> None:
    for scenario in map(ending, BY_NAME.values()):
        assert not scenario.steps or any(step.action is Action.END for step in scenario.steps)
