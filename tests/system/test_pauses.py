"""The gateway does not run for a while (SIGSTOP, as a paused virtual machine or a suspended system): what arrived
meanwhile is old, and never passes for the present state of the vehicle."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from ..deadline import wait_until
from .gateway_process import Gateway, Line

BEAT = 0.25  # s
Send = Callable[[bytes], Any]


class Rover:
    """The heartbeats of a rover, every quarter of a second from a thread."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._mav = MAVLink(None, srcSystem=1, srcComponent=1)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._beating = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.armed = False
        self._thread.start()

    def beat(self) -> None:
        with self._lock, contextlib.suppress(OSError):
            self._send(MAVLink_heartbeat_message(10, 3, 65 | (128 if self.armed else 0), 0, 4, 3).pack(self._mav))

    def arm_in_silence(self) -> None:
        """It is armed from now on, and no heartbeat tells it until `speak`."""
        self._beating = False
        with self._lock:  # the last heartbeat is sent
            self.armed = True

    def speak(self) -> None:
        self._beating = True

    def close(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(BEAT):
            if self._beating:
                self.beat()


@contextlib.contextmanager
def over_udp(gateway: Callable[..., Gateway]) -> Iterator[tuple[Gateway, Send]]:
    gate = gateway("udpin:127.0.0.1:0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(gate.address)
        yield gate, out.send


@contextlib.contextmanager
def over_tcp(gateway: Callable[..., Gateway]) -> Iterator[tuple[Gateway, Send]]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        gate = gateway(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        server.settimeout(60)
        peer, _ = server.accept()
        with peer:
            yield gate, peer.send


@contextlib.contextmanager
def over_a_serial_device(gateway: Callable[..., Gateway]) -> Iterator[tuple[Gateway, Send]]:
    master, device = os.openpty()
    tty.setraw(device)
    try:
        yield gateway(f"serial://{os.ttyname(device)}:115200"), lambda data: os.write(master, data)
    finally:
        os.close(master)
        os.close(device)


LINKS = {"udp": over_udp, "tcp": over_tcp, "serial": over_a_serial_device}


def is_safe(line: Line) -> bool:
    """Whether the line says that the vehicle cannot move."""
    status = line.status
    return status["drives_powered"] is False or status["motion_possible"] is False or status["e_stopped"] is True


def connected(armed: bool) -> Callable[[dict[str, Any]], bool]:
    return lambda status: status["link"]["state"] == "CONNECTED" and status["drives_powered"] is armed


def stopped(gate: Gateway) -> None:
    gate.process.send_signal(signal.SIGSTOP)
    wait_until(lambda: gate.state() == "T")


def wait_a_while(seconds: float) -> None:
    """The length of the pause is the subject of the test."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        time.sleep(left)


@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize("seconds", [5.0, pytest.param(20.0, marks=pytest.mark.slow)])
def test_heartbeats_from_a_pause_do_not_say_that_the_vehicle_is_disarmed_now(
    gateway: Callable[..., Gateway], link: str, seconds: float
) -> None:
    with LINKS[link](gateway) as (gate, send), contextlib.closing(Rover(send)) as rover:
        gate.wait_for(connected(armed=False))
        stopped(gate)
        wait_a_while(2 * BEAT)  # these heartbeats wait in the kernel
        rover.arm_in_silence()
        wait_a_while(seconds)
        continued = time.time()
        gate.process.send_signal(signal.SIGCONT)
        gate.wait_for(lambda s: s["link"]["state"] == "LOST", what="the loss")
        gate.wait_for_lines(10, after=gate.lines[-1].at)
        rover.speak()
        back = gate.wait_for(connected(armed=True), what="the return")
        after = [line for line in gate.lines if line.stamp > continued]
        assert back in after
        assert not [line.status for line in after if is_safe(line)]
        assert gate.stop() == 0
        assert sum("lost vehicle 1.1" in line for line in gate.log) == 1
        assert sum("vehicle 1.1 is back" in line for line in gate.log) == 1


@pytest.mark.parametrize("link", LINKS)
def test_a_vehicle_that_is_armed_during_a_pause_is_never_called_safe_after_it(
    gateway: Callable[..., Gateway], link: str
) -> None:
    with LINKS[link](gateway) as (gate, send), contextlib.closing(Rover(send)) as rover:
        gate.wait_for(connected(armed=False))
        stopped(gate)
        wait_a_while(1.0)
        rover.armed = True
        wait_a_while(5.0)
        continued = time.time()
        gate.process.send_signal(signal.SIGCONT)
        gate.wait_for(connected(armed=True), what="the armed vehicle")
        gate.wait_for_lines(5, after=gate.lines[-1].at)
        after = [line for line in gate.lines if line.stamp > continued]
        assert after
        assert not [line.status for line in after if is_safe(line)]


def test_a_heartbeat_from_a_pause_has_its_true_age(gateway: Callable[..., Gateway]) -> None:
    with over_udp(gateway) as (gate, send), contextlib.closing(Rover(send)) as rover:
        gate.wait_for(connected(armed=False))
        stopped(gate)
        rover.arm_in_silence()
        rover.beat()
        sent = time.time()
        wait_a_while(2.0)
        gate.process.send_signal(signal.SIGCONT)
        line = gate.wait_for(connected(armed=True), what="the heartbeat")
        assert abs(line.stamp - sent - line.status["link"]["heartbeat_age"]) < 0.2
        assert line.status["link"]["heartbeat_age"] > 1.7
