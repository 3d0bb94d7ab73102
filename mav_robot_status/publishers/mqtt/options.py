"""The options of the MQTT output, and of `board`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from ...interface.options import Option, Options

VERSIONS: Final = {"5": 5, "3.1.1": 4}
"""The versions as people write them, with the protocol level of each."""
DEFAULT_ROBOT: Final = "{host}-{system}"


@dataclass(frozen=True)
class BrokerOptions(Options):
    """How to connect to a broker."""

    url: Annotated[
        str, Option("publish statuses and events to a broker, for example mqtts://broker/robots", "--mqtt", "URL")
    ] = ""
    user: Annotated[str | None, Option("user name at the broker", "--mqtt-user", "NAME")] = None
    password_file: Annotated[
        str | None,
        Option("file with the password; without it, MAV_ROBOT_STATUS_MQTT_PASSWORD", "--mqtt-password-file", "FILE"),
    ] = None
    ca: Annotated[str | None, Option("trusted CA (PEM), instead of the system's", "--mqtt-ca", "FILE")] = None
    cert: Annotated[str | None, Option("client certificate (PEM)", "--mqtt-cert", "FILE")] = None
    key: Annotated[str | None, Option("client key (PEM), if it is in another file", "--mqtt-key", "FILE")] = None
    version: Annotated[str, Option("protocol version (5)", "--mqtt-version", choices=tuple(VERSIONS))] = "5"
    keepalive: Annotated[
        float,
        Option("seconds until a broken connection is noticed (10)", "--mqtt-keepalive", "S", low=2, high=3600),
    ] = 10.0


@dataclass(frozen=True)
class MqttOptions(BrokerOptions):
    """The options of the publisher `mqtt`."""

    robot: Annotated[str, Option("name of a robot on its topics ({host}-{system})", "--mqtt-robot", "NAME")] = (
        DEFAULT_ROBOT
    )
    spool: Annotated[str | None, Option("file of undelivered events", "--mqtt-spool", "FILE")] = None
    spool_size: Annotated[float, Option("size limit of undelivered events, megabytes", low=0.01, high=100_000)] = 64.0
    spool_age: Annotated[float, Option("age limit of an undelivered event, days", low=0.001, high=3650)] = 7.0
