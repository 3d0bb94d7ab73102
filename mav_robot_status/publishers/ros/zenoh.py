"""ROS 2 over Zenoh, for rmw_zenoh: a client of the router `rmw_zenohd`.

Zenoh keeps quiet: it logs only if a program asks for it. Its own threads do the I/O, and it reconnects by itself within
a second or so, and declares the tokens again. A longer loss ends the session, and the worker opens another one.
"""

from __future__ import annotations

import json
import socket
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

import zenoh

from .transport import UnreachableError
from .zenoh_keys import attachment, endpoint, gid, message_key, node_token, publisher_token, subscriptions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .messages import MessageType
    from .settings import Ros2Settings
    from .transport import Endpoint, Sample

PATIENCE: Final = 2.0  # s for a TCP connection
ANSWER: Final = 3.0  # s for the router to answer
MOST_REMOVED: Final = 500
"""Topics removed in one session: 5 kB each. Forged vehicles come and go."""
REASONS: Final[tuple[tuple[type[OSError] | type[ValueError], str], ...]] = (
    (socket.gaierror, "cannot resolve the name"),
    (TimeoutError, "no answer"),
    (ConnectionRefusedError, "nothing listens there; does rmw_zenohd run (ros2 run rmw_zenoh_cpp rmw_zenohd)?"),
)


class _Publisher:
    """A topic that is announced."""

    def __init__(self, session: Any, settings: Ros2Settings, number: int, topic: str, kind: MessageType) -> None:
        domain, zid = settings.domain, str(session.info.zid())
        token = publisher_token(domain, zid, settings.namespace, number, topic, kind)
        # BLOCK: the worker waits for a slow router; otherwise Zenoh would drop messages without a word
        block = zenoh.CongestionControl.BLOCK
        self._publisher = session.declare_publisher(message_key(domain, topic, kind), congestion_control=block)
        self._token = session.liveliness().declare_token(token)
        self._gid = gid(token)
        self._sequence = 0

    def put(self, sample: Sample) -> None:
        self._sequence += 1
        self._publisher.put(sample.payload, attachment=attachment(self._sequence, sample.unix_ns, self._gid))

    def undeclare(self) -> None:
        self._token.undeclare()
        self._publisher.undeclare()


class ZenohTransport:
    """A session with the router, and the publishers in it."""

    def __init__(self, settings: Ros2Settings) -> None:
        self._settings = settings
        self._session: Any = None
        self._node: Any = None
        self._publishers: dict[str, _Publisher] = {}
        self._number = self._removed = 0
        """Topics announced so far, and topics removed in this session."""

    def open(self) -> None:
        """Connect to the router, and show the node. Raises UnreachableError."""
        self._removed = 0
        self._session = session = connect(self._settings)
        with _as_unreachable("cannot show the node"):
            token = node_token(self._settings.domain, str(session.info.zid()), self._settings.namespace)
            self._node = session.liveliness().declare_token(token)

    def lost(self) -> str | None:
        """Whether the router is gone. Zenoh notices a closed connection at once, and a silent one after 10 s."""
        return None if self._session.info.routers_zid() else "connection lost"

    def send(self, sample: Sample) -> None:
        """Publish. While the router reads nothing, this blocks for at most 5 s."""
        with _as_unreachable("cannot publish"):
            self._publisher(sample).put(sample)

    def remove(self, topic: str) -> None:
        """Undeclare the token of a topic. A session keeps some memory of each one, so it is renewed now and then."""
        publisher = self._publishers.pop(topic, None)
        if publisher is None:
            return
        with suppress(zenoh.ZError):  # the session has ended
            publisher.undeclare()
        self._removed += 1
        if self._removed >= MOST_REMOVED:
            self.close()
            self.open()

    def close(self) -> None:
        """Close the session; the router then removes our tokens."""
        session, self._session, self._node = self._session, None, None
        self._publishers.clear()
        if session is not None:
            with suppress(zenoh.ZError):  # it has ended
                session.close()

    def _publisher(self, sample: Sample) -> _Publisher:
        found = self._publishers.get(sample.topic)
        if found is None:
            self._number += 1
            found = _Publisher(self._session, self._settings, self._number, sample.topic, sample.type)
            self._publishers[sample.topic] = found
        return found


def connect(settings: Ros2Settings) -> Any:
    """A session as a client of the router. Raises UnreachableError, which says what fails."""
    try:
        socket.create_connection((settings.host, settings.port), PATIENCE).close()  # Zenoh says only "Timeout!"
    except (OSError, ValueError) as error:  # ValueError: a name that IDNA does not allow
        raise UnreachableError(reason(error)) from None
    try:
        return zenoh.open(_config(settings))
    except zenoh.ZError:
        raise UnreachableError("it does not answer as a Zenoh router") from None


def subscriptions_of(settings: Ros2Settings) -> list[Endpoint]:
    """The subscriptions that the router knows, in all domains. Raises UnreachableError."""
    with _as_unreachable("cannot ask the router"), connect(settings) as session:
        replies = session.liveliness().get(subscriptions(), timeout=ANSWER)
        found = (endpoint(str(reply.ok.key_expr)) for reply in replies if reply.ok)
        return sorted({one for one in found if one is not None})


def reason(error: OSError | ValueError) -> str:
    """Why a TCP connection could not be opened."""
    for kind, words in REASONS:
        if isinstance(error, kind):
            return words
    return getattr(error, "strerror", None) or str(error)


def _config(settings: Ros2Settings) -> Any:
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    values: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [f"tcp/{host}:{settings.port}"],
        "connect/timeout_ms": round(ANSWER * 1000),
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    config = zenoh.Config()
    for key, value in values.items():
        config.insert_json5(key, json.dumps(value))
    return config


@contextmanager
def _as_unreachable(what: str) -> Iterator[None]:
    """Raise UnreachableError for an error of Zenoh, without the place in its source that it names."""
    try:
        yield
    except zenoh.ZError as error:
        raise UnreachableError(f"{what}: {str(error).partition(' at /')[0].strip()}") from None
