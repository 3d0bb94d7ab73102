"""The page of remedies has every topic, name and family of texts, with the step of the table."""

from __future__ import annotations

import re

from mav_robot_status.language.remedies import REMEDIES
from mav_robot_status.language.texts import TEXTS, step_for

from .documents import ROOT

PAGE = ROOT / "docs" / "how-to" / "cannot-move.md"
SECTIONS = {
    heading.lower().replace(" ", "-"): [
        row.strip("| ").split(" | ")
        for row in body.splitlines()
        if row.startswith("| ") and " | first step |" not in row
    ]
    for heading, _, body in (part.partition("\n") for part in PAGE.read_text().split("\n## ")[1:])
}
"""The rows of each section, by its anchor: what it says, and the step."""


def test_every_topic_is_a_heading_and_every_heading_a_topic() -> None:
    assert set(SECTIONS) == {row.topic for row in REMEDIES.values()} | {row.topic for row in TEXTS}


def test_every_name_has_its_sentence_and_its_step() -> None:
    shown = [
        (name, sentence, step, topic)
        for topic, rows in SECTIONS.items()
        for says, step in rows
        for sentence, names in re.findall(r"([^;(]+) \(([^)]+)\)", re.sub("“[^”]*”", "", says))
        for name in re.findall(r"`(\w+)`", names)
    ]
    assert sorted((name, sentence.strip(), step, topic) for name, sentence, step, topic in shown) == sorted(
        (name, row.sentence, row.step, row.topic) for name, row in REMEDIES.items()
    )


def test_every_family_of_texts_has_an_example_with_its_step() -> None:
    shown = set()
    for topic, rows in SECTIONS.items():
        for says, step in rows:
            for text in re.findall("“([^”]+)”", says):
                found = step_for(text)
                assert found, text
                assert (found.step, found.topic) == (step, topic), text
                shown.add(found)
    assert {row.step for row in TEXTS if row not in shown} == set()
