"""mosquitto on a free loopback port, configured by the test: users, permissions, TLS, a bridge to another broker."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion

from ..deadline import SOON, Deadline, allow, wait_until
from ..ports import free_port

MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/sbin")
MISSING = (
    None
    if MOSQUITTO and shutil.which("openssl")
    else "mosquitto or openssl is not installed: apt-get install mosquitto openssl"
)
PREFIX = "plant/robots"
SETTLE = "settle"
_NUMBERS = itertools.count()


class Broker:
    """One mosquitto that a test can stop and start again on the same port."""

    def __init__(self, folder: Path, *lines: str, port: int | None = None, memory: bool = False) -> None:
        """With `memory`, retained messages survive a restart."""
        self.port = port or free_port()
        folder.mkdir(parents=True, exist_ok=True)
        self._conf = folder / f"mosquitto-{self.port}.conf"
        keep = [f"persistence_location {folder}/", "autosave_interval 1"] if memory else []
        text = [
            f"listener {self.port} 127.0.0.1",
            f"persistence {str(memory).lower()}",
            "max_queued_messages 100000",
            *keep,
        ]
        if not any("allow_anonymous" in line for line in lines):
            text.append("allow_anonymous true")
        self._conf.write_text("\n".join([*text, "user root", *lines]) + "\n")
        self.process: subprocess.Popen[bytes] | None = None
        self.start()

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}/{PREFIX}"

    @property
    def tls_url(self) -> str:
        return f"mqtts://localhost:{self.port}/{PREFIX}"

    def start(self) -> None:
        assert MOSQUITTO is not None
        log = self._conf.with_suffix(".log")
        with log.open("wb") as file:
            self.process = subprocess.Popen([MOSQUITTO, "-c", str(self._conf)], stderr=file)
        deadline = Deadline(SOON)
        while not self._accepts():
            why = f"mosquitto does not start:\n{self._conf.read_text()}\n{log.read_text()}"
            assert not self._has_ended(), why
            assert deadline.left, why
            time.sleep(0.02)

    def _has_ended(self) -> bool:
        return self.process is not None and self.process.poll() is not None

    def _accepts(self) -> bool:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), allow(1)):
            return True
        return False

    def stop(self, kill: bool = False) -> None:
        """Stop the broker. A mosquitto that is still starting loses a SIGTERM, so the signal is sent until it ends."""
        if self.process is None:
            return
        process, self.process = self.process, None
        end = process.kill if kill else process.terminate

        def has_ended() -> bool:
            end()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(1.0)
            return process.returncode is not None

        wait_until(has_ended)

    close = stop


class Heard(NamedTuple):
    """One publication."""

    at: float
    robot: str
    what: str
    text: str
    retained: bool


class Listener:
    """A client that remembers every publication below the prefix."""

    def __init__(self, port: int, prefix: str = PREFIX) -> None:
        self.heard: list[Heard] = []
        self._news = threading.Condition()
        self._prefix = prefix
        self._client = Client(CallbackAPIVersion.VERSION2, f"listener-{next(_NUMBERS)}", clean_session=False)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_message = self._take
        self._client.on_connect = self._subscribe
        subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.connect("127.0.0.1", port, 5)
        self._client.loop_start()
        assert subscribed.wait(allow(SOON))

    def of(self, what: str, robot: str | None = None) -> list[Heard]:
        with self._news:
            return [h for h in self.heard if h.what == what and robot in (None, h.robot)]

    def wait_for(self, wanted: Callable[[Heard], bool], seconds: float = SOON, after: float = 0.0) -> Heard:
        found: Heard = self.wait(lambda: next((h for h in self.heard if h.at > after and wanted(h)), None), seconds)
        return found

    def wait(self, found: Callable[[], Any], seconds: float = SOON) -> Any:
        deadline = Deadline(seconds)
        with self._news:
            while not (result := found()):
                assert deadline.left, f"not within {allow(seconds):.0f} s; last heard: {self.heard[-3:]}"
                self._news.wait(min(deadline.left, 0.5))
        return result

    def settle(self) -> None:
        """Wait until `heard` has everything that the broker has sent so far: it sends in order."""
        mark = f"{time.monotonic()}"
        self._client.publish(f"{self._prefix}/{SETTLE}", mark, 1)
        self.wait_for(lambda h: (h.robot, h.text) == (SETTLE, mark))

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def _subscribe(self, *_: Any) -> None:
        self._client.subscribe(f"{self._prefix}/#", 1)

    def _take(self, client: Any, data: Any, message: MQTTMessage) -> None:
        robot, _, what = message.topic[len(self._prefix) + 1 :].partition("/")
        text = bytes(message.payload).decode()
        with self._news:
            self.heard.append(Heard(time.monotonic(), robot, what, text, message.retain))
            self._news.notify_all()


class Certificates:
    """An authority, a server's certificate, an expired one, a client's, and another authority."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("ca", "other"):
            self._openssl(
                *("req", "-x509", *_KEY, "-keyout", f"{name}.key", "-out", f"{name}.pem", "-days", "2"),
                *("-subj", f"/CN={name}", "-addext", "basicConstraints=critical,CA:TRUE"),
            )
        (folder / "names").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
        for name, days in (("server", 2), ("expired", -1), ("client", 2)):
            self._openssl("req", *_KEY, "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj", f"/CN={name}")
            self._openssl(
                *("x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-set_serial", "7"),
                *("-days", str(days), "-extfile", "names", "-out", f"{name}.pem"),
            )

    def __getitem__(self, name: str) -> str:
        return str(self._folder / name)

    def lines(self, name: str = "server") -> tuple[str, ...]:
        """The lines of a broker's configuration that name them."""
        return f"certfile {self[f'{name}.pem']}", f"keyfile {self[f'{name}.key']}"

    def _openssl(self, *arguments: str) -> None:
        subprocess.run(["openssl", *arguments], cwd=self._folder, capture_output=True, check=True, timeout=allow(30))


_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
