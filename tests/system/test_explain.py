"""`explain` with the installed command: it names the deciding evidence, and ends by itself on a live link."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status import cli
from mav_robot_status.diagnosis.explain import ANSWERS, LISTEN
from mav_robot_status.interface import STATES
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import FakeAutopilot, ardurover

from ..deadline import SOON
from .gateway_process import Gateway, run

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / "tests" / "recorded" / "logs"
ARMED_OUTPUTS = "SERVO_OUTPUT_RAW 1: 1574 us, 2: 1574 us, 3: 1579 us, 4: 1579 us (assumed motor channels)"
HELD_OUTPUTS = "SERVO_OUTPUT_RAW 1: 1000 us, 2: 1000 us, 3: 1000 us, 4: 1000 us (assumed motor channels)"
HELD = "motor outputs held at their stop value while throttle is demanded"
HIDDEN = "ArduPilot does not show an emergency stop in HEARTBEAT, SYS_STATUS or texts alone"

COPTER_STOP = "arducopter-4.5.6-estop"
DENIED = "ardurover-4.5.6-arm-denied"
GCS = "arducopter-4.7.0-dev-90700977c5-fs-gcs"
BATTERY = "ardurover-4.7.0-dev-90700977c5-fs-battery"
PX4_RC = "px4-quad-1.17dev-aa850d5c1c-fs-rc"
REBOOT = "arducopter-4.7.0-dev-90700977c5-reboot"

# recording, moment, field, value, rule, source
DECIDED = [
    # the stop is engaged at 19:24:14.45 and released at 19:24:22.47
    (COPTER_STOP, "19:24:12", "e_stopped", False, "a motor output is off its stop value", ARMED_OUTPUTS),
    (COPTER_STOP, "19:24:16.500", "e_stopped", True, HELD, HELD_OUTPUTS),
    (COPTER_STOP, "19:24:16.500", "drives_powered", False, f"e_stopped: {HELD}", HELD_OUTPUTS),
    (
        *(COPTER_STOP, "19:24:24", "e_stopped", False),
        *("the pre-arm checks, which include the stop, pass", "SYS_STATUS: PREARM_CHECK"),
    ),
    # the safety switch is on from 19:00:38.94 to 19:00:43.96
    (
        *(DENIED, "19:00:29", "e_stopped", True),
        *("the autopilot said so", "STATUSTEXT: Arm: Motors Emergency Stopped"),
    ),
    (
        *(DENIED, "19:00:43", "e_stopped", True),
        *("safety switch engaged", "SYS_STATUS: MOTOR_OUTPUTS present, not enabled"),
    ),
    (DENIED, "19:00:56", "e_stopped", None, HIDDEN, None),
    (DENIED, "19:01:11", "in_error", True, "3002 SENSOR_3D_MAG", "SYS_STATUS: 3D_MAG enabled, unhealthy"),
    # the ground station falls silent at 19:06:42.54 and is back at 19:06:57.54
    (GCS, "19:06:40", "in_error", False, "no cause is active", "SYS_STATUS"),
    (GCS, "19:06:52", "in_error", True, "2002 GCS_LOST", "STATUSTEXT: GCS Failsafe"),
    (GCS, "19:07:02", "in_error", False, "no cause is active", "SYS_STATUS"),
    # the voltage is low from 19:15:42.96, critical from 19:15:56.98
    (BATTERY, "19:15:40", "in_error", False, "no cause is active", "SYS_STATUS"),
    (
        *(BATTERY, "19:15:50", "in_error", True),
        *("2003 BATTERY_LOW", "STATUSTEXT: Battery 1 is low 11.02V used 28 mAh"),
    ),
    (
        *(BATTERY, "19:16:05", "in_error", True),
        *("2004 BATTERY_CRITICAL", "STATUSTEXT: Battery 1 is critical 10.30V used 28 mAh"),
    ),
    # the joystick falls silent at 19:06:02.89; PX4's text does not say why there is a failsafe, its event does
    (PX4_RC, "19:06:02", "in_error", False, "no cause is active", "SYS_STATUS"),
    (
        *(PX4_RC, "19:06:07", "in_error", True),
        *("2001 RC_LOST", "EVENT 0x1d11df6"),
    ),
    # the reboot is accepted at 19:12:53.48; SYS_STATUS comes again when it is asked for, at 19:13:05.5
    (REBOOT, "19:12:52", "in_error", False, "no cause is active", "SYS_STATUS"),
    (REBOOT, "19:12:55", "in_error", None, "no fresh SYS_STATUS", None),
    (REBOOT, "19:12:55", "in_motion", None, "no fresh speed", None),
    (REBOOT, "19:13:10", "in_error", False, "no cause is active", "SYS_STATUS"),
]

# recording, moment, list, names and texts
LISTED = [
    (COPTER_STOP, "19:24:16.500", "inhibits", [("E_STOPPED", None)]),
    (
        *(DENIED, "19:00:43", "inhibits"),
        [
            ("DISARMED", None),
            ("E_STOPPED", None),
            ("SAFETY_SWITCH", None),
            ("PREARM_FAILING", "Arm: Hardware safety switch"),
            ("PREARM_FAILING", "Arm: Check mag field (xy diff:171>100)"),
        ],
    ),
    (DENIED, "19:00:56", "inhibits", [("DISARMED", None), ("PREARM_FAILING", "PreArm: GPS 1: Bad fix")]),
    (GCS, "19:06:52", "errors", [("GCS_LOST", "GCS Failsafe")]),
    (
        *(BATTERY, "19:15:50", "errors"),
        [("BATTERY_LOW", "Battery 1 is low 11.02V used 28 mAh"), ("SENSOR_BATTERY", None)],
    ),
    (
        *(REBOOT, "19:12:55", "inhibits"),
        [("DISARMED", None), ("INITIALISING", None), ("SYS_STATUS_MISSING", None)],
    ),
]


def log(name: str) -> str:
    return str(RECORDINGS / f"{name}.tlog")


@pytest.fixture(scope="module")
def explained() -> Callable[[str, str], dict[str, Any]]:
    """The explanation of a recording at a time of its day, 20 November 2026; each is asked for once."""
    known: dict[tuple[str, str], dict[str, Any]] = {}

    def ask(name: str, time_of_day: str) -> dict[str, Any]:
        if (name, time_of_day) not in known:
            done = run("explain", "-q", log(name), "--at", f"2026-11-20T{time_of_day}Z", "--as-json")
            assert (done.returncode, done.stderr) == (0, "")
            known[name, time_of_day] = json.loads(done.stdout)
        return known[name, time_of_day]

    return ask


@pytest.mark.parametrize(("name", "at", "field", "value", "rule", "source"), DECIDED)
def test_the_deciding_evidence_is_named(
    explained: Callable[[str, str], dict[str, Any]],
    name: str,
    at: str,
    field: str,
    value: bool | None,
    rule: str,
    source: str | None,
) -> None:
    found = explained(name, at)["fields"][field]
    assert (found["value"], found["rule"], found["source"]) == (value, rule, source)
    assert (found["age"] is None) == (source is None)


@pytest.mark.parametrize(("name", "at", "member", "expected"), LISTED)
def test_causes_and_reasons_are_listed_with_their_texts(
    explained: Callable[[str, str], dict[str, Any]],
    name: str,
    at: str,
    member: str,
    expected: list[tuple[str, str | None]],
) -> None:
    assert [(one["name"], one["text"]) for one in explained(name, at)[member]] == expected


def test_a_recording_is_explained_at_seconds_from_its_start_and_by_default_at_its_end() -> None:
    at_44 = json.loads(run("explain", "-q", log("ardurover-4.5.6-auto"), "--at", "+44", "--as-json").stdout)
    at_end = json.loads(run("explain", "-q", log("ardurover-4.5.6-auto"), "--as-json").stdout)
    assert (at_44["stamp"], at_44["vehicle"]["flight_mode"]) == ("2026-11-20T19:10:42.832789Z", "MANUAL")
    assert (at_end["stamp"], at_end["vehicle"]["flight_mode"]) == ("2026-11-20T19:11:34.876474Z", "AUTO")


@pytest.mark.parametrize(
    ("at", "message"),
    [
        ("nonsense", "write a time like 2026-11-20T19:09:58.832789Z, or +44 for seconds from the start"),
        ("+inf", "write a time like 2026-11-20T19:09:58.832789Z, or +44 for seconds from the start"),
        ("2026-11-20T19:00:00Z", "the log begins at 2026-11-20T19:09:58.832789Z"),
        ("+9999", "the log ends at 2026-11-20T19:11:34.876474Z"),
    ],
)
def test_a_time_outside_the_log_is_one_line_and_exit_code_2(at: str, message: str) -> None:
    done = run("explain", "-q", log("ardurover-4.5.6-auto"), "--at", at)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"mav-robot-status: --at {at}: {message}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no connection given"),
        (("udpin:127.0.0.1:0", "--at", "+4"), "--at is a moment of a recorded log"),
        (("nowhere.tlog",), "cannot read the log"),
    ],
)
def test_wrong_arguments_are_one_line_and_exit_code_2(arguments: tuple[str, ...], message: str) -> None:
    done = run("explain", "-q", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert message in done.stderr


def test_a_log_without_an_autopilot_is_one_line_and_exit_code_1(tmp_path: Path) -> None:
    path = tmp_path / "gcs.tlog"
    ground_station = encode(Heartbeat(0, 6, 8, 192, 4, 3), system=255, component=190, sequence=0)
    path.write_bytes((1_800_000_000_000_000).to_bytes(8, "big") + ground_station)
    done = run("explain", "-q", str(path))
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "mav-robot-status: no autopilot was heard, so there is nothing to explain\n"


# -- live --------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_live_vehicle_is_explained_and_the_command_ends_by_itself(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("explain", "udpin:127.0.0.1:0", "--as-json")
    begun = time.monotonic()
    autopilot(ardurover.READY, gate.address)
    assert gate.wait_for_end(ANSWERS + SOON) == 0
    assert time.monotonic() - begun >= LISTEN
    (line,) = gate.lines
    assert line.status["vehicle"]["type"] == "GROUND_ROVER"
    assert line.status["link"]["state"] == "CONNECTED"
    assert list(line.status["fields"]) == [field.name for field in STATES]
    assert line.status["fields"]["drives_powered"]["rule"] == "disarmed"
    assert line.status["fields"]["in_error"]["rule"] == "no cause is active"
    assert not any("Traceback" in text for text in gate.log)


@pytest.fixture
def signals() -> Iterator[None]:
    """The command sets handlers of its own; in this process they are put back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("signals")
def test_without_an_autopilot_it_is_one_line_and_exit_code_1(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("mav_robot_status.diagnosis.explain.PATIENCE", 0.1)
    assert cli.main(["explain", "-q", "udpin:127.0.0.1:0"]) == 1
    out, err = capfd.readouterr()
    assert (out, err) == ("", "mav-robot-status: no autopilot was heard, so there is nothing to explain\n")


# -- the document ------------------------------------------------------------------------------------------------------


def test_the_example_of_the_document_is_the_output_of_the_command() -> None:
    text = (ROOT / "docs" / "how-to" / "explain.md").read_text("utf-8")
    command, *shown = text.partition("```text\n$ mav-robot-status ")[2].partition("```")[0].splitlines()
    assert shown
    done = run(*command.split(), "-q", cwd=ROOT)
    assert done.stdout.splitlines() == shown
