"""The filter in the kernel, through the installed command: what no status needs does not wake the process."""

from __future__ import annotations

import re
import signal
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

from mav_robot_status.mavlink.encode import enclose

from ..deadline import wait_until
from .gateway_process import Gateway, run
from .wire import Wire

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]

RAW_IMU = 27
FILTERS = "filters in the kernel what no status needs"
UNNEEDED = [enclose(RAW_IMU, b"raw imu", system=1, component=1, sequence=number) for number in range(256)]
COUNT = 1000


def chatter(rover: Wire, count: int = COUNT) -> None:
    """Frames that no status needs, one every 2 ms or so: each would wake a process that waits."""
    assert rover.to is not None
    for number in range(count):
        rover.socket.sendto(UNNEEDED[number & 255], rover.to)
        time.sleep(0.002)


def wake_ups(gate: Gateway) -> int:
    """How often the process has waited so far."""
    status = Path(f"/proc/{gate.process.pid}/status").read_text(encoding="ascii")
    return int(re.findall(r"^voluntary_ctxt_switches:\s+(\d+)", status, re.MULTILINE)[0])


def frames_read(gate: Gateway) -> int:
    """The frames in the last line about the link."""
    assert gate.stop() == 0
    return int(gate.wait_for_log(r"/udp: (\d+) frames, ")[1])


def configured(path: Path, text: str) -> str:
    file = path / "gateway.yaml"
    file.write_text(text, encoding="ascii")
    return str(file)


def test_unneeded_frames_do_not_wake_the_process(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    rover = wire(gate.address).beating()
    gate.wait_for_log(FILTERS)
    since, before = time.monotonic(), wake_ups(gate)
    rover.wait_for("HEARTBEAT", after=since + 2)
    quiet = (wake_ups(gate) - before) / (time.monotonic() - since)
    since, before = time.monotonic(), wake_ups(gate)
    chatter(rover)
    extra = wake_ups(gate) - before - quiet * (time.monotonic() - since)
    assert extra < COUNT / 4
    assert frames_read(gate) < COUNT / 4
    assert any("lost ones not counted" in line for line in gate.log)


def test_with_the_option_every_frame_is_read_and_lost_ones_are_counted(
    gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none", "--config", configured(tmp_path, "kernel_filter: false\n"))
    rover = wire(gate.address).beating()
    rover.wait_for("HEARTBEAT", count=3)
    chatter(rover, 300)
    assert frames_read(gate) >= 300
    assert not any(FILTERS in line for line in gate.log)
    assert gate.wait_for_log(r"frames, \d+ lost, ")


def test_a_reload_for_a_recording_takes_it_off_and_the_next_puts_it_on(
    gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    recording = tmp_path / "all.tlog"
    file = configured(tmp_path, "")
    gate = gateway("udpin:127.0.0.1:0", "--json", "none", "--config", file)
    rover = wire(gate.address).beating()
    gate.wait_for_log(FILTERS)
    configured(tmp_path, f"record: {recording}\n")
    gate.process.send_signal(signal.SIGHUP)
    gate.wait_for_log("no longer filters in the kernel")
    chatter(rover, 100)
    wait_until(lambda: recording.read_bytes().count(b"raw imu") == 100)
    configured(tmp_path, "")
    gate.process.send_signal(signal.SIGHUP)
    wait_until(lambda: sum(FILTERS in line for line in gate.log) == 2)


@pytest.mark.parametrize("written", ["auto", "true"])
def test_metrics_count_lost_frames_or_say_nothing_of_them(
    written: str, gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    file = configured(tmp_path, f"kernel_filter: {written}\n")
    gate = gateway("udpin:127.0.0.1:0", "--json", "none", "--http", "127.0.0.1:0", "--config", file)
    page = gate.wait_for_log(r"the page is at (\S+)")[1]
    rover = wire(gate.address).beating()
    if written == "true":
        gate.wait_for_log(FILTERS)
    else:
        rover.wait_for("HEARTBEAT", count=3)
    with urllib.request.urlopen(f"{page}metrics") as answer:
        text = answer.read().decode()
    assert "connection_frames_total{" in text
    assert ("connection_lost_frames_total{" in text) is (written == "auto")
    assert ("connection_dropped_total{" in text) is (written == "auto")


def test_check_config_says_whether_it_filters(tmp_path: Path) -> None:
    done = run("check-config", configured(tmp_path, "links: [udp:127.0.0.1:14550]\nforward: true\n"))
    assert "kernel_filter: off, forward needs every frame\n" in done.stdout
    done = run("check-config", configured(tmp_path, "links: [udp:127.0.0.1:14550]\n"))
    assert "kernel_filter: on UDP, " in done.stdout
