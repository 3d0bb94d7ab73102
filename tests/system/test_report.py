"""`report` through the installed command: totals of flights whose story is known, and a page that is safe to open."""

from __future__ import annotations

import html
import json
import os
import pty
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.language import LOOKS, TONES
from mav_robot_status.mavlink.definitions import Heartbeat, Statustext
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.views.timeline import TRACKS
from tests.docs.documents import table

from ..deadline import allow
from .gateway_process import COMMAND, run

ROOT = Path(__file__).parents[2]
LOGS = ROOT / "tests" / "recorded" / "logs"
START_US = 1_800_000_000_000_000
ATTACK = "<script>alert(1)</script>"


def reported(*arguments: str) -> list[dict[str, Any]]:
    done = run("report", "-q", *arguments, "--as-json")
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def beats(*messages: tuple[float, Any], system: int = 1) -> bytes:
    """Messages at these seconds, as a recorded log."""
    return b"".join(
        round(START_US + at * 1e6).to_bytes(8, "big") + encode(message, system=system, component=1, sequence=n & 255)
        for n, (at, message) in enumerate(messages)
    )


def heartbeats(start: float, end: float, base_mode: int = 65) -> list[tuple[float, Any]]:
    return [(start + n / 2, Heartbeat(4, 10, 3, base_mode, 4, 3)) for n in range(round((end - start) * 2))]


def data_of(page: Path) -> dict[str, Any]:
    (text,) = re.findall(r'id="data">(.*?)</script>', page.read_text("utf-8"), re.DOTALL)
    data: dict[str, Any] = json.loads(text)
    return data


# -- what it adds up to ------------------------------------------------------------------------------------------------


def test_the_totals_of_the_demo_are_right(demo_log: Path) -> None:
    (found,) = reported(str(demo_log))
    totals = found["totals"]
    assert totals["arm_cycles"] == 1
    assert totals["armed"]["TRUE"] == pytest.approx(18, abs=1)  # armed at 8.5 s, disarmed at 26.5 s
    assert totals["e_stopped"]["TRUE"] == pytest.approx(2, abs=1)  # from 20.5 s to 22.5 s
    assert totals["link"]["LOST"] == pytest.approx(5 - 3.5, abs=1.5)  # silent from 27.5 s to 32.5 s
    assert [error["name"] for error in totals["errors"]][:2] == ["CRASH", "RC_LOST"]
    assert "Radio Failsafe" in totals["errors"][1]["texts"]
    for name in ("link", "armed", "mode", *TRACKS[3:]):
        assert sum(totals[name].values()) == pytest.approx(totals["seconds"], abs=1e-4)


def test_during_a_silent_link_every_field_is_unknown() -> None:
    (found,) = reported(str(LOGS / "ardurover-4.5.6-link-silence.tlog"))
    lost = [interval for interval in found["intervals"]["link"] if interval["value"] == "LOST"]
    assert lost
    for interval in lost:
        for field in TRACKS[4:]:
            during = [
                i["value"]
                for i in found["intervals"][field]
                if i["start"] < interval["end"] and i["end"] > interval["start"]
            ]
            assert during == [None], field


def test_a_clock_step_begins_a_segment_and_adds_no_time(tmp_path: Path) -> None:
    log = tmp_path / "jump.tlog"
    log.write_bytes(beats(*heartbeats(0, 10)) + beats(*heartbeats(-7200, -7190)))
    (found,) = reported(str(log))
    assert [segment["start"][:19] for segment in found["segments"]] == ["2027-01-15T08:00:00", "2027-01-15T06:00:00"]
    assert found["totals"]["seconds"] == pytest.approx(19, abs=0.6)
    assert found["totals"]["link"]["LOST"] == 0
    assert len(found["intervals"]["link"]) >= 2


def test_every_vehicle_of_every_log_is_reported(tmp_path: Path, demo_log: Path) -> None:
    two = tmp_path / "two.tlog"
    two.write_bytes(beats(*heartbeats(0, 5)) + beats(*heartbeats(5, 10), system=7))
    found = reported(str(demo_log), str(two))
    assert [(one["log"], one["system"]) for one in found] == [("demo.tlog", 1), ("two.tlog", 1), ("two.tlog", 7)]
    assert [one["system"] for one in reported(str(two), "--system", "7")] == [7]


# -- the page ----------------------------------------------------------------------------------------------------------


def test_the_page_is_written_to_the_working_folder_and_its_name_is_printed(tmp_path: Path, demo_log: Path) -> None:
    done = run("report", "-q", str(demo_log), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "demo.html\n")
    assert [path.name for path in tmp_path.iterdir()] == ["demo.html"]
    (log,) = data_of(tmp_path / "demo.html")["logs"]
    assert len(log["vehicles"]) == 1
    assert (tmp_path / "demo.html").stat().st_size < 100_000


def test_with_as_json_a_page_is_written_only_with_an_output_option(tmp_path: Path, demo_log: Path) -> None:
    assert json.loads(run("report", "-q", str(demo_log), "--as-json", cwd=tmp_path).stdout)["log"] == "demo.tlog"
    assert not list(tmp_path.iterdir())
    done = run("report", "-q", str(demo_log), "--as-json", "-o", "a.html", cwd=tmp_path)
    assert json.loads(done.stdout)["log"] == "demo.tlog"
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]


def test_a_script_in_a_text_is_not_executed(tmp_path: Path) -> None:
    log, page = tmp_path / "<b>&.tlog", tmp_path / "page.html"
    armed = heartbeats(0, 10, base_mode=193)
    log.write_bytes(beats(*armed[:10], (5.0, Statustext(2, ATTACK.encode(), 0, 0)), *armed[11:]))
    assert run("report", "-q", str(log), "-o", str(page)).returncode == 0
    text = page.read_text("utf-8")
    assert text.count("<script") == 2
    assert ATTACK not in text
    assert "<b>" not in text
    (found,) = data_of(page)["logs"]
    assert found["name"] == "<b>&.tlog"
    assert ATTACK in found["strings"]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((), 2, "required: LOG"),
        (("nowhere.tlog",), 2, "cannot read the log"),
        (("{log}", "-o", "{log}"), 2, "is not an .html file, so it is not overwritten"),
        (("{log}", "-o", "nowhere/a.html"), 1, "cannot write the report"),
        (("{gcs}",), 1, "no autopilot was heard, so there is nothing to show"),
        (("{text}",), 2, "is not a recorded log"),
    ],
)
def test_an_error_is_one_line_with_its_exit_code(
    tmp_path: Path, demo_log: Path, arguments: tuple[str, ...], code: int, message: str
) -> None:
    gcs, text = tmp_path / "gcs.tlog", tmp_path / "text.tlog"
    gcs.write_bytes(beats((0, Heartbeat(0, 6, 8, 192, 4, 3)), system=255))
    text.write_text("no log at all " * 9)
    before = demo_log.read_bytes()
    done = run("report", "-q", *(a.format(log=demo_log, gcs=gcs, text=text) for a in arguments), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, "")
    assert message in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr
    assert demo_log.read_bytes() == before


def test_on_a_terminal_it_shows_its_progress(tmp_path: Path, demo_log: Path) -> None:
    ours, theirs = pty.openpty()
    try:
        command = [*COMMAND, "report", "-q", str(demo_log)]
        done = subprocess.run(
            command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=theirs, timeout=allow(30), check=True
        )
        seen = os.read(ours, 1 << 16).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert done.stdout == b"demo.html\n"
    assert "reading demo.tlog  [" in seen
    assert "100 %" in seen


# -- in a browser ------------------------------------------------------------------------------------------------------


@pytest.fixture
def opened(tmp_path: Path) -> Callable[[Path], str]:
    """What a page has become once a browser has run it."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("chromium is not installed: apt-get install chromium")
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    quiet = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking"
    command = [browser, *quiet.split(), "--disable-component-update", "--disable-sync", profile]

    def browse(page: Path) -> str:
        done = subprocess.run(
            [*command, "--virtual-time-budget=3000", "--dump-dom", page.as_uri()],
            capture_output=True,
            text=True,
            timeout=allow(60),
            check=True,
        )
        return done.stdout

    return browse


def test_a_browser_draws_a_row_for_each_field_and_reason(
    tmp_path: Path, demo_log: Path, opened: Callable[[Path], str]
) -> None:
    page = tmp_path / "demo.html"
    run("report", "-q", str(demo_log), "-o", str(page))
    (found,) = reported(str(demo_log))
    shown = opened(page)
    reasons = len(found["totals"]["errors"]) + len(found["totals"]["inhibits"])
    assert shown.count('aria-roledescription="timeline"') == len(TRACKS) + reasons
    for kind in ("hatched unknown", "full warning", "full alarm", "line calm", "full active", "half calm"):
        assert f'<rect class="{kind}"' in shown, kind
    for words in ("2001 RC_LOST", "Crash: Going to HOLD", "YES, cycle 1", "○ none → ◆ ERROR", "LINK_STALE ends"):
        assert words in shown, words


def test_the_verdict_is_at_the_top_and_the_legend_below_the_picture(
    tmp_path: Path, demo_log: Path, opened: Callable[[Path], str]
) -> None:
    page = tmp_path / "demo.html"
    run("report", "-q", str(demo_log), "-o", str(page))
    (found,) = reported(str(demo_log))
    shown = opened(page)
    region = re.search(r'<section class="verdict" aria-label="Verdict">(.*?)</section>', shown, re.DOTALL)
    assert region is not None
    assert 'class="shape"' in region[1]
    assert f"<strong>{found['verdict']['word']}</strong>" in region[1]
    assert html.escape(found["verdict"]["sentence"]) in region[1].replace("&quot;", '"')
    assert len(found["verdict"]["sentence"]) <= 200
    assert shown.index('aria-label="Verdict"') < shown.index('id="main"') < shown.index('id="legend"')


def test_the_legend_has_the_words_and_shapes_of_the_one_table(
    tmp_path: Path, demo_log: Path, opened: Callable[[Path], str]
) -> None:
    page = tmp_path / "demo.html"
    run("report", "-q", str(demo_log), "-o", str(page))
    shown = opened(page)
    for field, looks in LOOKS.items():
        (row,) = re.findall(rf'<li data-field="{field}">(.*?)</li>', shown)
        found = re.findall(r'data-value="(\w+)">.*?<rect class="(\w+) (\w+)".*?</svg>(.*?)</span>', row)
        words = {True: "TRUE", False: "FALSE", None: "UNKNOWN"}
        assert found == [
            (words.get(value, value), look.bar, look.tone, f"{look.glyph} {look.word}") for value, look in looks.items()
        ], field
    for name, tone in TONES.items():
        assert shown.count(f"--{name}: {tone.light};") == shown.count(f"--{name}: {tone.dark};") == 1


def test_the_page_opens_on_the_time_in_which_the_vehicle_was_heard(
    tmp_path: Path, opened: Callable[[Path], str]
) -> None:
    log, page = tmp_path / "quiet.tlog", tmp_path / "quiet.html"
    station = [(30.0 * n, Heartbeat(0, 6, 8, 192, 4, 3)) for n in range(4, 61)]
    log.write_bytes(beats(*heartbeats(0, 100)) + beats(*station, system=255))
    run("report", "-q", str(log), "-o", str(page))
    shown = opened(page)
    assert re.search(r"<output>1 min 4\d s of 30 min 00 s</output>", shown)
    assert "When heard" in shown
    assert re.search(r"Time in each state, of 1 min 4\d s with a link", shown)
    assert re.search(r"The link, of 30 min 00 s since the first heartbeat", shown)


def test_a_lost_link_is_no_reason_for_standing_still_and_no_end_of_an_error(
    tmp_path: Path, opened: Callable[[Path], str]
) -> None:
    log, page = tmp_path / "loss.tlog", tmp_path / "loss.html"
    armed = heartbeats(0, 10, base_mode=193)
    log.write_bytes(
        beats(*armed[:10], (5.0, Statustext(0, b"Crash: Disarming", 0, 0)), *armed[11:], (30.0, armed[0][1]))
    )
    run("report", "-q", str(log), "-o", str(page))
    shown = opened(page)
    assert "CRASH: unknown while the link is lost" in shown
    assert "CRASH ends" not in shown
    headings = re.findall(r'<div class="group">(.*?)</div>', shown)
    assert headings[-1] == "Why this is unknown"
    assert "LINK_STALE" in shown.partition("Why this is unknown")[2]


def test_a_browser_executes_nothing_from_the_wire(tmp_path: Path, opened: Callable[[Path], str]) -> None:
    log, page = tmp_path / "attack.tlog", tmp_path / "attack.html"
    armed = heartbeats(0, 10, base_mode=193)
    image = Statustext(2, b"<img src=x onerror=document.title=1>", 0, 0)
    attack = Statustext(2, ATTACK.encode(), 0, 0)
    log.write_bytes(beats(*armed[:6], (3.0, attack), *armed[7:14], (7.0, image), *armed[15:]))
    run("report", "-q", str(log), "-o", str(page))
    shown = opened(page)
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in shown
    assert "&lt;img src=x onerror=document.title=1&gt;" in shown
    assert "<img" not in shown
    assert shown.count("<script") == 2
    assert "<title>attack.tlog" in shown


# -- the document ------------------------------------------------------------------------------------------------------


def test_the_document_has_the_members_and_the_totals() -> None:
    text = (ROOT / "docs" / "reference" / "report.md").read_text("utf-8")
    (log,) = re.findall(r"`(tests/recorded/logs/\S+\.tlog)`", text)
    (found,) = reported(str(ROOT / log))
    assert json.loads(text.partition("```text\n")[2].partition("```")[0]) == found["totals"]
    rows = [row[0] for row in table("docs/reference/report.md", "member")]
    assert [row for row in rows if row != "members"] == list(found), "a single robot has no members"
