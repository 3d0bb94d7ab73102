"""Examines a silent connection on this computer. Used after listening, never before."""

from __future__ import annotations

import errno
import fcntl
import glob
import os
import select
import socket
import struct
import time
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from typing import Final

from ...errors import LinkError
from ...json_object import JsonObject
from ...links.base import Link
from ...links.guarded import open_guarded
from ...links.owner import device_owner
from ...links.serial import SHARED
from ...links.url import Url, parse
from ...mavlink.framing import Parser
from .advice import EVERY_ADDRESS
from .findings import Place

USUAL_PORTS: Final = (14550, 14540, 14551, 14552, 14560, 14445)
"""UDP ports that autopilots, simulators and routers send to by default."""
USUAL_BAUDS: Final = (57600, 115200, 921600, 460800, 38400, 230400, 1500000)
DEVICES: Final = ("serial/by-id/*", "ttyACM*", "ttyUSB*", "ttyAMA*", "ttyTHS*", "rfcomm*")
"""Patterns of serial ports below /dev, persistent names first."""
LISTEN: Final = 1.3  # s for each connection: heartbeats arrive once a second
PATIENCE: Final = 2.0  # s for a TCP connection
REFUSAL: Final = 0.3
"""Seconds to wait for an ICMP refusal of a datagram: it arrives at once or never."""
SIOCGIFADDR: Final = 0x8915


def place(url: Url, heartbeat: bytes) -> Place:
    """Examine a silent connection, whose link is closed. Sends `heartbeat`; nothing if it is empty."""
    kind = url.kind
    if kind.listens and url.host and not is_ours(url.host):
        return Place("not ours", addresses=addresses())
    if kind.transport == "udp" and kind.listens:
        own_port = () if url.host in EVERY_ADDRESS else (url.port,)  # perhaps sent to another local address
        others = (parse(f"udp:0.0.0.0:{p}") for p in (*own_port, *(p for p in USUAL_PORTS if p != url.port)))
        return Place(addresses=addresses(), elsewhere=first_heard(others))
    if kind.transport == "udp" and not kind.broadcasts:
        return Place(udp_trouble(url.host, url.port, heartbeat) if heartbeat else "")
    if kind.transport == "tcp":
        return Place(addresses=addresses()) if kind.listens else Place(tcp_trouble(url.host, url.port))
    if kind.is_serial:
        if not os.path.exists(url.device):
            return Place("missing", devices=serial_devices())
        return Place(holder=holder(url.device))
    return Place()


def other_baud(url: Url) -> Place:
    """Try the other usual baud rates on a serial device that sent bytes but no MAVLink. The link is closed."""
    for baud in USUAL_BAUDS:
        text = f"{url.device},{baud}"
        if baud != url.baud and (heard := first_heard([parse(text)])):
            return Place(elsewhere=heard)
    return Place()


def first_heard(urls: Iterable[Url], seconds: float = LISTEN) -> str:
    """Listen on several connections without sending. Returns the first that receives MAVLink, or an empty text."""
    with ExitStack() as opened:
        links: dict[str, Link] = {}
        for url in urls:
            with suppress(LinkError):  # in use by another program
                link = links[url.text] = open_guarded(url)
                opened.callback(link.close)
        parsers = {text: Parser(frozenset()) for text in links}
        end = time.monotonic() + seconds
        while links and (left := end - time.monotonic()) > 0:
            for link in links.values():
                if time.monotonic() >= link.due():
                    link.service(time.monotonic())
            watched = {link.fileno(): text for text, link in links.items() if link.fileno() >= 0}
            for descriptor in select.select(list(watched), [], [], min(left, 0.1))[0]:
                text = watched[descriptor]
                for data, _ in links[text].receive():
                    parsers[text].feed(data)
                if parsers[text].counters.frames:
                    return text
    return ""


def tcp_trouble(host: str, port: int) -> str:
    """Try to connect. Returns a value of `Place.trouble`."""
    try:
        socket.create_connection((host, port), PATIENCE).close()
    except (socket.gaierror, ValueError):
        return "unknown name"
    except TimeoutError:
        return "timeout"
    except ConnectionRefusedError:
        return "refused"
    except OSError:
        return "unreachable"
    return ""


def udp_trouble(host: str, port: int, heartbeat: bytes) -> str:
    """Send a datagram, and wait for a refusal. Returns a value of `Place.trouble`; empty without an answer."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, ValueError):
        return "unknown name"
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.settimeout(REFUSAL)
        try:
            probe.connect(address)  # only a connected socket receives a refusal
            probe.send(heartbeat)
            probe.recv(1)
        except ConnectionRefusedError:
            return "refused"
        except TimeoutError:
            return ""
        except OSError:
            return "unreachable"
    return ""


def is_ours(host: str) -> bool:
    """Whether an address belongs to this computer."""
    with suppress(OSError, ValueError):
        family, _, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(address)
            except OSError as error:
                return error.errno != errno.EADDRNOTAVAIL
    return True


def addresses() -> tuple[str, ...]:
    """The IPv4 addresses of this computer, without the loopback."""
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # this interface has no IPv4 address
                reply = fcntl.ioctl(any_socket, SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
                found.append(socket.inet_ntoa(reply[20:24]))
    return tuple(a for a in found if not a.startswith("127."))


def holder(device: str) -> str:
    """The program that blocks a serial device; empty if there is none."""
    someone = device_owner(device) or "another program"
    with suppress(OSError):
        if os.major(os.stat(device).st_rdev) not in SHARED and device_owner(device):
            return someone
        try:
            descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            return someone if error.errno == errno.EBUSY else ""
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return someone
        finally:
            os.close(descriptor)
    return ""


def serial_devices(folder: str = "/dev") -> tuple[str, ...]:
    """The serial devices of this computer, without duplicates."""
    found: JsonObject = {}
    for pattern in DEVICES:
        for path in sorted(glob.glob(os.path.join(folder, pattern))):
            found.setdefault(os.path.realpath(path), path)
    return tuple(found.values())
