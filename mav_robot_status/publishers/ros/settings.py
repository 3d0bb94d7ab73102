"""The options and settings of a ROS 2 output: the middleware, its address and domain, the names of the topics."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, NamedTuple
from urllib.parse import urlsplit

from ...errors import UsageError
from ...interface.options import Option, Options, short
from .naming import DIAGNOSTICS, HARDWARE_STATUS, is_name

if TYPE_CHECKING:
    from collections.abc import Mapping

ZENOH, DDS = "zenoh", "dds"
DEFAULT_PORT: Final = 7447  # of rmw_zenohd
LAST_DOMAIN: Final = 232
"""The ports of a higher DDS domain would exceed 65535."""
DOMAIN: Final = "ROS_DOMAIN_ID"
"""The environment variable with the domain that every ROS 2 program uses."""
RANGE: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
RANGES: Final = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
LOCALHOST_ONLY: Final = "ROS_LOCALHOST_ONLY"
"""Older than RANGE, and goes before it."""
PEERS: Final = "ROS_STATIC_PEERS"
FORMS: Final = "write zenoh://127.0.0.1:7447 for a Zenoh router, or dds://0 for the DDS domain 0"


@dataclass(frozen=True)
class Ros2Options(Options):
    """The options of the publisher `ros2`."""

    url: Annotated[
        str, Option("publish ROS 2 topics: zenoh://127.0.0.1:7447 or dds://0, the DDS domain", "--ros2", "URL")
    ] = ""
    namespace: Annotated[str, Option("namespace of the ROS 2 topics and node", "--ros2-namespace", "NAME")] = ""
    topic: Annotated[str, Option("name of the topic of each robot")] = "robot_status"
    rate: Annotated[float, Option("messages a second on each topic if nothing changes, Hz", low=0, high=1000)] = 1.0
    hardware_status: Annotated[bool, Option("publish control_msgs/HardwareStatus too, for ros2_control")] = False


class Ros2Settings(NamedTuple):
    """What a transport needs."""

    middleware: str
    """ZENOH or DDS."""
    domain: int
    host: str = ""
    """The host of the Zenoh router."""
    port: int = DEFAULT_PORT
    namespace: str = ""
    """Without a slash at its end: empty, or `/plant`."""
    topic: str = "robot_status"
    rate: float = 1.0
    """Hz; 0: changes only."""
    hardware_status: bool = False
    """Whether control_msgs/HardwareStatus is published too."""
    local: bool = False
    """DDS on this computer only."""
    peers: tuple[str, ...] = ()
    """DDS: computers that are asked besides those that multicast finds."""

    @property
    def name(self) -> str:
        """The other end in log messages."""
        if self.middleware == DDS:
            return f"DDS domain {self.domain}" + (" (LOCALHOST)" if self.local else "")
        host = f"[{self.host}]" if ":" in self.host else self.host
        domain = f", domain {self.domain}" if self.domain else ""
        return f"Zenoh router {host}:{self.port}{domain}"


def read(given: Mapping[str, object], environment: Mapping[str, str] = os.environ) -> Ros2Settings:
    """The settings of a publisher's mapping. Raises UsageError for a wrong option."""
    options = Ros2Options.read("ros2", given)
    settings = read_url(options.url, environment)
    return settings._replace(namespace=_namespace(options.namespace), topic=_topic(options))._replace(
        rate=options.rate, hardware_status=options.hardware_status
    )


def read_url(url: str, environment: Mapping[str, str] = os.environ) -> Ros2Settings:
    """The middleware, its address and the domain. Raises UsageError."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        raise UsageError(f"ros2: {short(url, 200)} is not an address; {FORMS}") from None
    rest = parts.path.removeprefix("/").removesuffix("/")
    if parts.query or parts.fragment or "@" in parts.netloc:
        raise UsageError(f"ros2: {short(url, 200)} is not an address; {FORMS}")
    if parts.scheme == ZENOH and host:
        return Ros2Settings(ZENOH, _domain(rest, url, environment), host, DEFAULT_PORT if port is None else port)
    if parts.scheme == DDS and not rest:
        domain, (local, peers) = _domain(parts.netloc, url, environment), _discovery(environment)
        return Ros2Settings(DDS, domain, local=local, peers=peers)
    raise UsageError(f"ros2: {short(url, 200)} is not an address; {FORMS}")


def _domain(text: str, url: str, environment: Mapping[str, str]) -> int:
    """The domain of the URL, else that of the environment, else 0."""
    given = text or environment.get(DOMAIN, "") or "0"
    if given.isascii() and given.isdigit() and len(given) <= 3 and int(given) <= LAST_DOMAIN:
        return int(given)
    where = short(url, 200) if text else f"{DOMAIN} in the environment"
    raise UsageError(f"ros2: {where}: the domain must be a number from 0 to {LAST_DOMAIN}, not {short(given)}")


def _discovery(environment: Mapping[str, str]) -> tuple[bool, tuple[str, ...]]:
    """Whether DDS stays on this computer, and its static peers, as every ROS 2 program reads them."""
    if environment.get(LOCALHOST_ONLY) == "1":
        return True, ()
    found = environment.get(RANGE, "")
    if found == "OFF":
        raise UsageError(f"ros2: {RANGE} is OFF: no subscriber could hear the gateway; write LOCALHOST or SUBNET")
    if found not in ("", *RANGES):
        raise UsageError(f"ros2: {RANGE} must be one of {', '.join(RANGES)}, not {short(found)}")
    return found == "LOCALHOST", tuple(peer for peer in environment.get(PEERS, "").split(";") if peer)


def _namespace(text: str) -> str:
    parts = [part for part in text.split("/") if part]
    if not all(map(is_name, parts)) or len(text) > 100:
        raise UsageError(
            f"ros2: namespace: ROS does not allow {short(text)}; each part needs a letter first, then letters, digits "
            "and single underscores: /plant/rovers"
        )
    return "".join(f"/{part}" for part in parts)


def _topic(options: Ros2Options) -> str:
    if options.hardware_status and options.topic == HARDWARE_STATUS:
        raise UsageError(f"ros2: topic: {HARDWARE_STATUS} is that of control_msgs/HardwareStatus; write robot_status")
    if not is_name(options.topic) or len(options.topic) > 100 or f"/{options.topic}" == DIAGNOSTICS:
        raise UsageError(
            f"ros2: topic: ROS does not allow {short(options.topic)} here; write a letter, then letters, digits and "
            f"single underscores, but not {DIAGNOSTICS[1:]}: robot_status"
        )
    return options.topic
