"""What an MQTT output is told: the broker, who we are there, how robots are called, where events wait."""

from __future__ import annotations

import hashlib
import os
import ssl
from stat import S_IRWXG, S_IRWXO
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from urllib.parse import urlsplit

from ...errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

EXAMPLE: Final = "mqtts://broker.example/robots"
PASSWORD: Final = "MAV_ROBOT_STATUS_MQTT_PASSWORD"
"""The environment variable with the password."""
PORTS: Final = {"mqtt": 1883, "mqtts": 8883}
VERSIONS: Final = {"5": 5, "3.1.1": 4}
"""As people write them, and as the protocol numbers them."""
DEFAULT_ROBOT: Final = "{host}-{system}"
DEFAULT_KEEPALIVE: Final = 10.0  # s
DEFAULT_SPOOL_SIZE, DEFAULT_SPOOL_AGE = 64.0, 7.0  # MB, days
OF_BROKER: Final = ("url", "user", "password_file", "ca", "cert", "key", "version", "keepalive")
OF_SPOOL: Final = ("robot", "spool", "spool_size", "spool_age")


class Broker(NamedTuple):
    """A broker, and who we are there."""

    host: str
    port: int
    prefix: str
    """What all topics begin with; without a slash at its ends."""
    tls: ssl.SSLContext | None = None
    user: str | None = None
    password: str | None = None
    version: str = "5"
    keepalive: int = int(DEFAULT_KEEPALIVE)
    """Seconds without a word after which one end asks whether the other is there."""

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.host}:{self.port}"


class MqttOptions(NamedTuple):
    """What the publisher is told."""

    broker: Broker
    robot: str
    """The template of a robot's name."""
    spool: str
    """The file in which events wait."""
    spool_size: int
    """Bytes of events that may wait."""
    spool_age: float
    """Seconds for which an event may wait."""


def read(options: Mapping[str, object], environment: Mapping[str, str] = os.environ) -> MqttOptions:
    """The options of a publisher's mapping. Raises UsageError for what is none."""
    broker = read_broker(options, environment, OF_SPOOL)
    robot = str(options.get("robot") or DEFAULT_ROBOT)
    spool = str(options.get("spool") or default_spool(broker, environment))
    size = _number(options, "spool_size", DEFAULT_SPOOL_SIZE, 0.01, 100_000)
    age = _number(options, "spool_age", DEFAULT_SPOOL_AGE, 0.001, 3650)
    return MqttOptions(broker, robot, os.path.expanduser(spool), int(size * 1e6), age * 86400)


def read_broker(
    options: Mapping[str, object], environment: Mapping[str, str] = os.environ, others: tuple[str, ...] = ()
) -> Broker:
    """Those of the options that are about the broker. Raises UsageError, which never shows a password."""
    for key in options:
        if key not in (*OF_BROKER, *others):
            raise UsageError(f"mqtt: unknown option '{key}'; there are {', '.join((*OF_BROKER, *others))}")
    secure, host, port, prefix = _place(str(options.get("url") or ""))
    version = str(options.get("version") or "5")
    if version not in VERSIONS:
        raise UsageError(f"mqtt: version {version!r} is none of {', '.join(VERSIONS)}")
    user = str(options["user"]) if options.get("user") else None
    password = _password(options, environment)
    if password is not None and user is None:
        raise UsageError("mqtt: a password needs a user: add --mqtt-user NAME (user)")
    for key in ("ca", "cert", "key"):
        if options.get(key) and not secure:
            raise UsageError(f"mqtt: {key} is for TLS: write mqtts:// instead of mqtt://")
    keepalive = int(_number(options, "keepalive", DEFAULT_KEEPALIVE, 2, 3600))
    return Broker(host, port, prefix, _tls(options) if secure else None, user, password, version, keepalive)


def default_spool(broker: Broker, environment: Mapping[str, str]) -> str:
    """Where events wait if nothing is said: systemd's StateDirectory, else the user's state folder (XDG)."""
    folder = environment.get("STATE_DIRECTORY", "").partition(":")[0] or os.path.join(
        environment.get("XDG_STATE_HOME") or "~/.local/state", "mav-robot-status"
    )
    mark = hashlib.sha256(f"{broker.name}/{broker.prefix}".encode()).hexdigest()[:12]
    return os.path.join(folder, f"mqtt-{mark}.sqlite")


def _place(url: str) -> tuple[bool, str, int, str]:
    """TLS or not, host, port, prefix."""
    try:
        parts = urlsplit(url)
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
        parts = urlsplit("")
    if "@" in url.partition("://")[2].partition("/")[0]:
        raise UsageError(
            "mqtt: no user or password in the URL, where others see it: write --mqtt-user NAME, and "
            f"--mqtt-password-file FILE or {PASSWORD} in the environment"
        )
    prefix = parts.path.strip("/")
    if scheme not in PORTS or not host or parts.query or parts.fragment:
        raise UsageError(f"mqtt: {url!r} is no broker; write {EXAMPLE}, or mqtt:// without TLS")
    if not prefix or prefix.startswith("$") or any(c in prefix for c in "+#\0") or len(prefix) > 200:
        raise UsageError(f"mqtt: {url!r} names no prefix for the topics; write {EXAMPLE}, without +, # and $")
    return scheme == "mqtts", host, port or PORTS[scheme], prefix


def _password(options: Mapping[str, object], environment: Mapping[str, str]) -> str | None:
    if not options.get("password_file"):
        return environment.get(PASSWORD) or None
    name = os.path.expanduser(str(options["password_file"]))
    try:
        with open(name, "rb") as file:
            if os.fstat(file.fileno()).st_mode & (S_IRWXG | S_IRWXO):
                raise UsageError(f"{name}: others than its owner can read or change this password: chmod 600 {name}")
            data = file.read(65536)
    except (OSError, ValueError) as error:
        raise UsageError(f"{name}: cannot read the password: {_why(error)}") from None
    text = data.decode("utf-8", "replace").rstrip("\r\n")
    if not text or "\n" in text or "\0" in text:
        raise UsageError(f"{name}: the password is one line")
    return text


def _tls(options: Mapping[str, object]) -> ssl.SSLContext:
    ca, cert, key = (_file(options, name) for name in ("ca", "cert", "key"))
    if key and not cert:
        raise UsageError("mqtt: a key needs its certificate: add --mqtt-cert FILE (cert)")
    context: ssl.SSLContext = _readable(ca, lambda: ssl.create_default_context(cafile=ca))
    if cert:
        _readable(f"{cert}, {key}" if key else cert, lambda: context.load_cert_chain(cert, key, _no_passphrase))
    return context


def _no_passphrase() -> str:
    raise UsageError("mqtt: the key is locked with a passphrase; a service needs one that is not, readable to it alone")


def _file(options: Mapping[str, object], name: str) -> str | None:
    return os.path.expanduser(str(options[name])) if options.get(name) else None


def _readable(name: str | None, load: Callable[[], Any]) -> Any:
    try:
        return load()
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise UsageError(f"mqtt: cannot use {name}: {_why(error)}") from None


def _why(error: Exception) -> str:
    if isinstance(error, ssl.SSLError):
        return "no PEM certificate or key that fit together" + (f" ({error.reason})" if error.reason else "")
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)


def _number(options: Mapping[str, object], key: str, default: float, least: float, most: float) -> float:
    value: Any = options.get(key)
    if value is None:
        return default
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if not least <= number <= most:
        raise UsageError(f"mqtt: {key} {value!r} is no number from {least:g} to {most:g}")
    return number
