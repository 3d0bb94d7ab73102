"""A fake controller of Universal Robots: an RTDE server and a dashboard server on loopback, in a thread.

`ur_rtde`, the usual client of Universal Robots' controllers, accepts it. It is not a simulator: its values are those
that a test or a demo sets.
"""

from __future__ import annotations

import selectors
import socket
import struct
import threading
import time
from types import TracebackType
from typing import Any, Final

from ..hardware.ur.rtde import (
    CONTROLLER,
    DATA,
    FIRMWARE,
    HEADER,
    NOT_FOUND,
    OUTPUTS,
    RATE,
    START,
    TYPES,
    VERSION,
    frame,
)

PAUSE: Final = ord("P")
KINDS: Final = {
    "timestamp": "DOUBLE",
    "robot_mode": "INT32",
    "safety_status": "INT32",
    "runtime_state": "UINT32",
    "robot_status_bits": "UINT32",
    "safety_status_bits": "UINT32",
    "actual_qd": "VECTOR6D",
    "actual_q": "VECTOR6D",
    "target_q": "VECTOR6D",
}
"""The values that it knows, with their types in RTDE."""
TICK: Final = 0.01
"""Seconds between two looks at what is due."""


class RtdeServer:
    """One client of the RTDE server, as a pure protocol machine."""

    def __init__(self, arm: FakeArm) -> None:
        self._arm = arm
        self._rest = b""
        self._names: tuple[str, ...] = ()
        self._period = 0.1
        self._due: float | None = None

    def feed(self, data: bytes) -> bytes:
        """Process received bytes. Returns the answer."""
        self._rest += data
        answer = b""
        while len(self._rest) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._rest)
            if len(self._rest) < size:
                break
            answer += self._answer(kind, self._rest[HEADER.size : size])
            self._rest = b"" if self._arm.drops_what_follows else self._rest[size:]
        return answer

    def due(self, now: float) -> bytes:
        """The values that are due at `now`, monotonic seconds."""
        if self._due is None or now < self._due:
            return b""
        self._due = now + self._period
        values = self._arm.values()
        out = b"\1"
        for name in self._names:
            value = values[name]
            out += struct.pack(">" + TYPES[KINDS[name]], *(value if isinstance(value, tuple) else (value,)))
        return frame(DATA, out)

    def _answer(self, kind: int, payload: bytes) -> bytes:
        if kind == VERSION:
            return frame(VERSION, bytes([self._arm.speaks_version_2]))
        if kind == CONTROLLER:
            return frame(CONTROLLER, FIRMWARE.pack(*self._arm.firmware, 0)) if self._arm.tells_version else b""
        if kind == OUTPUTS:
            return self._recipe(payload)
        if kind == START:
            self._due = 0.0
            return frame(START, b"\1")
        if kind == PAUSE:
            self._due = None
            return frame(PAUSE, b"\1")
        return b""

    def _recipe(self, payload: bytes) -> bytes:
        """`ur_rtde` ends the list of names with a comma; an empty name has no type."""
        names = [name for name in payload[RATE.size :].decode("ascii").split(",") if name]
        self._period = 1 / min(max(RATE.unpack_from(payload)[0], 1.0), 500.0)
        kinds = [NOT_FOUND if name in self._arm.unknown else KINDS.get(name, NOT_FOUND) for name in names]
        self._names = () if NOT_FOUND in kinds else tuple(names)
        return frame(OUTPUTS, bytes([bool(self._names)]) + ",".join(kinds).encode("ascii"))


class FakeArm:
    """The controller. Attributes say what it reports; change them from any thread."""

    def __init__(self, port: int = 0, dashboard_port: int = 0, host: str = "127.0.0.1") -> None:
        """Listen on an address of the loopback; port 0: any."""
        self.robot_mode, self.robot_bits, self.safety_bits, self.safety_status = 7, 0b11, 0b1, 1
        self.joint_speeds: tuple[float, ...] = (0.0,) * 6
        self.operational: str | None = "AUTOMATIC"
        """The answer of the dashboard server; None: it does not know the question."""
        self.firmware = (5, 11, 1)
        self.speaks_version_2 = self.tells_version = True
        self.unknown: frozenset[str] = frozenset()
        """Names of values that it does not know."""
        self.drops_what_follows = False
        """It processes the first frame of each read, and drops the others."""
        self.silent = False
        """It stays connected and sends nothing."""
        self.garbage = b""
        """Sent once to each client of the RTDE server."""
        self._servers = [_listen(host, port), _listen(host, dashboard_port)]
        self.port, self.dashboard_port = (server.getsockname()[1] for server in self._servers)
        self._clients: dict[socket.socket, RtdeServer | None] = {}
        """None: a client of the dashboard server."""
        self._selector = selectors.DefaultSelector()
        for server in self._servers:
            self._selector.register(server, selectors.EVENT_READ)
        self._dropping = False
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="fake arm", daemon=True)
        self._thread.start()

    def __enter__(self) -> FakeArm:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def values(self) -> dict[str, Any]:
        """What it reports now, by the names of RTDE."""
        return {
            "timestamp": time.monotonic(),
            "robot_mode": self.robot_mode,
            "safety_status": self.safety_status,
            "runtime_state": 1,
            "robot_status_bits": self.robot_bits,
            "safety_status_bits": self.safety_bits,
            "actual_qd": self.joint_speeds,
            "actual_q": (0.0,) * 6,
            "target_q": (0.0,) * 6,
        }

    def run_program(self, moving: bool = True) -> None:
        """Powered, no stop; its joints move or stand."""
        self.robot_mode, self.robot_bits, self.safety_bits, self.safety_status = 7, 0b11, 0b1, 1
        self.joint_speeds = (0.2 if moving else 0.0,) * 6

    def press_emergency_stop(self) -> None:
        """The button on the arm: the power goes, the joints stand."""
        self.robot_mode, self.robot_bits = 3, 0
        self.safety_bits, self.safety_status = 1 << 6 | 1 << 7 | 1 << 10, 7
        self.joint_speeds = (0.0,) * 6

    def drop_clients(self) -> None:
        """Close every connection, as a reboot does."""
        self._dropping = True

    def close(self) -> None:
        """Stop listening and close every connection."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._closed.is_set():
            for key, _ in self._selector.select(TICK):
                sock: Any = key.fileobj
                if sock in self._servers:
                    self._accept(sock)
                else:
                    self._read(sock)
            if self._dropping:
                self._dropping = False
                for client in list(self._clients):
                    self._drop(client)
            garbage, self.garbage = self.garbage, b""
            for client, session in list(self._clients.items()):
                if session is not None and garbage:
                    self._send(client, garbage)
                if session is not None and not self.silent:
                    self._send(client, session.due(time.monotonic()))
        for sock in (*self._clients, *self._servers):
            sock.close()
        self._selector.close()

    def _accept(self, server: socket.socket) -> None:
        client, _ = server.accept()
        client.setblocking(False)
        is_rtde = server is self._servers[0]
        self._clients[client] = RtdeServer(self) if is_rtde else None
        self._selector.register(client, selectors.EVENT_READ)
        if not is_rtde:
            self._send(client, b"Connected: Universal Robots Dashboard Server\n")

    def _read(self, client: socket.socket) -> None:
        try:
            data = client.recv(4096)
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        session = self._clients[client]
        if session is not None:
            self._send(client, session.feed(data))
            return
        for line in data.splitlines():
            known = line.strip() == b"get operational mode" and self.operational is not None
            answer = str(self.operational) if known else f"could not understand: '{line.decode('ascii', 'replace')}'"
            self._send(client, answer.encode("ascii") + b"\n")

    def _send(self, client: socket.socket, data: bytes) -> None:
        try:
            if data:
                client.send(data)
        except OSError:  # a client that does not read loses data, as with the real one
            pass

    def _drop(self, client: socket.socket) -> None:
        del self._clients[client]
        self._selector.unregister(client)
        client.close()


def _listen(host: str, port: int) -> socket.socket:
    server = socket.create_server((host, port))
    server.setblocking(False)
    return server
