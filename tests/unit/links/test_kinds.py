"""Kinds of links from other packages, found by their entry points."""

import errno
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.links import Link, LinkError, Url, kinds, open_link
from mav_robot_status.links.kinds import BY_SCHEME, GROUP
from mav_robot_status.links.url import help_text, parse
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

from .custom_link import UnixPeer

ROOT = Path(__file__).parents[3]
HEARTBEAT = Heartbeat(custom_mode=0, type=10, autopilot=3, base_mode=65, system_status=4, mavlink_version=3)


@pytest.fixture(autouse=True)
def _installed(unix_kind: Path) -> None: ...


def test_an_installed_scheme_is_read_and_opened(tmp_path: Path) -> None:
    url = parse(f"unixgram:{tmp_path}/x")
    assert (url.kind.name, url.device, url.words()) == ("unixgram", f"{tmp_path}/x", f"unix datagrams at {tmp_path}/x")
    link = open_link(url)
    assert link.fileno() >= 0
    link.close()


def test_a_system_error_while_opening_is_one_line() -> None:
    def refuse(url: Url) -> Link:
        raise OSError(errno.EACCES, "Permission denied")

    url = parse("unixgram:/run/mavlink")
    with pytest.raises(LinkError, match=r"^unixgram:/run/mavlink: Permission denied$"):
        open_link(url._replace(kind=url.kind._replace(opener=refuse)))


def test_an_installed_scheme_is_in_the_help_and_in_the_hints() -> None:
    assert "unixgram:PATH" in help_text()
    with pytest.raises(UsageError, match=r"unknown connection type unixgrm:; did you mean unixgram: \?"):
        parse("unixgrm:/x")


@pytest.mark.parametrize(
    ("scheme", "problem"),
    [
        ("broken", "cannot load the link 'broken' .unix_link_that_is_not_there:X.: No module"),
        ("wrong", "not a LinkKind"),
    ],
)
def test_a_package_that_cannot_be_loaded_is_named(scheme: str, problem: str) -> None:
    with pytest.raises(UsageError, match=problem):
        parse(f"{scheme}:x")


def test_our_schemes_need_no_search_through_packages() -> None:
    program = (
        "import sys; from mav_robot_status.links.url import parse\n"
        "for text in ('udp:127.0.0.1:1', 'tcp:a:1', '/dev/ttyS0', 'x.tlog', '10.0.0.1:1'): parse(text)\n"
        "sys.exit('importlib.metadata' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], timeout=60).returncode == 0


def test_our_entry_points_equal_our_table() -> None:
    project = (ROOT / "pyproject.toml").read_text()
    section = project.partition(f'[project.entry-points."{GROUP}"]')[2].partition("\n\n")[0]
    points = re.findall(r'^(\w+) = "mav_robot_status\.links\.kinds:(\w+)"$', section, re.MULTILINE)
    assert {scheme: getattr(kinds, name) for scheme, name in points} == BY_SCHEME


@pytest.fixture
def gateway(unix_kind: Path, tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-m", "mav_robot_status.cli", f"unixgram:{tmp_path / 'link'}"]
    environment = {"PYTHONPATH": f"{ROOT}:{unix_kind}"}
    process = subprocess.Popen(
        command, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path
    )
    yield process
    process.terminate()
    process.communicate(timeout=30)


def test_the_gateway_runs_on_an_installed_link(gateway: "subprocess.Popen[str]", tmp_path: Path) -> None:
    assert gateway.stderr
    assert gateway.stdout
    assert any("unix datagrams at" in line for line in iter(gateway.stderr.readline, ""))
    peer = UnixPeer(tmp_path)
    peer.connect()
    peer.send(encode(HEARTBEAT, system=1, component=1, sequence=0))
    line = json.loads(gateway.stdout.readline())
    assert (line["vehicle"]["autopilot"], line["link"]["state"]) == ("ARDUPILOTMEGA", "CONNECTED")
    assert peer.receive()[:1] == b"\xfd"  # the gateway's own heartbeat
    peer.disconnect()
