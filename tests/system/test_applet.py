"""The applet with the installed command: it writes the script, and reads what a vehicle with the applet reports."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, Scenario, arducopter, ardurover, ardusub, px4, with_applet

from ..deadline import Deadline
from .gateway_process import Gateway, run

SCRIPT = (Path(__file__).parents[2] / "contrib" / "ardupilot" / "robot_status.lua").read_text("utf-8")
PAGE = "docs/ardupilot-applet.md"


def armed(scenario: Scenario) -> Scenario:
    """The same vehicle, armed and at rest: without the applet its e_stopped is UNKNOWN."""
    return scenario._replace(start=scenario.start._replace(armed=True))


@pytest.fixture
def vehicle(ended: ExitStack) -> Callable[[Scenario], FakeAutopilot]:
    """Start a vehicle that waits for a connection."""
    return lambda scenario: ended.enter_context(FakeAutopilot(scenario))


def connection(vehicle: FakeAutopilot) -> str:
    host, port = vehicle.address
    return f"udpout:{host}:{port}"


def found(command: str, vehicle: FakeAutopilot, wanted: Callable[[Any], bool]) -> Any:
    """What a command finds out as JSON. On a slow machine it may hear too little, and is run again."""
    deadline = Deadline(30)
    while True:
        done = run(command, "-q", "--as-json", connection(vehicle))
        assert "Traceback" not in done.stderr, done.stderr
        report = json.loads(done.stdout) if done.stdout else None
        if report and wanted(report):
            return report
        assert deadline.left, done


# -- the script --------------------------------------------------------------------------------------------------------


def test_the_command_writes_the_script_to_standard_output() -> None:
    done = run("applet")
    assert (done.returncode, done.stdout, done.stderr) == (0, SCRIPT, "")


def test_the_command_writes_the_script_to_a_file_and_prints_its_name(tmp_path: Path) -> None:
    file = tmp_path / "robot_status.lua"
    done = run("applet", "-o", str(file))
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{file}\n", "")
    assert file.read_text("utf-8") == SCRIPT


def test_a_file_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    done = run("applet", "-o", str(tmp_path / "missing" / "robot_status.lua"))
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.splitlines() == [
        f"mav-robot-status: cannot write {tmp_path}/missing/robot_status.lua: No such file or directory"
    ]


# -- doctor ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scenario", [ardurover.READY, arducopter.READY, ardusub.READY], ids=lambda s: s.firmware.name)
def test_doctor_hears_the_applet_on_a_link(vehicle: Callable[[Scenario], FakeAutopilot], scenario: Scenario) -> None:
    stopped = vehicle(with_applet(armed(scenario)))
    stopped.set(emergency_stop=True, safety_switch=True)
    report = found("doctor", stopped, lambda report: report["speakers"][0]["applet"])
    applet = report["speakers"][0]["applet"]
    assert applet["value"] == 3
    assert 0 <= applet["age"] <= 3
    assert "applet: RS_STOP 3, the emergency stop is engaged, the safety switch is on" in report["found"]
    assert PAGE not in report["next"]


def test_doctor_names_the_applet_for_an_ardupilot_with_an_unknown_stop(
    vehicle: Callable[[Scenario], FakeAutopilot],
) -> None:
    report = found("doctor", vehicle(armed(ardurover.READY)), lambda report: report["cause"] == "ok")
    assert report["speakers"][0]["applet"] is None
    assert report["speakers"][0]["status"]["e_stopped"] is None
    assert any(line.startswith("applet: not heard") for line in report["found"])
    assert report["next"].startswith("mav-robot-status udpout:")
    assert PAGE in report["next"]


def test_doctor_does_not_name_the_applet_for_an_autopilot_that_cannot_run_it(
    vehicle: Callable[[Scenario], FakeAutopilot],
) -> None:
    report = found("doctor", vehicle(px4.READY), lambda report: report["cause"] == "ok")
    assert "applet" not in " ".join([*report["found"], report["next"]])


# -- the status --------------------------------------------------------------------------------------------------------


def test_the_applet_makes_e_stopped_known_while_it_reports(
    vehicle: Callable[[Scenario], FakeAutopilot], gateway: Callable[..., Gateway]
) -> None:
    rover = vehicle(with_applet(armed(ardurover.READY)))
    gate = gateway(connection(rover))
    free = gate.wait_for(lambda s: s["drives_powered"] is True and s["e_stopped"] is False)
    rover.set(emergency_stop=True)
    stopped = gate.wait_for(lambda s: s["e_stopped"] is True, free.at)
    assert (stopped.status["drives_powered"], stopped.status["motion_possible"]) == (False, False)
    rover.set(emergency_stop=False)
    released = gate.wait_for(lambda s: s["e_stopped"] is False, stopped.at)
    assert released.status["drives_powered"] is True
    rover.set(applet=False)
    silent = gate.wait_for(lambda s: s["e_stopped"] is None, released.at)
    assert silent.at - released.at >= 2
    gate.wait_for_log("applet")


@pytest.mark.slow
def test_explain_names_the_applet_as_the_evidence(vehicle: Callable[[Scenario], FakeAutopilot]) -> None:
    rover = vehicle(with_applet(armed(ardurover.READY)))
    rover.set(emergency_stop=True)
    report = found("explain", rover, lambda report: report["fields"]["e_stopped"]["value"] is True)
    why = report["fields"]["e_stopped"]
    assert why["rule"] == "the applet on the autopilot says so"
    assert "RS_STOP" in why["source"]
    assert report["applet"]["value"] == 1


@pytest.mark.slow
def test_explain_says_that_the_applet_is_not_heard(vehicle: Callable[[Scenario], FakeAutopilot]) -> None:
    report = found("explain", vehicle(armed(ardurover.READY)), lambda report: "applet" in report)
    assert report["applet"] is None
