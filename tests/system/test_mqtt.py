"""Statuses over a real broker: what arrives, and what happens when broker, network, disk or gateway fails."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import random
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.publishers.mqtt.robot import WINDOW
from mav_robot_status.publishers.mqtt.spool import Event, Spool
from mav_robot_status.testing import ardurover

from ..deadline import SOON, Deadline, allow, in_time, wait_until
from ..ports import free_port
from .gateway_process import Gateway, run
from .mqtt_broker import MISSING, PREFIX, Broker, Certificates, Heard, Listener
from .mqtt_fleet import measure, vehicles

pytestmark = pytest.mark.skipif(MISSING is not None, reason=str(MISSING))

DOCUMENT = Path(__file__).parents[2] / "docs" / "how-to" / "mqtt.md"
ROBOT = "rover-1"
KEEPALIVE = 2
WILL = 1.5 * KEEPALIVE + 7
"""Seconds in which mosquitto 2.0.11 publishes the will of a silent connection. It looks for silent connections every
6 s and counts in whole seconds. It does the same for a client without our code."""
Start = Callable[..., Any]


@pytest.fixture
def broker(ended: contextlib.ExitStack, tmp_path: Path) -> Callable[..., Broker]:
    return lambda *lines, **options: ended.enter_context(contextlib.closing(Broker(tmp_path, *lines, **options)))


@pytest.fixture
def listener(ended: contextlib.ExitStack) -> Callable[..., Listener]:
    return lambda port, **options: ended.enter_context(contextlib.closing(Listener(port, **options)))


@pytest.fixture(scope="session")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    return Certificates(tmp_path_factory.mktemp("certificates"))


@pytest.fixture
def started(gateway: Callable[..., Gateway], tmp_path: Path) -> Callable[..., Gateway]:
    """A gateway of one rover that publishes to a broker."""

    def start(url: str, *more: str) -> Gateway:
        return gateway(
            *("udp:127.0.0.1:0", "--json", "none", "--mqtt", url, "--mqtt-robot", "rover-{system}"),
            *("--mqtt-spool", str(tmp_path / "spool.sqlite"), "--mqtt-keepalive", str(KEEPALIVE), *more),
        )

    return start


@pytest.fixture
def board(gateway: Callable[..., Gateway]) -> Callable[..., int]:
    """A board; the port of its page."""

    def start(url: str, *more: str) -> int:
        http = free_port()
        shown = gateway("board", url, "--http", f"127.0.0.1:{http}", "--mqtt-keepalive", str(KEEPALIVE), *more)
        shown.wait_for_log(r"reading .*/\+")
        return http

    return start


class Feeder:
    """A gateway that needs no vehicle."""

    def __init__(self, url: str, spool: Path, *arguments: str, before: tuple[str, ...] = ()) -> None:
        options = (f"spool={spool}", f"keepalive={KEEPALIVE}")
        command = [*before, sys.executable, "-m", "tests.system.mqtt_feeder", url]
        for option in options:
            command += ["--option", option]
        self.process = subprocess.Popen(
            [*command, "--events", "1", "--seconds", "1e6", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.told: list[int] = []
        self.cost: dict[str, Any] = {}
        self.log: list[str] = []
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._read, self._read_log)]
        for thread in self._threads:
            thread.start()

    def wait_for(self, changes: int) -> None:
        deadline = Deadline(60)
        while len(self.told) < changes:
            assert deadline.left, (len(self.told), self.log)
            time.sleep(0.005)

    def end(self) -> dict[str, Any]:
        self.process.wait(allow(60))
        self.close()
        return self.cost

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for thread in self._threads:
            thread.join(allow(SOON))
        for pipe in (self.process.stdout, self.process.stderr):
            assert pipe is not None
            pipe.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for text in self.process.stdout:
            line = json.loads(text)
            if "change" in line:
                self.told.append(line["change"])
            else:
                self.cost = line

    def _read_log(self) -> None:
        assert self.process.stderr is not None
        self.log.extend(text.rstrip() for text in self.process.stderr)


@pytest.fixture
def feeder(ended: contextlib.ExitStack, tmp_path: Path) -> Callable[..., Feeder]:
    return lambda url, *arguments, spool=tmp_path / "spool.sqlite", before=(): ended.enter_context(
        contextlib.closing(Feeder(url, spool, *arguments, before=before))
    )


class Wall:
    """A TCP relay. After a cut no byte passes, and neither end is closed."""

    before: tuple[str, ...] = ()
    listener: tuple[str, ...] = ()

    def __init__(self, port: int) -> None:
        self.to = port
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.url = f"mqtt://127.0.0.1:{self._listening.getsockname()[1]}/{PREFIX}"
        self.cut = False
        self._stop = False
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop = True
        self._thread.join(allow(SOON))
        for end in [self._listening, *(end for pair in self._pairs for end in pair)]:
            end.close()

    def _run(self) -> None:
        while not self._stop:
            if self.cut:
                time.sleep(0.01)
                continue
            ways = {a: b for pair in self._pairs for a, b in (pair, pair[::-1])}
            readable, _, _ = select.select([self._listening, *ways], [], [], 0.05)
            for end in readable:
                if end is self._listening:
                    self._pairs.append((end.accept()[0], socket.create_connection(("127.0.0.1", self.to))))
                elif end.fileno() >= 0:
                    self._pass(end, ways[end])

    def _pass(self, end: socket.socket, other: socket.socket) -> None:
        data = b""
        with contextlib.suppress(OSError):
            data = end.recv(65536)
            other.sendall(data)
        if not data:
            self._pairs = [pair for pair in self._pairs if end not in pair]
            end.close()
            other.close()


@pytest.fixture
def wall(ended: contextlib.ExitStack) -> Callable[[int], Wall]:
    return lambda port: ended.enter_context(contextlib.closing(Wall(port)))


class Line:
    """A network namespace with one link to this one, which a test can take down. `before` runs a command in it."""

    def __init__(self, port: int) -> None:
        self.to, self._cut = port, False
        self._name = f"mrs{os.getpid()}"
        net = f"10.213.{os.getpid() % 256}"
        self.url = f"mqtt://{net}.1:{port}/{PREFIX}"
        self.listener = (f"listener {port} {net}.1",)
        self.before = ("ip", "netns", "exec", self._name)
        for command in (
            f"netns add {self._name}",
            f"link add {self._name}a type veth peer name {self._name}b netns {self._name}",
            f"addr add {net}.1/24 dev {self._name}a",
            f"link set {self._name}a up",
            f"-n {self._name} addr add {net}.2/24 dev {self._name}b",
            f"-n {self._name} link set {self._name}b up",
        ):
            if shutil.which("ip") is None or self._ip(command):
                self.close()
                pytest.skip("no network namespaces: run as root with CAP_SYS_ADMIN and iproute2")

    @property
    def cut(self) -> bool:
        return self._cut

    @cut.setter
    def cut(self, cut: bool) -> None:
        self._cut = cut
        assert self._ip(f"-n {self._name} link set {self._name}b {'down' if cut else 'up'}") == 0

    def close(self) -> None:
        if shutil.which("ip") is not None:
            self._ip(f"link del {self._name}a")
            self._ip(f"netns del {self._name}")

    def _ip(self, command: str) -> int:
        return subprocess.run(["ip", *command.split()], capture_output=True, check=False, timeout=allow(30)).returncode


@pytest.fixture
def line(ended: contextlib.ExitStack) -> Callable[[int], Line]:
    return lambda port: ended.enter_context(contextlib.closing(Line(port)))


def online(heard: Heard) -> bool:
    return (heard.what, heard.text) == ("connection", "ONLINE")


def changes(events: list[Heard]) -> list[int]:
    """The numbers of the changes in the order of their arrival, without repetitions."""
    found, seen = [], set()
    for heard in events:
        event = json.loads(heard.text)
        if event["id"] not in seen:
            seen.add(event["id"])
            found.append(event["changed"]["error_code"]["new"])
    return found


def shown(http: int, robot: str) -> dict[str, Any]:
    return next((line for line in vehicles(http) if line["handle"] == robot), {"link": {"state": None}, "mode": None})


# -- what arrives ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", ["5", "3.1.1"])
def test_a_robot_is_published_from_its_first_heartbeat_to_the_end_of_the_gateway(
    broker: Start, listener: Start, started: Start, autopilot: Start, validate: Callable[[Any], None], version: str
) -> None:
    at = broker()
    heard = listener(at.port)
    gateway = started(at.url, "--mqtt-version", version)
    autopilot(ardurover.READY, gateway.address)
    heard.wait_for(online)
    status = heard.wait_for(lambda h: h.what == "status" and json.loads(h.text)["mode"] != "UNKNOWN")
    validate(json.loads(status.text))
    first = json.loads(heard.wait_for(lambda h: h.what == "events").text)
    assert (first["seq"], first["robot"], first["system"], first["dropped"]) == (1, ROBOT, 1, 0)
    assert first["changed"]["mode"]["old"] is None
    assert gateway.stop() == 0
    heard.wait_for(lambda h: h.what == "connection" and h.text == "OFFLINE")
    kept = {h.what: h.text for h in _retained(at.port)}
    assert kept["connection"] == "OFFLINE"
    validate(json.loads(kept["status"]))
    assert json.loads(kept["status"])["mode"] == "UNKNOWN"
    assert "events" not in kept


def _retained(port: int) -> list[Heard]:
    with contextlib.closing(Listener(port)) as late:
        late.wait_for(lambda h: h.what == "connection")
        late.settle()
        return [h for h in late.heard if h.retained]


def test_events_have_the_old_and_new_value_of_each_changed_member(
    broker: Start, listener: Start, started: Start, wire: Start
) -> None:
    at = broker()
    heard = listener(at.port)
    gateway = started(at.url)
    rover = wire(gateway.address).beating()
    heard.wait_for(lambda h: h.what == "events")
    rover.beat(armed=True, custom_mode=10)
    event = heard.wait_for(lambda h: h.what == "events" and json.loads(h.text)["changed"].get("mode", {}).get("old"))
    changed = json.loads(event.text)["changed"]
    assert changed["mode"] == {"old": "MANUAL", "new": "AUTO"}
    assert changed["vehicle.flight_mode"] == {"old": "MANUAL", "new": "AUTO"}
    assert "stamp" not in changed


def test_with_mqtt_5_an_old_status_expires_on_the_broker(broker: Start, listener: Start, feeder: Start) -> None:
    at = broker()
    heard = listener(at.port)
    gateway = feeder(at.url, "--rate", "5")
    heard.wait_for(lambda h: h.what == "status")
    gateway.process.kill()
    heard.wait_for(lambda h: h.text == "CONNECTIONBROKEN")
    left = {"connection": "CONNECTIONBROKEN"}
    wait_until(lambda: {h.what: h.text for h in _retained(at.port)} == left, 15)


def test_tls_with_a_client_certificate_and_a_password_from_the_environment(
    broker: Start, started: Start, certificates: Certificates, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at = broker(
        *("allow_anonymous false", _passwords(tmp_path), f"cafile {certificates['ca.pem']}"),
        *(*certificates.lines(), "require_certificate true"),
    )
    monkeypatch.setenv("MAV_ROBOT_STATUS_MQTT_PASSWORD", "correct horse")
    trusted = ("--system", "1", "--mqtt-ca", certificates["ca.pem"], "--mqtt-user", "rover")
    gateway = started(
        at.tls_url, *trusted, "--mqtt-cert", certificates["client.pem"], "--mqtt-key", certificates["client.key"]
    )
    gateway.wait_for_log(r"mqtt: localhost:\d+: connected")
    assert "horse" not in "".join(gateway.log)
    assert "horse" not in Path(f"/proc/{gateway.process.pid}/cmdline").read_text()


def test_the_commands_of_the_document_bring_a_robot_to_the_board_over_tls(
    broker: Start,
    gateway: Start,
    autopilot: Start,
    certificates: Certificates,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    block = re.search(r"```text\n(mav-robot-status .*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert block is not None
    at = broker("allow_anonymous false", _passwords(tmp_path, "rover", "board"), *certificates.lines())
    (tmp_path / "password").write_text("correct horse")
    (tmp_path / "password").chmod(0o600)
    for there, here in (("ca.pem", "ca.pem"), ("rover.pem", "client.pem"), ("rover.key", "client.key")):
        shutil.copy(certificates[here], tmp_path / there)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    http = free_port()
    text = block[1].replace("broker.example", f"localhost:{at.port}").replace("8765", str(http)).replace(":14550", ":0")
    publishing, showing = (line.split()[1:] for line in text.replace("\\\n", "").splitlines())
    first = gateway(*publishing)
    autopilot(ardurover.READY, first.address)
    monkeypatch.setenv("MAV_ROBOT_STATUS_MQTT_PASSWORD", "correct horse")
    monkeypatch.setenv("SSL_CERT_FILE", certificates["ca.pem"])  # one of the system's authorities
    gateway(*showing)
    wait_until(lambda: [line["mode"] for line in served(http)] == ["MANUAL"])


def served(http: int) -> list[dict[str, Any]]:
    """The vehicles on a board; empty while it starts."""
    with contextlib.suppress(OSError):
        return vehicles(http)
    return []


def _passwords(folder: Path, *users: str) -> str:
    path = folder / "passwords"
    path.touch()
    for user in users or ("rover",):
        subprocess.run(["mosquitto_passwd", "-b", str(path), user, "correct horse"], check=True, timeout=allow(30))
    return f"password_file {path}"


# -- nothing lost ----------------------------------------------------------------------------------------------------


def test_a_broker_that_is_away_for_a_while_gets_every_event_in_order(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker(memory=True)
    gateway = feeder(at.url, "--rate", "100", "--changes", "900")
    heard = listener(at.port)
    gateway.wait_for(200)
    at.stop()
    gateway.wait_for(600)
    at.start()
    heard.wait(lambda: len(changes(heard.of("events"))) >= 900, 30)
    assert gateway.end()["waiting"] == 0
    told = changes(heard.of("events"))
    assert told == gateway.told
    assert len([line for line in gateway.log if "trying again" in line]) <= 2, gateway.log


@pytest.mark.slow
def test_none_of_a_thousand_changes_is_lost_when_gateways_are_killed_and_the_broker_stops(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker(memory=True)
    heard = listener(at.port)
    told: list[list[int]] = []
    for number in range(5):
        if number == 1:
            at.stop()
        killed = feeder(at.url, "--rate", "100")
        killed.wait_for(200)
        killed.process.send_signal(signal.SIGKILL)
        killed.end()
        told.append(killed.told)
        if number == 3:
            at.start()
    last = feeder(at.url, "--rate", "1", "--changes", "1")
    last.wait_for(1)
    assert sum(map(len, told)) >= 1000
    assert last.end()["waiting"] == 0
    heard.wait(lambda: len(sessions(heard)) == 6)
    for session, changes_told in zip(sessions(heard), told, strict=False):
        assert session[: len(changes_told)] == changes_told  # the last of all may be one that was not told any more
        assert len(session) <= len(changes_told) + 1


def sessions(heard: Listener) -> list[list[int]]:
    """The changes of each start of a gateway, in the order of the starts."""
    events = heard.of("events")
    begun = dict.fromkeys(json.loads(h.text)["session"] for h in events)
    return [changes([h for h in events if json.loads(h.text)["session"] == session]) for session in begun]


def test_every_line_that_a_killed_gateway_wrote_has_its_event(
    broker: Start, listener: Start, gateway: Start, started: Start, wire: Start, tmp_path: Path
) -> None:
    at = broker(memory=True)
    heard = listener(at.port)
    told = set[str]()
    for number in range(6):
        killed = gateway(
            *("udp:127.0.0.1:0", "--changes-only", "--mqtt", at.url, "--mqtt-robot", "rover-{system}"),
            *("--mqtt-spool", str(tmp_path / "spool.sqlite"), "--mqtt-keepalive", str(KEEPALIVE)),
        )
        rover = wire(killed.address)
        for count in range(3 + number):
            rover.beat(custom_mode=10 * (count % 2))
            killed.wait_for(lambda line, seq=count: line["seq"] == seq)
        killed.process.kill()  # a fraction of a millisecond after the last line
        killed.wait_for_end()
        told |= {line.status["stamp"] for line in killed.lines}
    started(at.url)
    assert len(told) >= 33
    heard.wait(lambda: not told - {json.loads(h.text)["stamp"] for h in heard.of("events")})


@pytest.mark.parametrize("way", ["wall", pytest.param("line", marks=pytest.mark.slow)])
def test_a_cut_network_loses_no_event_and_both_sides_notice_it(
    broker: Start, listener: Start, feeder: Start, board: Start, wall: Start, line: Start, way: str
) -> None:
    between = {"wall": wall, "line": line}[way](free_port())
    at = broker(*between.listener, port=between.to)
    boards = [board(at.url), board(at.url)]
    heard = listener(at.port)
    gateway = feeder(between.url, "--rate", "20", before=between.before)
    gateway.wait_for(40)
    wait_until(lambda: all(shown(http, "robot0")["mode"] == "AUTO" for http in boards))
    cut = time.monotonic()
    between.cut = True
    wait_until(lambda: all(shown(http, "robot0")["mode"] == "UNKNOWN" for http in boards), KEEPALIVE + 0.5)
    broken = heard.wait_for(lambda h: h.text == "CONNECTIONBROKEN", WILL + SOON)
    assert broken.at - cut > KEEPALIVE
    assert in_time(broken.at - cut, WILL + 1)
    gateway.wait_for(len(gateway.told) + 100)
    between.cut = False
    heard.wait_for(online, 20, after=broken.at)
    count = len(gateway.told)
    heard.wait(lambda: len(changes(heard.of("events"))) >= count, 20)
    told = changes(heard.of("events"))
    assert told == list(range(1, len(told) + 1))
    wait_until(lambda: all(shown(http, "robot0")["mode"] == "AUTO" for http in boards))
    gateway.wait_for(len(gateway.told) + 60)  # 3 s: the broker looks for the old connection after 1.5 * KEEPALIVE
    heard.settle()
    assert heard.of("connection")[-1].text == "ONLINE"  # the will of the old connection does not follow


@pytest.mark.slow
def test_a_full_disk_loses_nothing_while_there_is_memory(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with _small(disk) as full:
        at = broker()
        at.stop()
        gateway = feeder(at.url, "--rate", "100", "--changes", "900", spool=disk / "s.sqlite")
        gateway.wait_for(100)
        full()
        gateway.wait_for(500)
        at.start()
        heard = listener(at.port)
        heard.wait(lambda: len(changes(heard.of("events"))) >= 900, 30)
        assert changes(heard.of("events")) == gateway.told
        assert gateway.end()["dropped"] == 0
        assert len([line for line in gateway.log if "cannot write events to" in line]) == 1, gateway.log


def test_a_gateway_that_is_killed_with_a_full_disk_keeps_its_events(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with _small(disk, "2m") as full:
        at = broker()
        at.stop()
        killed = feeder(at.url, "--rate", "100", spool=disk / "s.sqlite")
        killed.wait_for(100)
        full()
        killed.wait_for(500)
        killed.process.kill()
        killed.end()
        at.start()
        heard = listener(at.port)
        feeder(at.url, "--rate", "1", "--events", "0", spool=disk / "s.sqlite")
        heard.wait(lambda: sessions(heard) and len(sessions(heard)[0]) >= len(killed.told), 20)
        assert sessions(heard)[0][: len(killed.told)] == killed.told
        assert any("cannot write events to" in line for line in killed.log), killed.log


def large_spool(path: Path) -> None:
    """9 MB of events that wait: more than SQLite's cache."""
    spool = Spool(str(path), 1 << 30, 1e9)
    for place in range(1, 20_001):
        spool.add(Event(place, ROBOT, time.time(), json.dumps({"id": f"old-{place}", "rest": "x" * 420})))
        if place % 5000 == 0:
            spool.flush(0.0, time.time())
    spool.close(0.0, time.time())


def overwrite_third_quarter(path: Path) -> None:
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(size // 2)
        file.write(random.Random(1).randbytes(size // 4))


@pytest.mark.parametrize("running", [False, True], ids=["before the start", "while it runs"])
def test_a_damaged_spool_is_set_aside_and_statuses_go_on(
    broker: Start, listener: Start, started: Start, autopilot: Start, tmp_path: Path, running: bool
) -> None:
    path = tmp_path / "spool.sqlite"
    large_spool(path)
    at = broker()
    if running:
        at.stop()
    else:
        overwrite_third_quarter(path)
    gate = started(at.url)
    autopilot(ardurover.READY, gate.address)
    if running:
        overwrite_third_quarter(path)
        at.start()
    heard = listener(at.port)
    heard.wait_for(lambda h: h.what == "status" and json.loads(h.text)["mode"] != "UNKNOWN", 20)
    heard.wait_for(lambda h: h.what == "events" and '"old-' not in h.text, 20)
    gate.wait_for_log(
        r"spool.sqlite is damaged \(.*\): it is now .*\.broken, and a new one is used; .* are not delivered"
    )
    assert (tmp_path / "spool.sqlite.broken").stat().st_size > 9_000_000
    assert gate.stop() == 0
    assert len([line for line in gate.log if "damaged" in line]) == 1
    assert not any("Traceback" in line for line in gate.log)


def test_a_hanging_disk_does_not_delay_the_gateway(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    with _freezable(tmp_path) as (disk, freeze):
        at = broker()
        heard = listener(at.port)
        gateway = feeder(at.url, "--rate", "100", "--changes", "400", spool=disk / "s.sqlite")
        gateway.wait_for(100)
        freeze("-f")
        before = time.monotonic()
        gateway.wait_for(len(gateway.told) + 100)
        assert in_time(time.monotonic() - before, 2.0)  # 100 changes at their own rate
        freeze("-u")
        assert gateway.end()["dropped"] == 0
        heard.wait(lambda: changes(heard.of("events")) == gateway.told)
        told = [line for line in gateway.log if "the disk wrote no event within" in line]
        assert 1 <= len(told) <= 3, gateway.log  # a starved machine makes a disk hang, too


@contextlib.contextmanager
def _freezable(folder: Path) -> Iterator[tuple[Path, Callable[[str], object]]]:
    """A disk on which every write blocks from `-f` to `-u`."""
    image, disk = folder / "image", folder / "disk"
    disk.mkdir()
    with image.open("wb") as file:
        file.truncate(20_000_000)
    for command in (["mkfs.ext4", "-q", str(image)], ["mount", "-o", "loop", str(image), str(disk)]):
        if shutil.which(command[0]) is None or subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip("no mounts: run as root with CAP_SYS_ADMIN")
    freeze = functools.partial(subprocess.run, check=False, timeout=allow(30))
    try:
        yield disk, lambda what: freeze(["fsfreeze", what, str(disk)])
    finally:
        freeze(["fsfreeze", "-u", str(disk)], capture_output=True)
        freeze(["umount", "-l", str(disk)])


@contextlib.contextmanager
def _small(folder: Path, size: str = "300k") -> Iterator[Callable[[], None]]:
    """A small disk, and a function that fills it."""
    mount = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], capture_output=True)
    if mount.returncode:
        pytest.skip("no mounts: run as root with CAP_SYS_ADMIN")

    def fill() -> None:
        with contextlib.suppress(OSError), open(folder / "rubbish", "wb", buffering=0) as file:
            while True:
                file.write(bytes(512))

    try:
        yield fill
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def test_beyond_the_limit_the_oldest_events_are_dropped_and_counted(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker()
    at.stop()
    gateway = feeder(at.url, *("--rate", "100", "--changes", "400", "--option", "spool_size=0.05"))
    gateway.wait_for(300)
    gateway.process.send_signal(signal.SIGSTOP)  # until the listener is there
    at.start()
    heard = listener(at.port)
    gateway.process.send_signal(signal.SIGCONT)
    last = heard.wait_for(lambda h: h.what == "events" and '"new": 400}' in h.text, 20)
    told = changes(heard.of("events"))
    assert told == list(range(401 - len(told), 401))
    missing = 400 - len(told)
    # an event that is on its way to the broker when its place is needed is counted, and still arrives
    assert 0 < missing <= json.loads(last.text)["dropped"] <= gateway.end()["dropped"] <= missing + WINDOW


# -- the board -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_board_shows_a_robot_and_the_loss_of_its_gateway(
    broker: Start, board: Start, started: Start, autopilot: Start
) -> None:
    at = broker()
    boards = [board(at.url), board(at.url)]
    gateway = started(at.url)
    autopilot(ardurover.READY, gateway.address)
    wait_until(lambda: all(shown(http, ROBOT)["mode"] in ("MANUAL", "AUTO") for http in boards))
    gateway.process.kill()
    killed = time.monotonic()
    wait_until(lambda: all(shown(http, ROBOT)["link"]["state"] == "LOST" for http in boards), KEEPALIVE)
    assert in_time(time.monotonic() - killed, KEEPALIVE)
    for line in (shown(http, ROBOT) for http in boards):
        assert (line["mode"], line["e_stopped"], line["in_error"]) == ("UNKNOWN", None, None)
        assert line["inhibits"][0]["text"] == "the gateway is gone"


def test_a_status_that_a_broker_kept_over_a_restart_is_not_shown_as_current(
    broker: Start, board: Start, feeder: Start, listener: Start, tmp_path: Path
) -> None:
    at = broker(memory=True)
    gateway = feeder(at.url, "--rate", "5", "--events", "0", "--option", "version=3.1.1")
    listener(at.port).wait_for(lambda h: h.what == "status")
    saved = tmp_path / "mosquitto.db"
    wait_until(lambda: saved.exists() and b"robot0/status" in saved.read_bytes())
    at.stop(kill=True)  # so that it publishes no will
    gateway.process.kill()
    at.start()
    kept = {h.what: h.text for h in _retained(at.port)}
    assert kept["connection"] == "ONLINE"
    assert json.loads(kept["status"])["mode"] == "AUTO"
    http = board(at.url)

    def lost() -> bool:
        """Until the status has arrived, the robot is absent or was never seen."""
        line = shown(http, "robot0")
        assert line["mode"] in (None, "UNKNOWN")
        return bool(line["link"]["state"] == "LOST")

    wait_until(lost)


def test_a_board_behind_a_bridge_shows_unknown_while_the_bridge_is_down(
    broker: Start, board: Start, feeder: Start
) -> None:
    near = broker()
    far = broker(
        *("connection bridge", f"address 127.0.0.1:{near.port}", f"topic {PREFIX}/# in 1"),
        *("restart_timeout 1", "keepalive_interval 5", "remote_clientid bridge"),
    )
    http = board(far.url)
    feeder(near.url, "--rate", "5")
    wait_until(lambda: shown(http, "robot0")["mode"] == "AUTO", 15)
    near.stop(kill=True)
    wait_until(lambda: shown(http, "robot0")["mode"] == "UNKNOWN", KEEPALIVE + 2)
    near.start()
    wait_until(lambda: shown(http, "robot0")["mode"] == "AUTO", 40)


class Deaf:
    """A broker that accepts connections and acknowledges nothing. It keeps what each of them has sent."""

    def __init__(self) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.url = f"mqtt://127.0.0.1:{self.server.getsockname()[1]}/{PREFIX}"
        self.sent: list[bytearray] = []
        self.ended = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self._serve, args=(self.server.accept()[0],), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        self.sent.append(bytearray())
        mine = self.sent[-1]
        with client, contextlib.suppress(OSError):
            mine += client.recv(4096)
            client.sendall(b"\x20\x02\x00\x00")  # CONNACK
            while data := client.recv(4096):
                mine += data
        self.ended += 1

    def close(self) -> None:
        self.server.close()


def test_a_gateway_that_stops_while_events_wait_leaves_the_will_to_the_broker(started: Start, autopilot: Start) -> None:
    """A DISCONNECT would cancel the will, and the robot would stay ONLINE with its last status."""
    with contextlib.closing(Deaf()) as deaf:
        gate = started(deaf.url, "--mqtt-version", "3.1.1", "--mqtt-keepalive", "60")
        autopilot(ardurover.READY, gate.address)
        wait_until(lambda: any(b'"session"' in sent for sent in deaf.sent), what="no event")
        assert gate.stop() == 0
        wait_until(lambda: deaf.ended == len(deaf.sent))
        assert not any(sent.endswith(b"\xe0\x00") for sent in deaf.sent)


def test_a_board_that_was_stopped_shows_nothing_that_waited_meanwhile(
    broker: Start, gateway: Start, feeder: Start
) -> None:
    at = broker()
    http = free_port()
    it = gateway("board", at.url, "--http", f"127.0.0.1:{http}", "--mqtt-keepalive", str(KEEPALIVE))
    it.wait_for_log(r"reading .*/\+")
    feeder(at.url)
    wait_until(lambda: shown(http, "robot0").get("mode") == "AUTO")
    it.process.send_signal(signal.SIGSTOP)
    time.sleep(3.5)
    it.process.send_signal(signal.SIGCONT)
    it.wait_for_log("this program was stopped, so what waits may be old")
    wait_until(lambda: shown(http, "robot0").get("mode") == "AUTO", KEEPALIVE + SOON)


def test_a_board_without_its_broker_shows_unknown(broker: Start, board: Start, feeder: Start) -> None:
    at = broker()
    http = board(at.url)
    feeder(at.url, "--rate", "5")
    wait_until(lambda: shown(http, "robot0")["mode"] == "AUTO")
    at.stop(kill=True)
    wait_until(lambda: shown(http, "robot0")["mode"] == "UNKNOWN", KEEPALIVE + 2)


def test_a_board_without_robots_logs_the_possible_reasons_once(broker: Start, gateway: Start, tmp_path: Path) -> None:
    rights = tmp_path / "rights"
    rights.write_text("topic read elsewhere\n")
    at = broker(f"acl_file {rights}")  # mosquitto lets us subscribe all the same, and passes on nothing
    shown = gateway("board", at.url, "--http", f"127.0.0.1:{free_port()}")
    shown.wait_for_log(f"no message below {PREFIX}/ so far: no gateway publishes there, or the broker denies reading")
    assert shown.stop() == 0
    assert len([line for line in shown.log if "so far" in line]) == 1


@pytest.mark.slow
def test_two_hundred_robots_on_one_board(tmp_path: Path) -> None:
    found = measure(200, 2, 4.0, tmp_path)
    assert (found["live_on_the_board"], found["events_missing"]) == (200, 0)
    assert found["events_on_the_board"] == found["events_told"]
    assert found["board_cpu_percent"] < 50


# -- errors that the user must correct ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lines", "more", "says"),
    [
        pytest.param(["secure"], ["--mqtt-user", "rover", "--mqtt-password-file", "WRONG"], "refuses", id="password"),
        pytest.param(["tls"], ["--mqtt-ca", "other.pem"], "certificate is not trusted", id="another CA"),
        pytest.param(["expired"], ["--mqtt-ca", "ca.pem"], "certificate has expired", id="expired"),
        pytest.param(["mutual"], ["--mqtt-ca", "ca.pem"], "client certificate", id="no client certificate"),
        pytest.param(["forbidden"], [], "certificate is not authorized", id="forbidden will"),
        pytest.param(["no events"], [], "refuses publications under", id="forbidden events"),
        pytest.param(["plain"], ["--mqtt-ca", "ca.pem"], "does it use TLS on this port", id="no TLS"),
        pytest.param(["nobody"], [], "Connection refused", id="no broker"),
    ],
)
def test_a_connection_failure_is_one_line_and_retried_with_backoff(
    broker: Start,
    started: Start,
    certificates: Certificates,
    tmp_path: Path,
    lines: list[str],
    more: list[str],
    says: str,
) -> None:
    rights = tmp_path / "rights"
    rights.write_text(
        f"topic write {PREFIX}/+/connection\ntopic write {PREFIX}/+/status\n"
        if lines == ["no events"]
        else "topic read x\n"
    )
    wrong = tmp_path / "wrong"
    wrong.write_text("swordfish")
    wrong.chmod(0o600)
    kinds: dict[str, tuple[str, ...]] = {
        "secure": ("allow_anonymous false", _passwords(tmp_path)),
        "tls": certificates.lines(),
        "expired": certificates.lines("expired"),
        "mutual": (*certificates.lines(), f"cafile {certificates['ca.pem']}", "require_certificate true"),
        "forbidden": (f"acl_file {rights}",),
        "no events": (f"acl_file {rights}",),
        "plain": (),
        "nobody": (),
    }
    log = tmp_path / "broker.log"
    at = broker(*kinds[lines[0]], f"log_dest file {log}")
    if lines == ["nobody"]:
        at.stop()
    files = {name: certificates[name] for name in ("ca.pem", "other.pem")} | {"WRONG": str(wrong)}
    secure = lines[0] in ("tls", "expired", "mutual", "plain")
    began, first = time.monotonic(), log.read_text().count(" connection from ")
    gateway = started(at.tls_url if secure else at.url, "--system", "1", *(files.get(word, word) for word in more))
    gateway.wait_for_log(says)
    if lines != ["nobody"]:
        wait_until(lambda: log.read_text().count(" connection from ") - first >= 3)
        assert time.monotonic() - began > 2.0  # it waits 1 s, then 2 s, each at least 0.7 times that
    assert gateway.cpu() < 2.0
    warnings = [line for line in gateway.log if "trying again" in line]
    assert len(warnings) == 1, gateway.log
    assert "swordfish" not in "".join(gateway.log)
    assert gateway.stop() == 0
    assert "Traceback" not in "".join(gateway.log)


def test_two_gateways_for_one_robot_are_reported(broker: Start, feeder: Start, tmp_path: Path) -> None:
    at = broker()
    first = feeder(at.url, "--rate", "5")
    first.wait_for(3)
    feeder(at.url, "--rate", "5", spool=tmp_path / "other.sqlite")
    wait_until(lambda: any("does another gateway publish the same robot" in line for line in first.log))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--mqtt", "mqtts://rover:swordfish@broker/robots"], "a URL with a user or password is visible"),
        (["--mqtt", "http://broker/robots"], "is not a broker; write mqtts://"),
        (["--mqtt", "mqtts://broker"], "has no prefix"),
        (["--mqtt-user", "rover"], "--mqtt-user needs --mqtt URL"),
        (["--mqtt", "mqtt://127.0.0.1/robots", "--mqtt-robot", "{color}"], r"the placeholders are \{system\}"),
        (["--mqtt", "mqtts://127.0.0.1/robots", "--mqtt-ca", "/nowhere.pem"], "No such file"),
        (["--mqtt", "mqtt://127.0.0.1/robots", "--mqtt-spool", "/proc/x/s"], "cannot store events in /proc/x/s"),
    ],
)
def test_an_error_on_the_command_line_is_one_line(arguments: list[str], says: str) -> None:
    done = run("udp:127.0.0.1:0", *arguments)
    assert done.returncode in (1, 2)
    assert re.search(says, done.stderr), done.stderr
    assert "swordfish" not in done.stderr
    assert len([line for line in done.stderr.splitlines() if "listening" not in line]) == 1
    assert "Traceback" not in done.stderr


def test_a_recorded_log_is_not_published(demo_log: Path) -> None:
    done = run(str(demo_log), "--mqtt", "mqtt://127.0.0.1/robots")
    assert done.returncode == 2
    assert "replay it without --mqtt" in done.stderr
