"""Statuses over a real broker: what arrives, and what happens when broker, network, disk or gateway do not."""

from __future__ import annotations

import contextlib
import functools
import json
import os
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

from mav_robot_status.testing import ardurover

from .gateway_process import SOON, Gateway, run
from .mqtt_broker import MISSING, PREFIX, Broker, Certificates, Heard, Listener, free_port
from .mqtt_fleet import measure, vehicles

pytestmark = pytest.mark.skipif(MISSING is not None, reason=str(MISSING))

DOCUMENT = Path(__file__).parents[2] / "docs" / "mqtt.md"
ROBOT = "rover-1"
KEEPALIVE = 2
WILL = 1.5 * KEEPALIVE + 7
"""Seconds within which mosquitto (2.0.11) says the will of a connection that has fallen silent: it looks for such every
6 s, and counts in whole seconds. So it does with a client that holds nothing of ours."""
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
    """A gateway of one rover, with a broker."""

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
            [*command, "--events", "1", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.told: list[int] = []
        self.cost: dict[str, Any] = {}
        self.log: list[str] = []
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._read, self._read_log)]
        for thread in self._threads:
            thread.start()

    def wait_for(self, changes: int, timeout: float = 60.0) -> None:
        deadline = time.monotonic() + timeout
        while len(self.told) < changes:
            assert time.monotonic() < deadline, (len(self.told), self.log)
            time.sleep(0.005)

    def end(self, timeout: float = 60.0) -> dict[str, Any]:
        self.process.wait(timeout)
        self.close()
        return self.cost

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        for thread in self._threads:
            thread.join(SOON)
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
    """A TCP relay that may be cut: nothing passes any more, and nobody is told."""

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
        self._thread.join(SOON)
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
    """A network namespace whose only line to here may be pulled: what runs behind `before` has no other."""

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
                pytest.skip("network namespaces are not permitted here")

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
        return subprocess.run(["ip", *command.split()], capture_output=True, check=False, timeout=30).returncode


@pytest.fixture
def line(ended: contextlib.ExitStack) -> Callable[[int], Line]:
    return lambda port: ended.enter_context(contextlib.closing(Line(port)))


def online(heard: Heard) -> bool:
    return (heard.what, heard.text) == ("connection", "ONLINE")


def changes(events: list[Heard]) -> list[int]:
    """The numbers of the changes, as they came, without those that came again."""
    found, seen = [], set()
    for heard in events:
        event = json.loads(heard.text)
        if event["id"] not in seen:
            seen.add(event["id"])
            found.append(event["changed"]["error_code"]["new"])
    return found


def eventually(found: Callable[[], Any], timeout: float = SOON) -> Any:
    deadline = time.monotonic() + timeout
    while not (result := found()):
        assert time.monotonic() < deadline, f"not within {timeout} s"
        time.sleep(0.05)
    return result


def shown(http: int, robot: str) -> dict[str, Any]:
    return next((line for line in vehicles(http) if line["handle"] == robot), {"link": {"state": None}, "mode": None})


# -- what arrives ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", ["5", "3.1.1"])
def test_a_robot_is_told_from_its_first_word_to_its_last(
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
    kept = {h.what: h.text for h in _retained(listener, at.port)}
    assert kept["connection"] == "OFFLINE"
    validate(json.loads(kept["status"]))
    assert json.loads(kept["status"])["mode"] == "UNKNOWN"
    assert "events" not in kept


def _retained(listener: Start, port: int) -> list[Heard]:
    late = listener(port)
    late.wait_for(lambda h: h.what == "connection")
    time.sleep(0.2)
    return [h for h in late.heard if h.retained]


def test_events_tell_each_member_that_changed_with_what_it_was(
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


def test_with_mqtt_5_a_status_that_nobody_renews_leaves_the_broker_by_itself(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker()
    heard = listener(at.port)
    gateway = feeder(at.url, "--rate", "5")
    heard.wait_for(lambda h: h.what == "status")
    gateway.process.kill()
    heard.wait_for(lambda h: h.text == "CONNECTIONBROKEN")
    time.sleep(KEEPALIVE * 1.5 + 2.5)
    assert {h.what: h.text for h in _retained(listener, at.port)} == {"connection": "CONNECTIONBROKEN"}


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


def test_the_commands_of_the_document_bring_a_robot_over_tls_to_the_board(
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
    eventually(lambda: [line["mode"] for line in served(http)] == ["MANUAL"])


def served(http: int) -> list[dict[str, Any]]:
    """What a board shows; nothing while it starts."""
    with contextlib.suppress(OSError):
        return vehicles(http)
    return []


def _passwords(folder: Path, *users: str) -> str:
    path = folder / "passwords"
    path.touch()
    for user in users or ("rover",):
        subprocess.run(["mosquitto_passwd", "-b", str(path), user, "correct horse"], check=True, timeout=30)
    return f"password_file {path}"


# -- nothing lost ----------------------------------------------------------------------------------------------------


def test_a_broker_that_is_away_for_a_while_gets_every_event_in_order(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker(memory=True)
    gateway = feeder(at.url, "--rate", "100", "--changes", "900", "--seconds", "60")
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


def test_of_a_thousand_changes_none_is_lost_though_gateways_are_killed_and_the_broker_is_stopped(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker(memory=True)
    heard = listener(at.port)
    told: list[list[int]] = []
    for number in range(5):
        if number == 1:
            at.stop()
        killed = feeder(at.url, "--rate", "100", "--seconds", "60")
        killed.wait_for(200)
        killed.process.send_signal(signal.SIGKILL)
        killed.end()
        told.append(killed.told)
        if number == 3:
            at.start()
    last = feeder(at.url, "--rate", "1", "--changes", "1", "--seconds", "60")
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


def test_every_line_that_a_gateway_wrote_before_it_was_killed_has_its_event(
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


@pytest.mark.parametrize("way", ["wall", "line"])
def test_a_network_that_is_cut_costs_no_event_and_is_noticed_on_both_sides(
    broker: Start, listener: Start, feeder: Start, board: Start, wall: Start, line: Start, way: str
) -> None:
    between = {"wall": wall, "line": line}[way](free_port())
    at = broker(*between.listener, port=between.to)
    boards = [board(at.url), board(at.url)]
    heard = listener(at.port)
    gateway = feeder(between.url, "--rate", "20", "--seconds", "60", before=between.before)
    gateway.wait_for(40)
    eventually(lambda: all(shown(http, "robot0")["mode"] == "AUTO" for http in boards))
    cut = time.monotonic()
    between.cut = True
    eventually(lambda: all(shown(http, "robot0")["mode"] == "UNKNOWN" for http in boards), KEEPALIVE + 0.5)
    broken = heard.wait_for(lambda h: h.text == "CONNECTIONBROKEN", WILL + SOON)
    assert KEEPALIVE < broken.at - cut < WILL + 1  # for a busy machine
    gateway.wait_for(len(gateway.told) + 100)
    between.cut = False
    heard.wait_for(online, 20, after=broken.at)
    count = len(gateway.told)
    heard.wait(lambda: len(changes(heard.of("events"))) >= count, 20)
    told = changes(heard.of("events"))
    assert told == list(range(1, len(told) + 1))
    eventually(lambda: all(shown(http, "robot0")["mode"] == "AUTO" for http in boards))
    time.sleep(KEEPALIVE * 2)
    assert heard.of("connection")[-1].text == "ONLINE"  # the will of the old connection does not come after it


def test_a_full_disk_loses_nothing_while_memory_holds(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with _small(disk) as full:
        at = broker()
        at.stop()
        gateway = feeder(at.url, "--rate", "100", "--changes", "900", "--seconds", "60", spool=disk / "s.sqlite")
        gateway.wait_for(100)
        full()
        gateway.wait_for(500)
        at.start()
        heard = listener(at.port)
        heard.wait(lambda: len(changes(heard.of("events"))) >= 900, 30)
        assert changes(heard.of("events")) == gateway.told
        assert gateway.end()["dropped"] == 0
        assert len([line for line in gateway.log if "takes no events" in line]) == 1, gateway.log


def test_a_gateway_that_is_killed_while_the_disk_is_full_leaves_its_events_all_the_same(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    with _small(disk, "2m") as full:
        at = broker()
        at.stop()
        killed = feeder(at.url, "--rate", "100", "--seconds", "60", spool=disk / "s.sqlite")
        killed.wait_for(100)
        full()
        killed.wait_for(500)
        killed.process.kill()
        killed.end()
        at.start()
        heard = listener(at.port)
        feeder(at.url, "--rate", "1", "--events", "0", "--seconds", "60", spool=disk / "s.sqlite")
        heard.wait(lambda: sessions(heard) and len(sessions(heard)[0]) >= len(killed.told), 20)
        assert sessions(heard)[0][: len(killed.told)] == killed.told
        assert any("takes no events" in line for line in killed.log), killed.log


def test_a_disk_that_hangs_does_not_hold_up_the_gateway(
    broker: Start, listener: Start, feeder: Start, tmp_path: Path
) -> None:
    with _freezable(tmp_path) as (disk, freeze):
        at = broker()
        heard = listener(at.port)
        gateway = feeder(at.url, "--rate", "100", "--changes", "400", "--seconds", "60", spool=disk / "s.sqlite")
        gateway.wait_for(100)
        freeze("-f")
        before = time.monotonic()
        gateway.wait_for(len(gateway.told) + 100)
        assert time.monotonic() - before < 2.0  # it goes on at its own rate
        freeze("-u")
        assert gateway.end()["dropped"] == 0
        heard.wait(lambda: changes(heard.of("events")) == gateway.told)
        assert len([line for line in gateway.log if "the disk took no event within" in line]) == 1, gateway.log


@contextlib.contextmanager
def _freezable(folder: Path) -> Iterator[tuple[Path, Callable[[str], object]]]:
    """A disk on which every write waits from `-f` to `-u`."""
    image, disk = folder / "image", folder / "disk"
    disk.mkdir()
    with image.open("wb") as file:
        file.truncate(20_000_000)
    for command in (["mkfs.ext4", "-q", str(image)], ["mount", "-o", "loop", str(image), str(disk)]):
        if shutil.which(command[0]) is None or subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip("mounting is not permitted here")
    freeze = functools.partial(subprocess.run, check=False, timeout=30)
    try:
        yield disk, lambda what: freeze(["fsfreeze", what, str(disk)])
    finally:
        freeze(["fsfreeze", "-u", str(disk)], capture_output=True)
        freeze(["umount", "-l", str(disk)])


@contextlib.contextmanager
def _small(folder: Path, size: str = "300k") -> Iterator[Callable[[], None]]:
    """A small disk; what is given fills it."""
    mount = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], capture_output=True)
    if mount.returncode:
        pytest.skip("mounting is not permitted here")

    def fill() -> None:
        with contextlib.suppress(OSError), open(folder / "rubbish", "wb", buffering=0) as file:
            while True:
                file.write(bytes(512))

    try:
        yield fill
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def test_what_is_too_much_is_dropped_from_the_oldest_on_and_counted(
    broker: Start, listener: Start, feeder: Start
) -> None:
    at = broker()
    at.stop()
    gateway = feeder(at.url, *("--rate", "100", "--changes", "400", "--seconds", "60", "--option", "spool_size=0.05"))
    gateway.wait_for(300)
    at.start()
    heard = listener(at.port)
    last = heard.wait_for(lambda h: h.what == "events" and '"new": 400}' in h.text, 20)
    told = changes(heard.of("events"))
    assert told == list(range(401 - len(told), 401))
    assert json.loads(last.text)["dropped"] == 400 - len(told) > 0
    assert gateway.end()["dropped"] == 400 - len(told)


# -- the board -------------------------------------------------------------------------------------------------------


def test_every_board_shows_a_robot_and_that_its_gateway_was_killed(
    broker: Start, board: Start, started: Start, autopilot: Start
) -> None:
    at = broker()
    boards = [board(at.url), board(at.url)]
    gateway = started(at.url)
    autopilot(ardurover.READY, gateway.address)
    eventually(lambda: all(shown(http, ROBOT)["mode"] in ("MANUAL", "AUTO") for http in boards))
    gateway.process.kill()
    killed = time.monotonic()
    eventually(lambda: all(shown(http, ROBOT)["link"]["state"] == "LOST" for http in boards), KEEPALIVE)
    assert time.monotonic() - killed < KEEPALIVE
    for line in (shown(http, ROBOT) for http in boards):
        assert (line["mode"], line["e_stopped"], line["in_error"]) == ("UNKNOWN", None, None)
        assert line["inhibits"][0]["text"] == "the gateway is gone"


def test_a_status_that_a_broker_kept_over_its_own_end_is_never_shown_as_current(
    broker: Start, board: Start, feeder: Start, listener: Start
) -> None:
    at = broker(memory=True)
    gateway = feeder(at.url, "--rate", "5", "--events", "0", "--option", "version=3.1.1")
    listener(at.port).wait_for(lambda h: h.what == "status")
    time.sleep(2.5)  # the broker saves what it keeps
    at.stop(kill=True)  # so that nobody says the will
    gateway.process.kill()
    at.start()
    kept = {h.what: h.text for h in _retained(listener, at.port)}
    assert kept["connection"] == "ONLINE"
    assert json.loads(kept["status"])["mode"] == "AUTO"
    http = board(at.url)
    line = eventually(lambda: (it := shown(http, "robot0"))["link"]["state"] and it)
    assert (line["link"]["state"], line["mode"]) == ("LOST", "UNKNOWN")


def test_a_board_beyond_a_bridge_shows_what_is_so_and_doubts_it_when_the_bridge_is_down(
    broker: Start, board: Start, feeder: Start
) -> None:
    near = broker()
    far = broker(
        *("connection bridge", f"address 127.0.0.1:{near.port}", f"topic {PREFIX}/# in 1"),
        *("restart_timeout 1", "keepalive_interval 5", "remote_clientid bridge"),
    )
    http = board(far.url)
    feeder(near.url, "--rate", "5", "--seconds", "60")
    eventually(lambda: shown(http, "robot0")["mode"] == "AUTO", 15)
    near.stop(kill=True)
    eventually(lambda: shown(http, "robot0")["mode"] == "UNKNOWN", KEEPALIVE + 2)
    near.start()
    eventually(lambda: shown(http, "robot0")["mode"] == "AUTO", 40)


def test_a_board_without_its_broker_says_so(broker: Start, board: Start, feeder: Start) -> None:
    at = broker()
    http = board(at.url)
    feeder(at.url, "--rate", "5", "--seconds", "60")
    eventually(lambda: shown(http, "robot0")["mode"] == "AUTO")
    at.stop(kill=True)
    eventually(lambda: shown(http, "robot0")["mode"] == "UNKNOWN", KEEPALIVE + 2)


def test_a_board_that_hears_nobody_says_once_why_that_may_be(broker: Start, gateway: Start, tmp_path: Path) -> None:
    rights = tmp_path / "rights"
    rights.write_text("topic read elsewhere\n")
    at = broker(f"acl_file {rights}")  # mosquitto lets us subscribe all the same, and passes on nothing
    shown = gateway("board", at.url, "--http", f"127.0.0.1:{free_port()}")
    shown.wait_for_log(f"nothing below {PREFIX}/ so far: is no gateway there, or may we not read it")
    time.sleep(1)
    assert len([line for line in shown.log if "so far" in line]) == 1


def test_two_hundred_robots_on_one_board(tmp_path: Path) -> None:
    found = measure(200, 2, 4.0, tmp_path)
    assert (found["live_on_the_board"], found["events_missing"]) == (200, 0)
    assert found["events_on_the_board"] == found["events_told"]
    assert found["board_cpu_percent"] < 50


# -- what a person has to put right ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lines", "more", "says"),
    [
        pytest.param(["secure"], ["--mqtt-user", "rover", "--mqtt-password-file", "WRONG"], "refuses", id="password"),
        pytest.param(["tls"], ["--mqtt-ca", "other.pem"], "certificate is not believed", id="another CA"),
        pytest.param(["expired"], ["--mqtt-ca", "ca.pem"], "certificate has expired", id="expired"),
        pytest.param(["mutual"], ["--mqtt-ca", "ca.pem"], "client certificate", id="no client certificate"),
        pytest.param(["forbidden"], [], "may not do what is asked", id="forbidden will"),
        pytest.param(["no events"], [], "does not let us publish", id="forbidden events"),
        pytest.param(["plain"], ["--mqtt-ca", "ca.pem"], "does it speak TLS on this port", id="no TLS"),
        pytest.param(["nobody"], [], "Connection refused", id="no broker"),
    ],
)
def test_what_is_wrong_is_one_line_and_tried_again_without_hurry(
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
    gateway = started(at.tls_url if secure else at.url, "--system", "1", *(files.get(word, word) for word in more))
    gateway.wait_for_log(says)
    used, tried = gateway.cpu(), log.read_text().count(" connection from ")
    time.sleep(4)
    assert gateway.cpu() - used < 0.5
    assert lines == ["nobody"] or 1 <= log.read_text().count(" connection from ") - tried <= 3  # after 1 s, 2 s, ...
    complaints = [line for line in gateway.log if "trying again" in line]
    assert len(complaints) == 1, gateway.log
    assert "swordfish" not in "".join(gateway.log)
    assert gateway.stop() == 0
    assert "Traceback" not in "".join(gateway.log)


def test_two_gateways_that_publish_one_robot_are_told(broker: Start, feeder: Start, tmp_path: Path) -> None:
    at = broker()
    first = feeder(at.url, "--rate", "5", "--seconds", "60")
    first.wait_for(3)
    feeder(at.url, "--rate", "5", "--seconds", "60", spool=tmp_path / "other.sqlite")
    eventually(lambda: any("does another gateway publish the same robot" in line for line in first.log))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--mqtt", "mqtts://rover:swordfish@broker/robots"], "no user or password in the URL"),
        (["--mqtt", "http://broker/robots"], "is no broker; write mqtts://"),
        (["--mqtt", "mqtts://broker"], "names no prefix"),
        (["--mqtt-user", "rover"], "add --mqtt mqtts://broker/prefix"),
        (["--mqtt", "mqtt://127.0.0.1/robots", "--mqtt-robot", "{color}"], r"it may hold \{system\}"),
        (["--mqtt", "mqtts://127.0.0.1/robots", "--mqtt-ca", "/nowhere.pem"], "No such file"),
        (["--mqtt", "mqtt://127.0.0.1/robots", "--mqtt-spool", "/proc/x/s"], "events cannot wait in /proc/x/s"),
    ],
)
def test_a_fault_on_the_command_line_is_one_line(arguments: list[str], says: str) -> None:
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
