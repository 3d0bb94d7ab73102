from __future__ import annotations

import io
import json
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from mav_robot_status.clock import rfc3339
from mav_robot_status.config import Config, ControllerConfig, LinkConfig, PublisherConfig
from mav_robot_status.diagnosis.explain import as_json, as_table, explain_live, explain_log, moment
from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER
from mav_robot_status.interface import STATES
from mav_robot_status.mavlink.definitions import Heartbeat, NamedValueFloat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing import FakeAutopilot, ardurover
from tests.recorded.replays import OURS, lines_of

START_US = 1_800_000_000_000_000  # 2027-01-15T08:00:00Z
DISARMED, ARMED = 65, 193


def log_of(path: Path, *seconds: float, base_mode: int = DISARMED, systems: tuple[int, ...] = (1,)) -> str:
    """A log with heartbeats of rovers at each of these times."""
    with open(path, "wb") as log:
        for sequence, at in enumerate(seconds):
            for system in systems:
                log.write(round(START_US + at * 1e6).to_bytes(8, "big"))
                log.write(encode(Heartbeat(0, 10, 3, base_mode, 4, 3), system=system, component=1, sequence=sequence))
    return str(path)


def explained(path: str, at: str | None = None) -> dict[str, Any]:
    """The explanation of the only vehicle."""
    (found,) = explain_log(Config(), path, at)
    return found


def seconds(found: dict[str, Any]) -> float:
    """The moment of an explanation in seconds since the start of the log."""
    stamp = datetime.fromisoformat(found["stamp"].replace("Z", "+00:00"))
    return round(stamp.timestamp() - START_US / 1e6, 6)


# -- the moment --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "seconds"),
    [
        ("+0", 0),
        ("+44", 44),
        ("+0.25", 0.25),
        ("2027-01-15T08:00:44Z", 44),
        ("2027-01-15T08:00:44.250Z", 44.25),
        ("2027-01-15T08:00:44.2Z", 44.2),
        ("2027-01-15T09:00:44+01:00", 44),
        ("2027-01-15T08:00:44", 44),
    ],
)
def test_a_moment_is_a_time_or_seconds_from_the_start(at: str, seconds: float) -> None:
    assert moment(at, START_US) == START_US + seconds * 1e6


@pytest.mark.parametrize(
    "at", ["nonsense", "", "44", "-5", "+", "+-1", "+nan", "+inf", "+1e400", "2027-13-01T00:00:00Z"]
)
def test_an_invalid_moment_is_an_error_that_shows_the_format(at: str) -> None:
    with pytest.raises(UsageError) as caught:
        moment(at, START_US)
    assert str(caught.value) == (
        f"--at {at}: write a time like 2027-01-15T08:00:00.000000Z, or +44 for seconds from the start"
    )


# -- recorded ----------------------------------------------------------------------------------------------------------


def test_the_end_of_the_log_is_explained_by_default(tmp_path: Path) -> None:
    found = explained(log_of(tmp_path / "a.tlog", 0, 1, 2))
    assert seconds(found) == 2
    assert found["link"] == {"state": "CONNECTED", "heartbeat_age": 0.0}


@pytest.mark.parametrize(("at", "age"), [("+0", 0.0), ("+1", 0.0), ("+1.5", 0.5), ("+2", 0.0)])
def test_a_moment_between_two_messages_uses_the_earlier_message(tmp_path: Path, at: str, age: float) -> None:
    found = explained(log_of(tmp_path / "a.tlog", 0, 1, 2), at)
    assert seconds(found) == float(at)
    assert found["link"]["heartbeat_age"] == age
    assert found["fields"]["drives_powered"] == {
        "value": False,
        "rule": "disarmed",
        "source": "HEARTBEAT.base_mode 65",
        "age": age,
        "next": None,
    }


def test_messages_after_the_moment_are_ignored(tmp_path: Path) -> None:
    log = Path(log_of(tmp_path / "a.tlog", 0, 1))
    armed = Path(log_of(tmp_path / "b.tlog", 2, 3, base_mode=ARMED))
    log.write_bytes(log.read_bytes() + armed.read_bytes())
    assert explained(str(log), "+1.999999")["fields"]["drives_powered"]["value"] is False
    assert explained(str(log), "+2")["fields"]["drives_powered"]["value"] is True


def test_in_a_gap_the_lost_link_explains_the_unknown_fields(tmp_path: Path) -> None:
    found = explained(log_of(tmp_path / "a.tlog", 0, 1, 2, 12, 13), "+8")
    assert found["link"] == {"state": "LOST", "heartbeat_age": 6.0}
    for name, field in found["fields"].items():
        assert field["value"] == ("UNKNOWN" if name == "mode" else None)
        assert (field["rule"], field["age"]) == ("no frame within heartbeat_timeout", 6.0)
    (inhibit,) = found["inhibits"]
    assert (inhibit["name"], inhibit["since"]) == ("LINK_STALE", "2027-01-15T08:00:05.500000Z")


@pytest.mark.parametrize(
    ("at", "message"),
    [
        ("2027-01-15T07:59:59Z", "the log begins at 2027-01-15T08:00:00.000000Z"),
        ("+2.1", "the log ends at 2027-01-15T08:00:02.000000Z"),
        ("2028-01-01T00:00:00Z", "the log ends at 2027-01-15T08:00:02.000000Z"),
    ],
)
def test_a_moment_outside_the_log_is_an_error_with_the_start_or_end_of_the_log(
    tmp_path: Path, at: str, message: str
) -> None:
    path = log_of(tmp_path / "a.tlog", 0, 1, 2)
    with pytest.raises(UsageError) as caught:
        explain_log(Config(), path, at)
    assert str(caught.value) == f"--at {at}: {message}"


def test_after_a_clock_jump_earlier_messages_are_ignored(tmp_path: Path) -> None:
    path = log_of(tmp_path / "a.tlog", 0, 1, 90_000, 90_001)
    assert [i["since"] for i in explained(path, "+1")["inhibits"]][:1] == ["2027-01-15T08:00:00.000000Z"]
    assert {i["since"] for i in explained(path)["inhibits"]} == {"2027-01-16T09:00:00.000000Z"}


def test_every_vehicle_of_a_log_is_explained(tmp_path: Path) -> None:
    found = explain_log(Config(), log_of(tmp_path / "a.tlog", 0, 1, systems=(1, 7)), None)
    assert [(one["system"], one["component"]) for one in found] == [(1, 1), (7, 1)]
    assert [json.loads(line) for line in as_json(found)] == found
    assert [part.split()[1] for part in "\n".join(as_table(found)).split("\n\n")] == ["1.1", "7.1"]


def test_a_log_without_an_autopilot_has_no_explanation(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    ground_station = encode(Heartbeat(0, 6, 8, 192, 4, 3), system=255, component=190, sequence=0)
    path.write_bytes(START_US.to_bytes(8, "big") + ground_station)
    assert explain_log(Config(), str(path), None) == []


def test_the_configured_publishers_do_not_run(tmp_path: Path) -> None:
    publisher = PublisherConfig("json", {"path": str(tmp_path / "lines")})
    controller = ControllerConfig("c", DEFAULT_CONTROLLER.type, {}, "f:1:1", (publisher,))
    assert explain_log(Config(controllers=(controller,)), log_of(tmp_path / "a.tlog", 0, 1), None)
    assert not (tmp_path / "lines").exists()


@pytest.mark.parametrize(
    "name", ["arducopter-4.5.6-estop", "ardurover-4.5.6-link-silence", "px4-quad-1.17dev-aa850d5c1c-fs-rc"]
)
def test_an_explanation_has_the_values_of_the_line_at_that_moment(name: str) -> None:
    log = OURS / f"{name}.tlog"
    lines = [json.loads(line) for line in lines_of(log)]
    for line in lines[7 :: len(lines) // 8]:
        found = explained(str(log), line["stamp"])
        after = [one for one in lines if one["stamp"] == line["stamp"]][-1]
        assert {name: field["value"] for name, field in found["fields"].items()} == {
            f.name: after[f.name] for f in STATES
        }
        for member in ("error_code", "errors", "inhibits", "vehicle", "link", "stamp", "handle"):
            assert found[member] == after[member], member


# -- as a table --------------------------------------------------------------------------------------------------------


UNKNOWN_THERE = ("e_stopped", "in_motion", "in_error")
"""What a vehicle that sends only HEARTBEATs leaves UNKNOWN."""


def test_each_unknown_field_says_what_would_make_it_known(tmp_path: Path) -> None:
    (found,) = explain_log(Config(), log_of(tmp_path / "a.tlog", 0, 1), "+0.5")
    steps = {name: field["next"] for name, field in found["fields"].items() if field["next"] is not None}
    assert tuple(steps) == UNKNOWN_THERE
    assert "mav-robot-status applet" in steps["e_stopped"]
    assert "GLOBAL_POSITION_INT" in steps["in_motion"]
    assert "SYS_STATUS" in steps["in_error"]


def test_the_table_has_one_aligned_row_for_each_field(tmp_path: Path) -> None:
    found = explain_log(Config(), log_of(tmp_path / "a.tlog", 0, 1), "+0.5")
    title, heading, *rows = as_table(found)
    assert title == f"vehicle 1.1 (ARDUPILOTMEGA, GROUND_ROVER, MANUAL), CONNECTED, at {rfc3339(START_US + 500_000)}"
    assert heading.split() == ["field", "value", "age", "why"]
    assert [row.split()[0] for row in rows[:6]] == [field.name for field in STATES]
    assert [row[heading.index("value") :].split()[0] for row in rows[:6]] == [
        *("MANUAL", "UNKNOWN", "FALSE", "FALSE", "UNKNOWN", "UNKNOWN")
    ]
    assert rows[2][heading.index("why") :] == "disarmed  [HEARTBEAT.base_mode 65]"
    assert rows[2][: heading.index("why")].endswith("  0.5 s  ")
    assert rows[4][: heading.index("why")].split() == ["in_motion", "UNKNOWN"]  # no message was read, so it has no age
    assert [row.partition(":")[0] for row in rows[6:9]] == [f"unknown  {name}" for name in UNKNOWN_THERE]
    assert rows[9] == "applet   not heard: docs/ardupilot-applet.md"
    causes = [row.split()[:2] for row in rows[10:] if not row.startswith("step")]
    assert causes == [["inhibit", i["name"]] for i in found[0]["inhibits"]]


def test_a_cause_is_followed_by_its_step_which_is_named_once(tmp_path: Path) -> None:
    (found,) = explain_log(Config(), log_of(tmp_path / "a.tlog", 0, 1), "+0.5")
    since = found["stamp"]
    failing = [{"name": "PREARM_FAILING", "text": f"PreArm: GPS {n}: Bad fix", "since": since} for n in (1, 2)]
    low = {"code": 2003, "name": "BATTERY_LOW", "text": None, "since": since}
    rows = as_table([found | {"errors": [low], "inhibits": failing}])
    assert rows[12:] == [
        f"error    2003 BATTERY_LOW since {since}",
        "step     Bring it back or land it. Charge or change the battery.",
        f'inhibit  PREARM_FAILING since {since}: "PreArm: GPS 1: Bad fix"',
        "step     Wait for a fix or check the antenna.",
        f'inhibit  PREARM_FAILING since {since}: "PreArm: GPS 2: Bad fix"',
    ]


# -- the applet --------------------------------------------------------------------------------------------------------


def applet_log(path: Path, *reports: tuple[float, float], autopilot: int = 3) -> str:
    """A log with a heartbeat every second for ten seconds, and RS_STOP with these times and values."""
    messages: list[tuple[float, NamedTuple]] = [
        (float(at), Heartbeat(0, 10, autopilot, DISARMED, 4, 3)) for at in range(10)
    ]
    messages += [(at, NamedValueFloat(round(at * 1000), value, b"RS_STOP")) for at, value in reports]
    with open(path, "wb") as log:
        for sequence, (at, message) in enumerate(sorted(messages, key=lambda timed: timed[0])):
            log.write(round(START_US + at * 1e6).to_bytes(8, "big"))
            log.write(encode(message, system=1, component=1, sequence=sequence))
    return str(path)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "no stop"),
        (1.0, "the emergency stop is engaged"),
        (2.0, "the safety switch is on"),
        (3.0, "the emergency stop is engaged, the safety switch is on"),
    ],
)
def test_the_applet_of_an_ardupilot_is_shown_in_words_with_its_age(tmp_path: Path, value: float, words: str) -> None:
    found = explain_log(Config(), applet_log(tmp_path / "a.tlog", (2.0, 0.0), (3.0, value)), "+4.5")
    assert found[0]["applet"] == {"value": value, "age": 1.5}
    assert f"applet   RS_STOP {value:.0f}, {words}, 1.5 s ago" in as_table(found)


def test_an_applet_that_is_silent_is_not_heard(tmp_path: Path) -> None:
    found = explain_log(Config(), applet_log(tmp_path / "a.tlog", (2.0, 0.0)), "+8.5")
    assert found[0]["applet"] is None
    assert "applet   not heard: docs/ardupilot-applet.md" in as_table(found)


def test_the_applet_is_not_mentioned_for_another_autopilot(tmp_path: Path) -> None:
    found = explain_log(Config(), applet_log(tmp_path / "a.tlog", (2.0, 0.0), autopilot=12), "+4.5")
    assert "applet" not in found[0]
    assert "applet" not in as_table(found)


# -- who speaks --------------------------------------------------------------------------------------------------------


def test_two_senders_of_one_vehicle_are_listed_and_one_is_not(tmp_path: Path) -> None:
    with open(tmp_path / "two.tlog", "wb") as log:
        for tick in range(12):
            for late, sequence, base_mode in ((0, tick, DISARMED), (0.2, tick + 100, ARMED)):
                log.write(round(START_US + (tick / 2 + late) * 1e6).to_bytes(8, "big"))
                log.write(encode(Heartbeat(0, 10, 3, base_mode, 4, 3), system=1, component=1, sequence=sequence))
    found = explained(str(tmp_path / "two.tlog"))
    assert [(one["address"], one["proof"], one["armed"]) for one in found["senders"]] == [
        ("the log", "first heard", False),
        ("the log", "not proven", True),
    ]
    assert [line for line in as_table([found]) if line.startswith("sender ")][1] == (
        "sender   the log: GROUND_ROVER, armed, 1 count of sequence numbers, not proven, claims the ids for 4.0 s"
    )
    assert json.loads(as_json([found])[0])["senders"] == found["senders"]
    assert "senders" not in explained(log_of(tmp_path / "one.tlog", 0, 1, 2))


# -- live --------------------------------------------------------------------------------------------------------------


def test_a_live_vehicle_is_explained_some_time_after_its_first_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mav_robot_status.diagnosis.explain.LISTEN", 0.3)
    monkeypatch.setattr("mav_robot_status.diagnosis.explain.ANSWERS", 0.3)
    with FakeAutopilot(ardurover.READY) as rover:
        links = (LinkConfig("udpout:{}:{}".format(*rover.address)),)
        stdout = io.StringIO()
        (found,) = explain_live(Config(links=links), stdout)
    assert found["fields"]["drives_powered"]["rule"] == "disarmed"
    assert found["link"]["state"] == "CONNECTED"
    assert 0 <= found["link"]["heartbeat_age"] < 3.5
    assert stdout.getvalue() == ""


def test_waiting_for_a_heartbeat_times_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mav_robot_status.diagnosis.explain.PATIENCE", 0.1)
    assert explain_live(Config(links=(LinkConfig("udpin:127.0.0.1:0"),)), io.StringIO()) == []
