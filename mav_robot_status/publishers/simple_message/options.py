"""The options of the publisher `simple_message`, and where it listens."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final

from ...errors import UsageError
from ...interface.options import Option, Options, short
from ...simple_message import ORDERS, STATE_PORT
from ..listener import LAST_PORT, place

NAME: Final = "simple_message"
DEFAULT_HOST: Final = "127.0.0.1"
DEFAULT_PORT: Final = STATE_PORT
"""StandardSocketPorts::STATE of ROS-Industrial: where its node `robot_state` connects."""
EVERY_ADDRESS: Final = "0.0.0.0"


@dataclass(frozen=True)
class SimpleMessageOptions(Options):
    """The options of the publisher `simple_message`."""

    host: Annotated[
        str,
        Option("serve the status of one vehicle to ROS-Industrial (port 11002)", "--simple-message", "HOST:PORT"),
    ] = DEFAULT_HOST
    port: Annotated[float | None, Option("the port, if `host` has none (11002)", low=0, high=LAST_PORT)] = None
    byte_order: Annotated[str, Option("byte order of the robot controller that is expected", choices=tuple(ORDERS))] = (
        "little"
    )


def read(given: Mapping[str, object]) -> tuple[str, int, str]:
    """Host, port and byte order of a publisher's mapping. Raises UsageError for a wrong option."""
    options = SimpleMessageOptions.read(NAME, given)
    found = place(options.host)
    if found is None:
        raise UsageError(
            f"{NAME}: {short(options.host, 200)} is not an address to listen on; write HOST:PORT, for example "
            f"{EVERY_ADDRESS}:{DEFAULT_PORT}, and an IPv6 address in brackets"
        )
    if options.port is not None and found.port is not None:
        raise UsageError(f"{NAME}: {short(options.host, 200)} has a port already: leave out 'port'")
    port = next((one for one in (options.port, found.port) if one is not None), DEFAULT_PORT)
    if port != int(port):
        raise UsageError(f"{NAME}: port: must be a whole number, not {port:g}")
    return found.host or EVERY_ADDRESS, int(port), options.byte_order
