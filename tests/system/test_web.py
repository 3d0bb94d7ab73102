"""The web server of the installed command: what it serves, what it refuses, and what it costs."""

from __future__ import annotations

import json
import select
import socket
import statistics
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.extras import install

from ..deadline import SOON, allow, in_time, wait_until
from .gateway_process import Gateway, run
from .wire import Wire

PAGE = ("udpin:127.0.0.1:0", "--http", "127.0.0.1:0")
CLIENTS = 200
ROUNDS = 150
"""Changes for which the latency is measured."""


def url(gate: Gateway) -> str:
    return gate.wait_for_log(r"the page is at (http://\S+)/")[1]


def get(address: str, **headers: str) -> Any:
    asked = urllib.request.Request(address, headers=headers)
    with urllib.request.urlopen(asked, timeout=allow(SOON)) as answer:
        return json.loads(answer.read())


def events(gate: Gateway, ended: ExitStack, query: str = "") -> Iterator[tuple[str, Any]]:
    stream = ended.enter_context(urllib.request.urlopen(f"{url(gate)}/events{query}", timeout=allow(SOON)))
    name = ""
    for raw in stream:
        if raw.startswith(b"event: "):
            name = raw[7:].decode().strip()
        elif raw.startswith(b"data: "):
            yield name, json.loads(raw[6:])


def test_the_page_has_the_values_of_the_lines(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], validate: Callable[[Any], None]
) -> None:
    gate = gateway(*PAGE)
    assert get(f"{url(gate)}/api/v1/vehicles") == []
    rover = wire(gate.address)
    rover.beat(armed=True, custom_mode=10)
    shown = gate.wait_for(lambda s: s["drives_powered"] is True and s["seq"] > 3).status
    [vehicle] = get(f"{url(gate)}/api/v1/vehicles")
    validate(vehicle)
    moving = ("stamp", "seq", "link")
    assert {k: v for k, v in vehicle.items() if k not in moving} == {k: v for k, v in shown.items() if k not in moving}
    assert get(f"{url(gate)}/api/v1/vehicles/1")["handle"] == shown["handle"]
    assert get(f"{url(gate)}/readyz")["ready"] is True
    assert gate.stop() == 0
    assert not any("Traceback" in line for line in gate.log)


def test_an_arming_is_an_event_within_a_second(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], ended: ExitStack
) -> None:
    gate = gateway(*PAGE)
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    stream = events(gate, ended)
    assert next(stream)[0] == "board"
    armed = rover.beat(armed=True)
    next(1 for name, data in stream for line in data["vehicles"] if line["drives_powered"])
    assert in_time(time.monotonic() - armed, 1.0)


def test_a_viewer_of_a_vehicle_gets_its_explanation(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], ended: ExitStack
) -> None:
    gate = gateway(*PAGE)
    wire(gate.address).beating()
    handle = gate.wait_for(lambda s: s["drives_powered"] is False).status["handle"]
    stream = events(gate, ended, f"?handle={handle}")
    why = next(data for name, data in stream if name == "explanation")
    assert why["handle"] == handle
    assert why["fields"]["drives_powered"]["rule"] == "disarmed"
    assert why["fields"]["drives_powered"]["source"] == "HEARTBEAT.base_mode 65"
    again = next(data for name, data in stream if name == "explanation")
    assert again["stamp"] > why["stamp"]


def test_a_token_is_required_and_never_logged(gateway: Callable[..., Gateway], tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("correct-horse-battery")
    token.chmod(0o600)
    gate = gateway("udpin:127.0.0.1:0", "--http", "0.0.0.0:0", "--http-token-file", str(token))
    page = url(gate).replace("0.0.0.0", "127.0.0.1")
    with pytest.raises(urllib.error.HTTPError, match="401") as refused:
        get(f"{page}/api/v1/vehicles")
    refused.value.close()
    assert get(f"{page}/api/v1/vehicles", Authorization="Bearer correct-horse-battery") == []
    gate.stop()
    assert "correct-horse" not in "".join(gate.log)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ("--http", "0.0.0.0:8765"),
            "http: 0.0.0.0:8765: others on the network can see the data: add --http-token-file FILE",
        ),
        (("--http", "x"), "http: 'x' is not an address to listen on; write HOST:PORT, for example 127.0.0.1:8765"),
        (("--http-open",), "--http-open needs --http HOST:PORT: serve a live web page"),
        (("--http-token-file", "x"), "--http-token-file needs --http HOST:PORT: serve a live web page"),
        (
            ("--http", "127.0.0.1:0", "--http-token-file", "/nowhere/x"),
            "/nowhere/x: cannot read the token: No such file",
        ),
    ],
)
def test_wrong_options_are_one_line(arguments: tuple[str, ...], line: str) -> None:
    done = run("udpin:127.0.0.1:0", *arguments)
    assert done.returncode == 2
    assert line in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


def test_a_taken_port_is_an_error_that_names_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = run("udpin:127.0.0.1:0", "--http", f"127.0.0.1:{port}")
    assert done.returncode == 1
    assert f"http: cannot listen on 127.0.0.1:{port}/tcp: Address already in use" in done.stderr.splitlines()[-1]


def test_a_recorded_log_has_no_live_page(demo_log: Path) -> None:
    done = run(str(demo_log), "--http", "127.0.0.1:0")
    assert done.returncode == 2
    assert "a recorded log has no live page; write `mav-robot-status report" in done.stderr


def test_the_configuration_can_enable_the_page(gateway: Callable[..., Gateway], tmp_path: Path, demo_log: Path) -> None:
    path = tmp_path / "page.yaml"
    path.write_text(
        "links: ['udpin:127.0.0.1:0']\n"
        "robot_status_controller:\n"
        "  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  publishers: [json, {type: http, listen: '127.0.0.1:0', hosts: [robots.example]}]\n"
    )
    gate = gateway("--config", str(path))
    assert get(f"{url(gate)}/healthz", Host="robots.example")["ok"] is True
    assert run(str(demo_log), "--config", str(path)).returncode == 0  # a replay does without


# -- what it costs ---------------------------------------------------------------------------------------------------


class Crowd:
    """Many clients of the event stream; every second one never reads."""

    def __init__(self, page: str, count: int) -> None:
        host, _, port = page.removeprefix("http://").rpartition(":")
        self.sockets = []
        for _ in range(count):
            one = socket.create_connection((host, int(port)), allow(SOON))
            one.sendall(b"GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.sockets.append(one)
        self.bytes = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        for one in self.sockets:
            one.close()

    def _read(self) -> None:
        poll = select.poll()
        readers = {one.fileno(): one for one in self.sockets[::2]}
        for descriptor in readers:
            poll.register(descriptor, select.POLLIN)
        while not self._stop.is_set():
            for descriptor, _ in poll.poll(100):
                self.bytes += len(readers[descriptor].recv(1 << 16))


def latencies(gate: Gateway, rover: Wire) -> list[float]:
    """Milliseconds from a heartbeat that changes something to its line."""
    found = []
    for _ in range(ROUNDS):
        time.sleep(0.06)  # at most 20 changes a second are published
        gate.lines.clear()  # a long list takes long to look through
        mode = 0 if rover.custom_mode else 10  # not armed and disarmed in turn: two vehicles in one count do that
        sent = rover.beat(custom_mode=mode)
        line = gate.wait_for(partial(_is_in, mode), after=sent)
        found.append((line.at - sent) * 1000)
    return found


def _is_in(mode: int, status: dict[str, Any]) -> bool:
    return bool(status["vehicle"]["custom_mode"] == mode)


def p99(values: list[float]) -> float:
    return statistics.quantiles(values, n=100)[98]


@pytest.mark.slow
def test_two_hundred_clients_half_of_them_dead_cost_no_latency_and_no_memory(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], ended: ExitStack
) -> None:
    gate = gateway(*PAGE, "--rate", "10")
    rover = wire(gate.address)
    rover.beat(armed=False)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    alone = latencies(gate, rover)
    before = gate.memory()
    crowd = Crowd(url(gate), CLIENTS)
    ended.callback(crowd.close)
    wait_until(lambda: crowd.bytes > 100 * CLIENTS)
    crowded = latencies(gate, rover)
    grown = gate.memory() - before
    told = (
        f"latency alone p50 {statistics.median(alone):.2f} p99 {p99(alone):.2f} ms, with {CLIENTS} listeners "
        f"p50 {statistics.median(crowded):.2f} p99 {p99(crowded):.2f} ms; memory +{grown:.1f} MB"
    )
    print(told, file=sys.stderr)
    assert in_time(statistics.median(crowded) - statistics.median(alone), 5.0), told
    assert in_time(p99(crowded) - p99(alone), 20.0), told  # other programs run on this machine, too
    assert grown < 40, told
    assert gate.stop() == 0


def test_without_the_extra_the_option_is_a_usage_error() -> None:
    script = (
        "import sys; sys.modules['tornado'] = None\n"
        "from mav_robot_status.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "udpin:127.0.0.1:0", "--http", "127.0.0.1:0"],
        capture_output=True, text=True, timeout=allow(30),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].endswith(f"the web page needs an extra: {install('web')}")
