"""What this computer can tell about a connection on which nothing is heard. Asked after listening, never before."""

from __future__ import annotations

import errno
import fcntl
import glob
import os
import select
import socket
import struct
import time
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, Final

from ...errors import LinkError
from ...link import open_link
from ...link.owner import device_owner
from ...link.serial import SHARED
from ...link.url import parse
from ...mavlink.framing import Parser
from .advice import EVERY_ADDRESS
from .findings import Place

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ...link.base import Link
    from ...link.url import Url

USUAL_PORTS: Final = (14550, 14540, 14551, 14552, 14560, 14445)
"""UDP ports that autopilots, simulators and routers send to unless told otherwise."""
USUAL_BAUDS: Final = (57600, 115200, 921600, 460800, 38400, 230400, 1500000)
DEVICES: Final = ("serial/by-id/*", "ttyACM*", "ttyUSB*", "ttyAMA*", "ttyTHS*", "rfcomm*")
"""Names below /dev of ports that something may be plugged into, the lasting names first."""
LISTEN: Final = 1.3  # s for each place: heartbeats come once a second
PATIENCE: Final = 2.0  # s for a TCP connection
REFUSAL: Final = 0.3
"""Seconds to wait for the refusal of a datagram: it comes at once or never."""
SIOCGIFADDR: Final = 0x8915


def place(url: Url, heartbeat: bytes) -> Place:
    """Look around where nothing came; the link is closed. `heartbeat` may be sent; empty: nothing may."""
    if url.kind in ("udpin", "tcpin") and not is_ours(url.host):
        return Place("not ours", addresses=addresses())
    if url.kind == "udpin":
        own_port = () if url.host in EVERY_ADDRESS else (url.port,)  # perhaps to another address of this computer
        others = (parse(f"udp:0.0.0.0:{p}") for p in (*own_port, *(p for p in USUAL_PORTS if p != url.port)))
        return Place(addresses=addresses(), elsewhere=first_heard(others))
    if url.kind == "udpout":
        return Place(udp_trouble(url.host, url.port, heartbeat) if heartbeat else "")
    if url.kind == "tcp":
        return Place(tcp_trouble(url.host, url.port))
    if url.kind == "tcpin":
        return Place(addresses=addresses())
    if url.kind == "serial":
        if not os.path.exists(url.device):
            return Place("missing", devices=serial_devices())
        return Place(holder=holder(url.device))
    return Place()


def other_baud(url: Url) -> Place:
    """Try the other usual rates where bytes came from a serial device, but no MAVLink; the link is closed."""
    for baud in USUAL_BAUDS:
        text = f"{url.device},{baud}"
        if baud != url.baud and (heard := first_heard([parse(text)])):
            return Place(elsewhere=heard)
    return Place()


def first_heard(urls: Iterable[Url], seconds: float = LISTEN) -> str:
    """Of several connections, listened to at once without sending, the first on which MAVLink is heard; else empty."""
    with ExitStack() as opened:
        links: dict[str, Link] = {}
        for url in urls:
            with suppress(LinkError):  # taken: whoever has it hears what comes there
                link = links[url.text] = open_link(url)
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
    """What happens if one connects: a word of `Place.trouble`."""
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
    """Whether the other end says that nobody listens there: a word of `Place.trouble`, or empty if it says nothing."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, ValueError):
        return "unknown name"
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.settimeout(REFUSAL)
        try:
            probe.connect(address)  # only a connected socket is told of a refusal
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
    """Whether this computer has an address to listen on."""
    with suppress(OSError, ValueError):
        family, _, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(address)
            except OSError as error:
                return error.errno != errno.EADDRNOTAVAIL
    return True


def addresses() -> tuple[str, ...]:
    """The IPv4 addresses of this computer but its loopback's."""
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # it has none
                reply = fcntl.ioctl(any_socket, SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
                found.append(socket.inet_ntoa(reply[20:24]))
    return tuple(a for a in found if not a.startswith("127."))


def holder(device: str) -> str:
    """Who keeps us from a serial device; empty if nobody does."""
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
    """The serial devices that there are, each once."""
    found: dict[str, Any] = {}
    for pattern in DEVICES:
        for path in sorted(glob.glob(os.path.join(folder, pattern))):
            found.setdefault(os.path.realpath(path), path)
    return tuple(found.values())
