"""All kinds of links: ours as a table, those of other packages by entry points.

The table repeats our entry points in pyproject.toml (a test compares). With it the gateway starts without a search
through all installed packages.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final, NoReturn

from mav_robot_status.errors import UsageError
from mav_robot_status.links.forms import DEFAULT_BAUD, network, serial
from mav_robot_status.links.kind import LinkKind, Url

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints

GROUP: Final = "mav_robot_status.links"


def _refuse(url: Url) -> NoReturn:
    raise UsageError(f"{url.text!r} is a recorded log, which can only be read; write for example udp:127.0.0.1:14550")


UDP_LISTENER: Final = LinkKind(
    "udpin",
    ("udp", "udpin", "udpserver"),
    forms=":P  udp:P  udp:H:P  udpin:H:P  udpserver:H:P  udp://[H]:P  udpin://H:P  udp:H:P?from=ADDRESS,...",
    words="listening on {where}/udp",
    example="udp:127.0.0.1:14550",
    description="listen on a UDP port",
    opener="mav_robot_status.links.udp:UdpListener",
    read=network,
    transport="udp",
    listens=True,
)
UDP_SENDER: Final = LinkKind(
    "udpout",
    ("udpout", "udpclient"),
    forms="H:P  udpout:H:P  udpclient:H:P  udpout://H:P",
    words="sending to {where}/udp",
    example="udpout:192.168.1.20:14550",
    description="send to a UDP port",
    opener="mav_robot_status.links.udp:UdpSender",
    read=network,
    transport="udp",
    speaks_first=True,
)
UDP_BROADCASTER: Final = LinkKind(
    "udpbcast",
    ("udpbcast",),
    forms="udpbcast:H:P",
    words="broadcasting to {where}/udp",
    example="udpbcast:192.168.1.255:14550",
    description="broadcast on UDP until a peer answers",
    opener="mav_robot_status.links.udp:UdpBroadcaster",
    read=network,
    transport="udp",
    speaks_first=True,
    broadcasts=True,
)
TCP_CLIENT: Final = LinkKind(
    "tcp",
    ("tcp", "tcpout", "tcpclient"),
    forms="tcp:H:P  tcpclient:H:P  tcpout://H:P",
    words="connecting to {where}/tcp",
    example="tcp:127.0.0.1:5760",
    description="connect to a TCP server",
    opener="mav_robot_status.links.tcp:TcpLink",
    read=network,
    transport="tcp",
    speaks_first=True,
)
TCP_SERVER: Final = LinkKind(
    "tcpin",
    ("tcpin", "tcpserver"),
    forms="tcpin:P  tcpin:H:P  tcpserver:H:P  tcpin://H:P  tcpin:H:P?from=ADDRESS,...",
    words="listening on {where}/tcp",
    example="tcpin:0.0.0.0:5760",
    description="be a TCP server",
    opener="mav_robot_status.links.tcp_server:TcpServerLink",
    read=network,
    transport="tcp",
    listens=True,
)
SERIAL: Final = LinkKind(
    "serial",
    ("serial",),
    forms="/dev/ttyX[,BAUD]  /dev/ttyX:BAUD[:8N1]  serial:/dev/ttyX:BAUD  serial:///dev/ttyX:BAUD",
    words="serial {device} at {baud} baud",
    example="/dev/ttyACM0,57600",
    description=f"a serial device; the default is {DEFAULT_BAUD} baud",
    opener="mav_robot_status.links.serial:SerialLink",
    read=serial,
    transport="serial",
)
LOG: Final = LinkKind(
    "log",
    (),
    forms="FILE",
    words="recorded log {device}",
    example="flight.tlog",
    description="replay a recorded log",
    opener=_refuse,
    transport="file",
)

KINDS: Final = (UDP_LISTENER, UDP_SENDER, UDP_BROADCASTER, TCP_CLIENT, TCP_SERVER, SERIAL, LOG)
"""Our kinds, in the order in which the help shows them."""
BY_SCHEME: Final = {scheme: kind for kind in KINDS for scheme in kind.schemes}


def installed(scheme: str) -> LinkKind | None:
    """The kind that another package registers for this scheme; None if no package does.

    Raises UsageError if the package cannot be imported, or registers something else than a LinkKind.
    """
    for point in _entry_points().select(name=scheme):
        try:
            kind = point.load()
        except Exception as error:  # another package may raise anything when it is imported
            raise UsageError(f"cannot load the link {point.name!r} ({point.value}): {error}") from error
        if not isinstance(kind, LinkKind):
            raise UsageError(f"{point.value}, the link {point.name!r}, is not a LinkKind")
        return kind
    return None


def schemes() -> list[str]:
    """All schemes, ours first. Imports no other package."""
    return list(dict.fromkeys((*BY_SCHEME, *sorted(_entry_points().names))))


def every_kind() -> list[LinkKind]:
    """Our kinds, then those of other packages. A package that cannot be imported is left out."""
    found = list(KINDS)
    for scheme in schemes()[len(BY_SCHEME) :]:
        try:
            kind = installed(scheme)
        except UsageError:
            continue
        if kind is not None and kind not in found:
            found.append(kind)
    return found


@functools.cache
def _entry_points() -> EntryPoints:
    from importlib.metadata import entry_points  # searches the folders of all packages

    return entry_points(group=GROUP)
