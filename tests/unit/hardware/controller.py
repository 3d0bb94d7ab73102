"""The controller of a robot, as a TCP server that sends the bytes of a test to its clients."""

from __future__ import annotations

import contextlib
import socket


class TcpController:
    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.setblocking(False)
        self.port: int = self._server.getsockname()[1]
        self._clients: list[socket.socket] = []

    def send(self, data: bytes) -> None:
        """Send to every client. What one does not read, or is gone, is lost."""
        with contextlib.suppress(BlockingIOError):
            self._clients.append(self._server.accept()[0])
        for client in list(self._clients):
            try:
                client.setblocking(False)
                client.send(data)
            except BlockingIOError:
                pass
            except OSError:
                client.close()
                self._clients.remove(client)

    def close(self) -> None:
        for sock in (self._server, *self._clients):
            sock.close()
