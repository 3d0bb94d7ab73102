import fcntl
import grp
import logging
import math
import os
import subprocess
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.errors import LinkError
from mav_robot_status.links import serial
from mav_robot_status.links.serial import RETRY, SerialLink
from mav_robot_status.links.stream import STABLE_AFTER
from mav_robot_status.links.url import parse
from mav_robot_status.testing.conformance.links import LinkDriver, readable

from .peers import Terminal

OTHER_RATE = 0o010000  # BOTHER, which Python does not name

Open = Callable[[str], SerialLink]


@pytest.fixture(name="open_")
def fixture_open() -> Iterator[Open]:
    links = []

    def open_(text: str) -> SerialLink:
        links.append(SerialLink(parse(text), fraction=lambda: 0.0))
        return links[-1]

    yield open_
    for link in links:
        link.close()


@pytest.fixture(name="terminal")
def fixture_terminal() -> Iterator[tuple[int, str]]:
    """The descriptor of a master, and the device of its slave. The slave stays open, as simulators do."""
    master, slave = os.openpty()
    yield master, os.ttyname(slave)
    os.close(master)
    os.close(slave)


@contextmanager
def another_program(code: str, at_end: str = "0") -> Iterator[subprocess.Popen[bytes]]:
    """Run Python code in another process until the end of the block."""
    with subprocess.Popen(
        [sys.executable, "-c", f"import fcntl, os, termios\n{code}\nprint(flush=True); input()\n{at_end}"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout
        assert process.stdout.readline() == b"\n"
        yield process
        process.communicate(b"\n")


def test_bytes_pass_unchanged(open_: Open, terminal: tuple[int, str]) -> None:
    master, device = terminal
    link = open_(f"{device},57600")
    link.service(100.0)
    every = bytes(range(256))
    os.write(master, every)
    assert LinkDriver(link).received(256) == every
    assert link.send(every)
    assert os.read(master, 1000) == every


@pytest.mark.parametrize("baud", [9600, 57600, 115200, 921600, 123456])
def test_the_baud_rate_is_set(open_: Open, terminal: tuple[int, str], baud: int) -> None:
    master, device = terminal
    open_(f"{device},{baud}").service(100.0)
    # since glibc 2.42 the C library gives the rate itself
    assert termios.tcgetattr(master)[5] in (baud, getattr(termios, f"B{baud}", OTHER_RATE))


def test_the_link_waits_for_a_missing_device_and_logs_it_once(
    open_: Open, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    peer = Terminal(tmp_path)
    link = open_(peer.url)
    now, waits = 100.0, []
    for _ in range(6):
        link.service(now)
        waits.append(round(link.due() - now, 6))
        now = link.due()
    assert waits == [0.2, 0.4, 0.8, 1.6, *[RETRY[1]] * 2]
    peer.connect(link)
    peer.disconnect()
    assert readable(link.fileno())
    assert link.receive() == []
    assert link.due() == -math.inf
    peer.connect(link)
    peer.disconnect()
    device = tmp_path / "ttyACM0"
    assert [(record.levelname, record.message) for record in caplog.records] == [
        ("WARNING", f"waiting for {device}: no such device, trying again"),
        ("INFO", f"connected to {device}"),
        ("WARNING", f"lost {device}: unplugged, trying again"),
        ("INFO", f"connected to {device}"),
    ]


def may_open(device: str) -> bool:
    """Whether this process may open a device. A privileged process may also open an exclusive one."""
    try:
        os.close(os.open(device, os.O_RDWR | os.O_NOCTTY))
    except OSError:
        return False
    return True


@pytest.mark.parametrize(
    ("lock", "unlock"),
    [
        ("fcntl.flock(file, fcntl.LOCK_EX)", "0"),
        ("fcntl.ioctl(file, termios.TIOCEXCL)", "fcntl.ioctl(file, termios.TIOCNXCL)"),
    ],
)
def test_the_link_waits_for_a_device_that_another_program_has_locked(
    open_: Open, terminal: tuple[int, str], lock: str, unlock: str, caplog: pytest.LogCaptureFixture
) -> None:
    _, device = terminal
    with another_program(f"file = os.open({device!r}, os.O_RDWR | os.O_NOCTTY); {lock}", unlock):
        if "TIOCEXCL" in lock and may_open(device):
            pytest.skip("needs a user without privileges: permissions do not stop root")
        link = open_(device)
        link.service(100.0)
        link.service(link.due())
        [line] = caplog.messages
        assert line.startswith(f"waiting for {device}: held by ")
        assert line.endswith("), trying again")
    link.service(link.due())
    assert link.send(b"mine")


def test_the_link_waits_for_a_real_device_that_another_program_reads_without_a_lock(
    open_: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(serial, "SHARED", set())
    master, slave = os.openpty()
    device = os.ttyname(slave)
    with another_program(f"file = os.open({device!r}, os.O_RDWR | os.O_NOCTTY)") as holding:
        os.close(slave)
        link = open_(device)
        link.service(100.0)
        link.service(link.due())
        [line] = caplog.messages
        assert line.startswith(f"waiting for {device}: held by ")
        assert line.endswith(f" (pid {holding.pid}), trying again")
    link.service(link.due())
    assert link.send(b"mine")
    os.close(master)


def test_the_device_is_opened_exclusively(open_: Open, terminal: tuple[int, str]) -> None:
    _, device = terminal
    other = os.open(device, os.O_RDWR | os.O_NOCTTY)
    privileged = os.geteuid() == 0
    link = open_(device)
    with pytest.raises(BlockingIOError):
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert not may_open(device) or privileged
    link.close()
    fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert may_open(device)
    os.close(other)


@contextmanager
def as_nobody() -> Iterator[None]:
    """Run as another user: permissions do not stop root."""
    import_module("serial")  # the link imports it late, and another user may not be able to read the environment
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def test_a_missing_permission_is_an_error_that_names_the_group(terminal: tuple[int, str]) -> None:
    _, device = terminal
    if os.geteuid() != 0:
        pytest.skip("needs root: only root can change the owner of a device")
    group = next(one for one in grp.getgrall() if one.gr_gid not in (os.getegid(), *os.getgroups()))
    os.chown(device, 0, group.gr_gid)
    os.chmod(device, 0o660)
    with as_nobody(), pytest.raises(LinkError) as raised:
        SerialLink(parse(device))
    assert str(raised.value) == (
        f"{device}: no permission; its group is {group.gr_name}: "
        f"sudo usermod -aG {group.gr_name} $USER, then log in again"
    )


def test_a_device_with_permission_for_its_owner_only_is_an_error_too(terminal: tuple[int, str]) -> None:
    _, device = terminal
    os.chmod(device, 0)
    with as_nobody(), pytest.raises(LinkError) as raised:
        SerialLink(parse(device))
    assert str(raised.value).startswith(f"{device}: no permission; it is c---------, only its owner ")


def test_the_link_waits_for_a_permission_after_the_start(
    open_: Open, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    name = tmp_path / "ttyACM0"
    link = open_(f"serial:{name}")
    master, slave = os.openpty()
    tty.setraw(slave)
    os.chmod(os.ttyname(slave), 0)
    name.symlink_to(os.ttyname(slave))
    tmp_path.chmod(0o777)
    for folder in (tmp_path.parent, tmp_path.parent.parent):
        folder.chmod(0o755)
    with as_nobody():
        link.service(100.0)
    assert "no permission" in caplog.text
    os.chmod(os.ttyname(slave), 0o600)
    link.service(link.due())
    assert link.due() == 100.2 + STABLE_AFTER
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("serial:/dev/null", "/dev/null: not a serial device"),
        ("serial:/proc", "/proc: not a serial device"),
        ("serial:/proc/self/cmdline", "/proc/self/cmdline: no"),
    ],
)
def test_a_file_that_is_not_a_serial_device_is_a_one_line_error(text: str, part: str) -> None:
    with pytest.raises(LinkError) as raised:
        SerialLink(parse(text))
    assert str(raised.value).startswith(part)


def test_an_unsupported_baud_rate_is_a_one_line_error(
    terminal: tuple[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, device = terminal
    really = termios.tcsetattr

    def tcsetattr(descriptor: int, when: int, attributes: list[Any]) -> None:
        really(descriptor, when, [*attributes[:4], termios.B9600, termios.B9600, attributes[6]])

    monkeypatch.setattr(termios, "tcsetattr", tcsetattr)
    with pytest.raises(LinkError) as raised:
        SerialLink(parse(f"{device},921600"))
    assert str(raised.value) == f"{device}: the device refuses 921600 baud"
