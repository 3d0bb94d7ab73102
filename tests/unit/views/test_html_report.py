from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.interface import TRI_STATES, Evidence, Inhibit, NotReady
from mav_robot_status.language import LOOKS
from mav_robot_status.views.html_report import as_html, as_json, embedded, save

from .flights import FALSE, START_US, TRUE, UNKNOWN, Flight, S, error

HOSTILE = "</script><script>alert(1)</script><!-- & \u2028 {{data}} \ud800"


def told(flight: Flight, second: float) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(as_json([flight.end(second)]))
    return found


def data_of(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    data: dict[str, Any] = json.loads(text)
    return data


# -- JSON --------------------------------------------------------------------------------------------------------------


def test_states_are_written_as_in_a_json_line() -> None:
    found = told(Flight().say(0, in_motion=TRUE).say(1, in_motion=FALSE).say(2, in_motion=UNKNOWN), 3)
    assert [interval["value"] for interval in found["intervals"]["in_motion"]] == [True, False, None]
    assert [interval["value"] for interval in found["intervals"]["mode"]] == ["MANUAL"]
    assert [interval["value"] for interval in found["intervals"]["link"]] == ["CONNECTED"]


def test_an_interval_has_its_times_and_its_evidence() -> None:
    found = told(Flight().say(0.5, in_motion=TRUE, because=Evidence("airborne", "EXTENDED_SYS_STATE", 100.0)), 3)
    assert found["intervals"]["in_motion"] == [
        {
            "value": True,
            "start": "2027-01-15T08:00:00.500000Z",
            "end": "2027-01-15T08:00:03.000000Z",
            "seconds": 2.5,
            "rule": "airborne",
            "source": "EXTENDED_SYS_STATE",
        }
    ]


def test_a_group_lists_the_members_that_could_not_work_while_another_one_could() -> None:
    flight = Flight()
    flight.detail = flight.detail._replace(component=192, members=("base", "arm"))
    flight.say(0, motion_possible=TRUE)
    flight.detail = flight.detail._replace(not_ready=(NotReady("arm", "E_STOPPED"),))
    flight.say(1, motion_possible=TRUE)
    flight.detail = flight.detail._replace(not_ready=())
    found = told(flight.say(3, motion_possible=TRUE), 4)
    assert [(one["handle"], one["name"], one["seconds"]) for one in found["intervals"]["not_ready"]] == [
        ("arm", "E_STOPPED", 2.0)
    ]
    assert found["totals"]["not_ready"][0]["seconds"] == 2.0
    assert "not_ready" not in told(Flight().say(0), 1)["totals"]
    (vehicle,) = data_of(as_html([flight.builder.timeline], "me"))["logs"][0]["vehicles"]
    assert list(vehicle["inhibits"]) == ["not ready: arm: E_STOPPED"]
    (total,) = vehicle["totals"]["inhibits"]
    assert (total["name"], total["kind"]) == ("not ready: arm: E_STOPPED", "not_ready")


def test_a_group_names_its_members_and_who_reports_a_reason() -> None:
    flight = Flight()
    flight.detail = flight.detail._replace(component=192, members=("base", "arm"))
    flight.say(0, inhibits=(Inhibit("E_STOPPED", "the button", 0, "arm"), Inhibit("E_STOPPED", None, 0, "base")))
    found = told(flight, 2)
    assert found["members"] == ["base", "arm"]
    for reasons in (found["intervals"]["inhibits"], found["totals"]["inhibits"]):
        assert sorted((one["handle"], one["name"]) for one in reasons) == [("arm", "E_STOPPED"), ("base", "E_STOPPED")]
    (vehicle,) = data_of(as_html([flight.end(2)], ""))["logs"][0]["vehicles"]
    assert (vehicle["name"], vehicle["handle"]) == ("handle", "base, arm")
    assert sorted(vehicle["inhibits"]) == ["arm: E_STOPPED", "base: E_STOPPED"]
    assert sorted(total["name"] for total in vehicle["totals"]["inhibits"]) == sorted(vehicle["inhibits"])


def test_without_a_flight_mode_its_value_is_null() -> None:
    found = told(Flight().say(0).lose(1), 3)
    assert [interval["value"] for interval in found["intervals"]["flight_mode"]] == ["POSCTL", None]
    assert found["totals"]["flight_mode"] == {"POSCTL": 1.0}


def test_the_totals_list_every_state_even_if_it_never_occurred() -> None:
    found = told(Flight().say(0), 2)["totals"]
    assert found["mode"] == {"UNKNOWN": 0.0, "MANUAL": 2.0, "AUTO": 0.0}
    assert found["link"] == {"NEVER_SEEN": 0.0, "CONNECTED": 2.0, "LOST": 0.0}
    for name in ("armed", *(field.name for field in TRI_STATES)):
        assert set(found[name]) == {"TRUE", "FALSE", "UNKNOWN"}
        assert sum(found[name].values()) == found["seconds"] == 2.0


def test_errors_have_their_codes() -> None:
    found = told(Flight().say(0, errors=(error(2001, "RC_LOST", "Radio Failsafe"),)).say(1), 2)
    (interval,) = found["intervals"]["errors"]
    assert (interval["code"], interval["name"], interval["text"], interval["seconds"]) == (
        *(2001, "RC_LOST", "Radio Failsafe"),
        1.0,
    )
    assert found["totals"]["errors"] == [
        {"code": 2001, "name": "RC_LOST", "count": 1, "seconds": 1.0, "texts": ["Radio Failsafe"]}
    ]


def test_each_vehicle_of_each_log_is_one_line() -> None:
    flights = [Flight(name, system).say(0).end(1) for name, system in (("a.tlog", 1), ("b.tlog", 7))]
    lines = [json.loads(line) for line in as_json(flights).splitlines()]
    assert [(line["log"], line["system"]) for line in lines] == [("a.tlog", 1), ("b.tlog", 7)]


# -- the page ----------------------------------------------------------------------------------------------------------


def test_hostile_text_cannot_leave_its_element() -> None:
    flight = Flight(name=HOSTILE).say(0, errors=(error(6002, "TEXT_CRITICAL", HOSTILE),), mode=HOSTILE)
    page = as_html([flight.end(1)], "mav-robot-status 1.0")
    assert page.count("<script") == 2
    assert page.count("</script") == 2
    assert "alert(1)</" not in page
    (log,) = data_of(page)["logs"]
    assert log["name"] == HOSTILE
    assert HOSTILE in log["strings"]


@pytest.mark.parametrize("text", ["<", ">", "&", "]]>", "\u2028", "\\", '"', "</SCRIPT ", "<!--", "é", "\udfff"])
def test_embedded_json_has_no_markup_and_parses_to_the_same_value(text: str) -> None:
    written = embedded([text, {text: 1}])
    assert written.isascii()
    assert not set(written) & set("<>&")
    assert json.loads(written) == [text, {text: 1}]


def test_the_policy_allows_only_the_script_and_style_of_the_page_and_no_network() -> None:
    page = as_html([Flight().say(0).end(1)], "")
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy.startswith("default-src 'none'; ")
    for tag, kind in (("script", "script-src"), ("style", "style-src")):
        (code,) = re.findall(rf"<{tag}>(.*?)</{tag}>", page, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
        assert f"{kind} 'sha256-{digest}'" in policy
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")


def test_the_script_turns_no_text_into_markup() -> None:
    page = as_html([Flight().say(0).end(1)], "")
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function", page)


def test_intervals_are_packed_as_gap_length_value_and_why() -> None:
    flight = Flight().say(1, in_motion=TRUE, because=Evidence("airborne", None, None)).say(3, in_motion=FALSE)
    (log,) = data_of(as_html([flight.end(4)], ""))["logs"]
    packed, strings = log["vehicles"][0]["tracks"]["in_motion"], log["strings"]
    assert packed[:2] == [1_000_000, 2_000_000]
    assert strings[packed[2]] == "TRUE"
    assert strings[packed[3]] == ["airborne", None]
    assert packed[4:6] == [0, 1_000_000]
    assert strings[packed[6]] == "FALSE"


def test_the_page_has_the_looks_of_the_one_table() -> None:
    looks = data_of(as_html([Flight().say(0).end(1)], ""))["looks"]
    assert set(looks) == {*LOOKS, "armed"}
    assert looks["mode"]["MANUAL"] == {"word": "MANUAL", "glyph": "☺", "tone": "calm", "bar": "half"}
    for field, rows in LOOKS.items():
        assert [row["word"] for row in looks[field].values()] == [look.word for look in rows.values()]


def test_a_reason_of_the_page_has_its_kind_its_tone_and_its_step() -> None:
    failing = Inhibit("PREARM_FAILING", "PreArm: GPS 1: Bad fix", START_US)
    flight = Flight().say(0, armed=False, inhibits=(failing,), errors=(error(2003, "BATTERY_LOW"),)).lose(2)
    (vehicle,) = data_of(as_html([flight.end(4)], ""))["logs"][0]["vehicles"]
    rows = [*vehicle["totals"]["errors"], *vehicle["totals"]["inhibits"]]
    assert {row["name"]: (row["kind"], row["tone"]) for row in rows} == {
        "BATTERY_LOW": ("error", "alarm"),
        "DISARMED": ("inhibit", "calm"),
        "PREARM_FAILING": ("inhibit", "warning"),
        "LINK_STALE": ("unknown", "unknown"),
    }
    (gps,) = (row for row in rows if row["name"] == "PREARM_FAILING")
    assert (gps["sentence"], gps["steps"]) == ("it cannot be armed", ["Wait for a fix or check the antenna."])


def test_texts_at_the_same_time_are_one_row_of_the_page() -> None:
    gps, compass = (Inhibit("PREARM_FAILING", text, START_US) for text in ("GPS", "Compass"))
    flight = Flight().say(0, inhibits=(gps,)).say(1, inhibits=(gps, compass)).say(3, inhibits=(compass,)).say(4)
    log = data_of(as_html([flight.say(6, inhibits=(gps,)).end(7)], ""))["logs"][0]
    packed = log["vehicles"][0]["inhibits"]["PREARM_FAILING"]
    spans = [packed[i : i + 4] for i in range(0, len(packed), 4)]
    assert [(gap, length, log["strings"][text]) for gap, length, text, _ in spans] == [
        (0, 1 * S, "GPS"),
        (0, 2 * S, "GPS; Compass"),
        (0, 1 * S, "Compass"),
        (2 * S, 1 * S, "GPS"),
    ]


def test_a_page_of_many_short_intervals_is_smaller_than_their_messages() -> None:
    flight = Flight()
    for tick in range(20_000):
        flight.say(tick / 10, in_motion=(TRUE, FALSE)[tick % 2])
    page = as_html([flight.end(2000)], "")
    assert len(page) < 20_000 * 25


# -- the file ----------------------------------------------------------------------------------------------------------


def test_a_page_is_overwritten_and_a_log_is_not(tmp_path: Path) -> None:
    page, log = tmp_path / "a.html", tmp_path / "a.tlog"
    save("one", str(page))
    save("two \ud800", str(page))
    assert page.read_text() == "two ?"
    log.write_bytes(b"flight")
    with pytest.raises(UsageError, match=r"is not an \.html file, so it is not overwritten"):
        save("page", str(log))
    assert log.read_bytes() == b"flight"


@pytest.mark.parametrize("name", ["nowhere/a.html", "a\0.html"])
def test_a_path_that_cannot_be_written_is_an_error_of_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises((LinkError, UsageError), match="cannot write the report"):
        save("page", str(tmp_path / name))
