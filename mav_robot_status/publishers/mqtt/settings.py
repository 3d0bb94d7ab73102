"""The options of an MQTT output: the broker, the credentials, the names of robots, the file of undelivered events."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple
from urllib.parse import urlsplit

from ...errors import UsageError
from ...interface.options import Option, Options, short
from ...user_files import read_secret, state_folder
from .naming import places

if TYPE_CHECKING:
    import ssl

EXAMPLE: Final = "mqtts://broker.example/robots"
PASSWORD: Final = "MAV_ROBOT_STATUS_MQTT_PASSWORD"
"""The environment variable with the password."""
PORTS: Final = {"mqtt": 1883, "mqtts": 8883}


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


class Broker(NamedTuple):
    """A broker, and the credentials for it."""

    host: str
    port: int
    prefix: str
    """The prefix of all topics, without a slash at either end."""
    tls: ssl.SSLContext | None = None
    user: str | None = None
    password: str | None = None
    version: str = "5"
    keepalive: int = 10
    """Seconds without traffic after which one end pings the other."""

    @property
    def name(self) -> str:
        """The broker's name in log messages."""
        return f"{self.host}:{self.port}"


class MqttSettings(NamedTuple):
    """The settings of the publisher."""

    broker: Broker
    robot: str
    """The template of a robot's name."""
    spool: str
    """The file of undelivered events."""
    spool_size: int
    """The size limit of undelivered events, in bytes."""
    spool_age: float
    """The age limit of an undelivered event, in seconds."""


def read(given: Mapping[str, object], environment: Mapping[str, str] = os.environ) -> MqttSettings:
    """The settings of a publisher's mapping. Raises UsageError for a wrong option."""
    options = MqttOptions.read("mqtt", given)
    robot = options.robot or DEFAULT_ROBOT
    places(robot)
    broker = _broker(options, environment)
    spool = os.path.expanduser(options.spool or default_spool(broker, environment))
    return MqttSettings(broker, robot, spool, int(options.spool_size * 1e6), options.spool_age * 86400)


def read_broker(given: Mapping[str, object], environment: Mapping[str, str] = os.environ) -> Broker:
    """The broker of a mapping of BrokerOptions. Raises UsageError, which never shows a password."""
    return _broker(BrokerOptions.read("mqtt", given), environment)


def _broker(options: BrokerOptions, environment: Mapping[str, str]) -> Broker:
    secure, host, port, prefix = _address(options.url)
    user = options.user or None
    password = _password(options.password_file, environment)
    if password is not None and user is None:
        raise UsageError("mqtt: a password needs a user: add --mqtt-user NAME (user)")
    for name, file in (("ca", options.ca), ("cert", options.cert), ("key", options.key)):
        if file and not secure:
            raise UsageError(f"mqtt: {name} is for TLS: write mqtts:// instead of mqtt://")
    tls = _tls(options) if secure else None
    return Broker(host, port, prefix, tls, user, password, options.version, int(options.keepalive))


def default_spool(broker: Broker, environment: Mapping[str, str]) -> str:
    """The default spool: in systemd's StateDirectory, else in the user's state folder (XDG)."""
    import hashlib

    mark = hashlib.sha256(f"{broker.name}/{broker.prefix}".encode()).hexdigest()[:12]
    return os.path.join(state_folder(environment), f"mqtt-{mark}.sqlite")


def _address(url: str) -> tuple[bool, str, int, str]:
    """Whether TLS is used, host, port, prefix."""
    try:
        parts = urlsplit(url)
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
        parts = urlsplit("")
    if "@" in url.partition("://")[2].partition("/")[0]:
        raise UsageError(
            "mqtt: a URL with a user or password is visible to others: write --mqtt-user NAME, and "
            f"--mqtt-password-file FILE or {PASSWORD} in the environment"
        )
    prefix = parts.path.strip("/")
    if scheme not in PORTS or not host or parts.query or parts.fragment:
        raise UsageError(f"mqtt: {short(url, 200)} is not a broker; write {EXAMPLE}, or mqtt:// without TLS")
    if not prefix or prefix.startswith("$") or any(c in prefix for c in "+#\0") or len(prefix) > 200:
        raise UsageError(f"mqtt: {short(url, 200)} has no prefix for the topics; write {EXAMPLE}, without +, # and $")
    return scheme == "mqtts", host, port or PORTS[scheme], prefix


def _password(file: str | None, environment: Mapping[str, str]) -> str | None:
    if not file:
        return environment.get(PASSWORD) or None
    name, data = read_secret(file, "password", 65536)
    text = data.decode("utf-8", "replace").rstrip("\r\n")
    if not text or "\n" in text or "\0" in text:
        raise UsageError(f"{name}: the password must be one line")
    return text


def _tls(options: BrokerOptions) -> ssl.SSLContext:
    import ssl  # only for a broker with TLS: importing it takes longer than anything else here

    ca, cert, key = (os.path.expanduser(file) if file else None for file in (options.ca, options.cert, options.key))
    if key and not cert:
        raise UsageError("mqtt: a key needs its certificate: add --mqtt-cert FILE (cert)")
    context: ssl.SSLContext = _readable(ca, lambda: ssl.create_default_context(cafile=ca))
    if cert:
        _readable(f"{cert}, {key}" if key else cert, lambda: context.load_cert_chain(cert, key, _no_passphrase))
    return context


def _no_passphrase() -> str:
    raise UsageError("mqtt: the key has a passphrase; use a key without one, in a file that only the service can read")


def _readable(name: str | None, load: Callable[[], Any]) -> Any:
    try:
        return load()
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise UsageError(f"mqtt: cannot use {name}: {_why(error)}") from None


def _why(error: Exception) -> str:
    import ssl

    if isinstance(error, ssl.SSLError):
        return "the PEM certificate and key do not match or cannot be read" + (
            f" ({error.reason})" if error.reason else ""
        )
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)
