from __future__ import annotations

import json

import pytest

from mav_robot_status.diagnosis.doctor.ros2 import CASES, MOST_SHOWN, Ros2Findings, as_json, as_text, diagnose
from mav_robot_status.publishers.ros.messages import DIAGNOSTIC_ARRAY, ROBOT_STATUS
from mav_robot_status.publishers.ros.settings import read
from mav_robot_status.publishers.ros.transport import Endpoint
from tests.docs.documents import table

URL = "zenoh://router:7447/3"
HERE = read({"url": URL}, {})
OURS = Endpoint(3, "/viewer", "/robot_status", ROBOT_STATUS.dds_name, ROBOT_STATUS.hash)
DIAGNOSTICS = Endpoint(3, "/viewer", "/diagnostics", DIAGNOSTIC_ARRAY.dds_name, DIAGNOSTIC_ARRAY.hash)
HEARING = OURS._replace(matched=True)
OTHERS = OURS._replace(type_hash="RIHS01_00")


@pytest.mark.parametrize(
    ("findings", "cause", "ok", "advice"),
    [
        (Ros2Findings(HERE, "no answer"), "ros2-unreachable", False, "rmw_zenohd"),
        (Ros2Findings(read({"url": "dds://3"}, {}), "cannot join"), "ros2-unreachable", False, "CYCLONEDDS_URI"),
        (Ros2Findings(HERE), "ros2-no-subscriber", True, "ROS_DOMAIN_ID=3 RMW_IMPLEMENTATION=rmw_zenoh_cpp ros2 topic"),
        (Ros2Findings(HERE, None, (OURS._replace(domain=0),)), "ros2-other-domain", False, "zenoh://router:7447/0"),
        (Ros2Findings(HERE, None, (OURS, OTHERS)), "ros2-other-definition", False, "branch ros2_msgs_only"),
        (Ros2Findings(HERE, None, (OURS._replace(dds_type="x"),)), "ros2-other-definition", False, "branch ros2_msgs"),
        (Ros2Findings(HERE, None, (HEARING, OURS._replace(matched=False))), "ros2-not-matched", False, "our type"),
        (Ros2Findings(HERE, None, (HEARING,)), "ros2-ok", True, "nothing"),
        (Ros2Findings(HERE, None, (HEARING._replace(type_hash="x"),)), "ros2-other-definition", False, "branch"),
        (Ros2Findings(HERE, None, (OURS, OTHERS._replace(domain=0))), "ros2-ok", True, "nothing"),
        (Ros2Findings(HERE, None, (OURS._replace(type_hash=""),)), "ros2-ok", True, "nothing"),
        (Ros2Findings(HERE, None, (DIAGNOSTICS,)), "ros2-ok", True, "nothing"),
    ],
)  # fmt: skip
def test_findings_have_a_cause_and_a_next_action(findings: Ros2Findings, cause: str, ok: bool, advice: str) -> None:
    found = diagnose(findings)
    assert (found.cause, found.ok) == (cause, ok)
    assert advice in found.next


@pytest.mark.parametrize(
    ("matched", "says"),
    [
        ((False,), "1 subscriber in domain 3, none matches: "),
        ((False, False, False), "3 subscribers in domain 3, none matches: "),
        ((True, False), "2 subscribers in domain 3, 1 matches: "),
        ((True, True, False), "3 subscribers in domain 3, 2 match: "),
    ],
)
def test_who_does_not_match_is_named_with_the_reason(matched: tuple[bool, ...], says: str) -> None:
    found = tuple(OURS._replace(matched=one, why="" if one else "its type is x") for one in matched)
    diagnosis = diagnose(Ros2Findings(HERE, None, found))
    assert diagnosis.matter == f"{says}/viewer subscribes to /robot_status in domain 3, but its type is x"
    shown = json.loads(as_json(URL, Ros2Findings(HERE, None, found), diagnosis))["subscriptions"]
    assert [one["matched"] for one in shown] == list(matched)


def test_the_text_shows_few_subscriptions_and_the_json_all() -> None:
    findings = Ros2Findings(HERE, None, (OURS,) * 20)
    text = as_text(findings, diagnose(findings))
    assert text[0] == "Zenoh router router:7447, domain 3: subscribers in domain 3: 20 [ros2-ok]"
    assert len(text) == 1 + MOST_SHOWN + 1 + 1
    assert text[-2:] == ["  and 12 more", "next: nothing: the topics are received"]
    assert len(json.loads(as_json(URL, findings, diagnose(findings)))["subscriptions"]) == 20


def test_every_cause_is_in_the_reference() -> None:
    rows = table("docs/reference/doctor.md", "cause of `--ros2`")
    assert rows == [[case.cause, case.meaning] for case in CASES]
