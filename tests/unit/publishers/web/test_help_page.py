from __future__ import annotations

from html import unescape

from mav_robot_status.language.remedies import REMEDIES
from mav_robot_status.language.texts import TEXTS
from mav_robot_status.publishers.web.help_page import help_page

STEPS = [*(row.step for row in REMEDIES.values()), *(row.step for row in TEXTS)]


def test_each_topic_that_a_next_step_names_has_a_heading() -> None:
    page = help_page().decode()
    topics = ({row.topic for row in REMEDIES.values()} | {row.topic for row in TEXTS}) - {""}
    assert {f'id="{topic}"' in page for topic in topics} == {True}


def test_the_page_needs_nothing_from_elsewhere() -> None:
    page = help_page().decode()
    assert "//" not in page
    assert "<script" not in page
    assert "style=" not in page


def test_each_step_is_there() -> None:
    page = unescape(help_page().decode())
    assert [step for step in STEPS if step not in page] == []
