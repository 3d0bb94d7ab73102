"""`/metrics` of the installed command, read by promtool and by a real Prometheus."""

from __future__ import annotations

import json
import os
import pathlib
import re
import shutil
import subprocess
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import pytest

from mav_robot_status.publishers.metrics import CONNECTION, CONTENT_TYPE, GATEWAY, PREFIX, PUBLISHER, VEHICLE
from tests.pymavlink_dialect import MAVLink_statustext_message

from ..deadline import SOON, Deadline, allow, in_time
from ..ports import free_port
from .gateway_process import Gateway
from .wire import Wire

ROOT = pathlib.Path(__file__).parents[2]
CONTRIB = ROOT / "contrib"
FAMILIES = {PREFIX + family.name for family in (*GATEWAY, *VEHICLE, *CONNECTION, *PUBLISHER)}
PATH = f"{ROOT / 'build' / 'prometheus' / 'usr' / 'bin'}:{os.environ['PATH']}"
PROMTOOL, PROMETHEUS = (shutil.which(name, path=PATH) or "" for name in ("promtool", "prometheus"))
GET = "is not installed: apt-get install prometheus, or .ci/run unpacks it in build/prometheus"
needs_promtool = pytest.mark.skipif(not PROMTOOL, reason=f"promtool {GET}")
needs_prometheus = pytest.mark.skipif(not PROMETHEUS, reason=f"prometheus {GET}")
PAGE = ("udpin:127.0.0.1:0", "--json", "none", "--http", "127.0.0.1:0")

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


def promtool(*arguments: str, given: str | None = None) -> None:
    done = subprocess.run([PROMTOOL, *arguments], input=given, capture_output=True, text=True, timeout=allow(30))
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr


def address(gate: Gateway) -> str:
    return gate.wait_for_log(r"the page is at (http://\S+)/")[1]


def scrape(gate: Gateway, **headers: str) -> str:
    asked = urllib.request.Request(f"{address(gate)}/metrics", headers=headers)
    with urllib.request.urlopen(asked, timeout=allow(SOON)) as answer:
        assert answer.headers["Content-Type"] == CONTENT_TYPE
        return str(answer.read().decode())


def until(gate: Gateway, pattern: str) -> str:
    """The metrics as soon as a line matches."""
    deadline = Deadline()
    while not re.search(pattern, text := scrape(gate), re.MULTILINE):
        assert deadline.left, text
        time.sleep(0.05)
    return text


def in_error(wire: OpenWire, gate: Gateway) -> Wire:
    """A rover that drives and then crashes."""
    rover = wire(gate.address)
    rover.beat(armed=True, custom_mode=10)
    rover.beating()
    rover.send(MAVLink_statustext_message(2, b"Crash: Disarming", 0, 0))
    return rover


# -- what is shipped -------------------------------------------------------------------------------------------------


@needs_promtool
def test_the_alerts_are_valid_and_pass_their_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CONTRIB / "prometheus")
    promtool("check", "rules", "alerts.yml")
    promtool("test", "rules", "alerts_test.yml")
    promtool("check", "config", "prometheus.yml")


def test_every_alert_has_a_test() -> None:
    alerts = re.findall(r"alert: (\w+)", (CONTRIB / "prometheus" / "alerts.yml").read_text())
    assert set(alerts) == set(re.findall(r"alertname: (\w+)", (CONTRIB / "prometheus" / "alerts_test.yml").read_text()))


def dashboard() -> dict[str, Any]:
    text = (CONTRIB / "grafana" / "mav-robot-status.json").read_text()
    return json.loads(text)  # type: ignore[no-any-return]


def expressions() -> list[str]:
    """What the dashboard asks for, with everything chosen."""
    found = [target["expr"] for panel in dashboard()["panels"] for target in panel["targets"]]
    variables = {"$instance": ".*", "$handle": ".*", "$__rate_interval": "5s"}
    for name, value in variables.items():
        found = [expression.replace(name, value) for expression in found]
    return found


def test_dashboard_and_alerts_use_existing_metrics_only() -> None:
    asked = " ".join(expressions()) + (CONTRIB / "prometheus" / "alerts.yml").read_text()
    assert set(re.findall(rf"{PREFIX}\w+", asked)) <= FAMILIES


def test_the_panels_of_the_dashboard_do_not_overlap() -> None:
    taken: set[tuple[int, int]] = set()
    for panel in dashboard()["panels"]:
        at = panel["gridPos"]
        cells = {(x, y) for x in range(at["x"], at["x"] + at["w"]) for y in range(at["y"], at["y"] + at["h"])}
        assert not cells & taken, panel["title"]
        assert at["x"] + at["w"] <= 24
        taken |= cells


# -- the installed command -------------------------------------------------------------------------------------------


def test_the_metrics_follow_a_vehicle_through_an_error_and_a_loss(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway(*PAGE)
    assert "link_up" not in scrape(gate), "nothing was heard, so there is nothing to tell"
    rover = in_error(wire, gate)
    text = until(gate, r'^mav_robot_status_error\{handle=".*",system="1",component="1",code="4001",cause="CRASH"\} 1$')
    for line in ("mode{0} 2", "drives_powered{0} 1", "in_error{0} 1", "error_code{0} 4001", "link_up{0} 1"):
        labels = '{handle="industrial_robot_status_handle",system="1",component="1"}'
        assert PREFIX + line.format(labels) in text.splitlines()
    age = re.search(r"^mav_robot_status_heartbeat_age_seconds\S+ (\S+)$", text, re.MULTILINE)
    assert age
    assert float(age[1]) >= 0
    assert in_time(float(age[1]), 1)
    rover.beating(False)
    text = until(gate, r"^mav_robot_status_link_up\S+ 0$")
    assert re.search(r"^mav_robot_status_drives_powered\S+ -1$", text, re.MULTILINE)


def test_damaged_frames_are_counted_by_message(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway(*PAGE)
    rover = wire(gate.address)
    rover.beat()
    good = MAVLink_statustext_message(6, b"hello", 0, 0).pack(rover.mav)
    for _ in range(3):
        rover.send(good[:-1] + bytes([good[-1] ^ 1]))
    rover.send(b"no MAVLink")
    rover.beat()
    series = r'\{connection="udpin:127.0.0.1:0",role="vehicle"'
    until(gate, rf'^mav_robot_status_connection_crc_errors_total{series},message_id="253"\}} 3$')
    until(gate, rf"^mav_robot_status_connection_garbage_bytes_total{series}\}} [1-9]")
    until(gate, rf"^mav_robot_status_connection_frames_total{series}\}} 2$")


def test_a_reader_of_json_lines_that_does_not_read_causes_counted_drops(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--rate", "1000", "--http", "127.0.0.1:0", reads=False)
    wire(gate.address).beating()
    until(gate, r'^mav_robot_status_publisher_dropped_messages_total\{publisher="json",number="1"\} [1-9]')


def test_without_the_token_there_are_no_metrics(gateway: StartGateway, tmp_path: pathlib.Path) -> None:
    token = tmp_path / "token"
    token.write_text("0123456789abcdef\n")
    token.chmod(0o600)
    gate = gateway(*PAGE, "--http-token-file", str(token))
    with pytest.raises(urllib.error.HTTPError) as refused:
        scrape(gate)
    refused.value.close()
    assert refused.value.code == 401
    assert "mav_robot_status_build_info" in scrape(gate, Authorization="Bearer 0123456789abcdef")


def test_a_demo_has_metrics_too(gateway: StartGateway) -> None:
    gate = gateway("demo", "--http", "127.0.0.1:0")
    until(gate, r"^mav_robot_status_link_up\S+ 1$")


@needs_promtool
def test_promtool_accepts_the_metrics(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway(*PAGE)
    in_error(wire, gate)
    promtool("check", "metrics", given=until(gate, "^mav_robot_status_error{"))


# -- Prometheus ------------------------------------------------------------------------------------------------------


class Prometheus:
    """A Prometheus with the shipped configuration and shorter intervals."""

    def __init__(self, folder: pathlib.Path, target: str) -> None:
        config = (CONTRIB / "prometheus" / "prometheus.yml").read_text()
        config = config.replace("127.0.0.1:8765", target).replace("scrape_interval: 5s", "scrape_interval: 500ms")
        (folder / "prometheus.yml").write_text("global: {evaluation_interval: 500ms}\n" + config)
        shutil.copy(CONTRIB / "prometheus" / "alerts.yml", folder)
        self.address = f"127.0.0.1:{free_port()}"
        command = [PROMETHEUS, "--config.file=prometheus.yml", f"--storage.tsdb.path={folder / 'data'}"]
        with (folder / "log").open("wb") as log:
            self.process = subprocess.Popen(
                [*command, f"--web.listen-address={self.address}"], cwd=folder, stdout=log, stderr=log
            )

    def ask(self, query: str) -> list[Any]:
        """The series of an expression now. Raises HTTPError if it is not an expression."""
        url = f"http://{self.address}/api/v1/query?{urllib.parse.urlencode({'query': query})}"
        with urllib.request.urlopen(url, timeout=allow(SOON)) as answer:
            return json.loads(answer.read())["data"]["result"]  # type: ignore[no-any-return]

    def wait_for(self, query: str, wanted: Callable[[list[Any]], bool]) -> list[Any]:
        deadline = Deadline(30)
        found: list[Any] = []
        while True:
            try:
                found = self.ask(query)
                if wanted(found):
                    return found
            except urllib.error.HTTPError as error:  # it starts
                error.close()
            except OSError:
                pass
            assert deadline.left, (query, found)
            time.sleep(0.1)

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(allow(SOON))


def values(found: list[Any]) -> list[str]:
    return [series["value"][1] for series in found]


@pytest.mark.slow
@needs_prometheus
def test_prometheus_scrapes_alerts_and_drops_old_series(
    gateway: StartGateway, wire: OpenWire, tmp_path: pathlib.Path, ended: ExitStack
) -> None:
    gate = gateway(*PAGE)
    rover = in_error(wire, gate)
    prometheus = Prometheus(tmp_path, address(gate).removeprefix("http://"))
    ended.callback(prometheus.close)

    prometheus.wait_for("mav_robot_status_link_up", lambda found: values(found) == ["1"])
    [cause] = prometheus.wait_for("mav_robot_status_error", bool)
    assert cause["metric"]["cause"] == "CRASH"
    rate = "rate(mav_robot_status_connection_frames_total[5s])"
    prometheus.wait_for(rate, lambda found: any(float(value) > 1 for value in values(found)))
    prometheus.wait_for('ALERTS{alertname="VehicleInError",alertstate="firing"}', bool)
    for expression in expressions():
        prometheus.ask(expression)  # raises if it is none
    assert len([expression for expression in expressions() if prometheus.ask(expression)]) > 12

    rover.beating(False)
    prometheus.wait_for("mav_robot_status_link_up", lambda found: values(found) == ["0"])
    prometheus.wait_for("mav_robot_status_drives_powered", lambda found: values(found) == ["-1"])
    prometheus.wait_for('ALERTS{alertname="VehicleLinkLost"}', bool)

    gate.stop()
    prometheus.wait_for('up{job="mav-robot-status"}', lambda found: values(found) == ["0"])
    prometheus.wait_for("mav_robot_status_link_up", lambda found: not found)
