"""The table of an arm's causes: what each finding means, and that every row can be reached."""

from __future__ import annotations

import json
import socket
import threading

import pytest

from mav_robot_status.config import Config, HardwareConfig
from mav_robot_status.diagnosis.doctor.arm_diagnosis import (
    ARM_CASES,
    ArmFindings,
    arm_as_json,
    arm_as_text,
    diagnose_arm,
)
from mav_robot_status.diagnosis.doctor.arms import RtdeTalk, StatusTalk, ask_again, examine_arm
from mav_robot_status.errors import UsageError
from mav_robot_status.interface import RobotMode, RobotStatus, TriState
from mav_robot_status.simple_message import StatusEncoder
from mav_robot_status.testing.fake_arm import FakeArm

STATUS = RobotStatus(RobotMode.AUTO, TriState.FALSE)
DASHBOARD = b"Connected: Universal Robots Dashboard Server\n"
BIG, LITTLE = (StatusEncoder(order).encode(STATUS) for order in ("big", "little"))


def ur(**found: object) -> ArmFindings:
    return ArmFindings("ur", "arm", "10.0.0.9", 30004, **found)  # type: ignore[arg-type]


def simple(**found: object) -> ArmFindings:
    return ArmFindings("simple_message", "arm", "10.0.0.9", 11002, **found)  # type: ignore[arg-type]


EXAMPLES = [
    (ur(status=STATUS), "ok", "mav-robot-status --arm ur:10.0.0.9:30004"),
    (ur(trouble="unknown name"), "unknown-name", "check the name"),
    (ur(trouble="refused"), "tcp-refused", "start the controller, and enable RTDE"),
    (simple(trouble="timeout"), "tcp-unreachable", "ping 10.0.0.9"),
    (ArmFindings("crane", "c", trouble="no such port"), "cannot-open", "change its options"),
    (
        ur(head=DASHBOARD, fault="x"),
        "dashboard-port",
        "write --arm ur:10.0.0.9,",
    ),
    (simple(head=BIG, fault="x"), "byte-order", "write byte_order: big for 'arm'"),
    (ur(head=LITTLE, size=44), "other-type", "write --arm simple_message:10.0.0.9:30004"),
    (ur(fault="the controller does not speak RTDE version 2: it is too old"), "old-controller", "update the software"),
    (ur(head=b"HTTP/1.1 400", fault="this is not RTDE; it begins with 48 54"), "other-protocol", "enable RTDE"),
    (ur(fault="1 types for 4 values"), "not-understood", "end other clients"),
    (ur(size=4, head=b"\0\4V\1", waits_for="the types of the values"), "incomplete", "check the network"),
    (simple(waits_for="a status"), "tcp-silent", "start the driver of ROS-Industrial"),
    (ArmFindings("crane", "c"), "no-status", "the documentation of 'crane'"),
]


@pytest.mark.parametrize(("found", "cause", "advice"), EXAMPLES, ids=[cause for _, cause, _ in EXAMPLES])
def test_a_finding_has_one_cause_and_one_next_step(found: ArmFindings, cause: str, advice: str) -> None:
    diagnosis = diagnose_arm(found)
    assert diagnosis.cause == cause
    assert advice in diagnosis.next
    assert diagnosis.ok is (cause == "ok")
    assert arm_as_text(found, diagnosis)[0].endswith(f"[{cause}]")
    assert json.loads(arm_as_json(found, diagnosis))["cause"] == cause


def test_every_row_has_an_example() -> None:
    assert [cause for _, cause, _ in EXAMPLES] == [case.cause for case in ARM_CASES]


def test_another_port_than_the_usual_one_is_doubted_first() -> None:
    found = ArmFindings("ur", "arm", "::1", 29998, trouble="refused")
    assert diagnose_arm(found).next.startswith("write the port of the controller, usually ur:[::1]:30004; or start")


def asked(answer: bytes, talk: RtdeTalk | StatusTalk) -> str:
    """The cause if the controller sends this and then nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            server.accept()[0].close()  # the first connection only tries whether the port is open
            client, _ = server.accept()
            client.sendall(answer)
            client.recv(1000)
            ended.wait(10)
            client.close()

        ended = threading.Event()
        thread = threading.Thread(target=serve)
        thread.start()
        kind = "ur" if isinstance(talk, RtdeTalk) else "simple_message"
        found = ask_again(ArmFindings(kind, "arm", "127.0.0.1", server.getsockname()[1]), talk, 0.3)
        ended.set()
        thread.join()
    return diagnose_arm(found).cause


@pytest.mark.parametrize(
    ("answer", "cause"),
    [
        (b"", "tcp-silent"),
        (b"\0\4V\1", "incomplete"),
        (b"\0\4V", "incomplete"),
        (b"\0\4V\0", "old-controller"),
        (b"\0\4V\1\0\x07O\0A,B", "not-understood"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "other-protocol"),
        (b"\xff" * 100, "other-protocol"),
        (DASHBOARD, "dashboard-port"),
        (LITTLE, "other-type"),
    ],
)
def test_the_answer_of_a_controller_tells_the_cause(answer: bytes, cause: str) -> None:
    assert asked(answer, RtdeTalk()) == cause


@pytest.mark.parametrize(("answer", "cause"), [(b"", "tcp-silent"), (LITTLE[:20], "incomplete"), (BIG, "byte-order")])
def test_the_answer_of_a_server_of_simple_message_tells_the_cause(answer: bytes, cause: str) -> None:
    assert asked(answer, StatusTalk("little")) == cause


def test_an_arm_that_works_has_its_status() -> None:
    with FakeArm() as arm:
        arm.press_emergency_stop()
        options = {"host": "127.0.0.1", "port": arm.port, "dashboard_port": arm.dashboard_port}
        found, diagnosis = examine_arm(Config(), HardwareConfig("ur", "arm", options), 20.0)
    assert (diagnosis.cause, diagnosis.ok) == ("ok", True)
    assert json.loads(arm_as_json(found, diagnosis))["status"] == {
        "mode": "AUTO",
        "e_stopped": True,
        "drives_powered": False,
        "motion_possible": False,
        "in_motion": False,
        "in_error": False,
        "errors": [],
        "inhibits": ["E_STOPPED", "POWER_OFF"],
    }
    assert arm_as_text(found, diagnosis)[1].startswith("  status: mode AUTO, e_stopped TRUE")


def test_a_wrong_option_is_an_error() -> None:
    with pytest.raises(UsageError, match="unknown option 'prot'"):
        examine_arm(Config(), HardwareConfig("ur", "arm", {"host": "x", "prot": 1}), 1.0)
