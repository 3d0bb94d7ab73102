from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_the_how_to_shows_the_example_that_is_tested() -> None:
    shown = (ROOT / "docs" / "how-to" / "hardware-interface.md").read_text()
    assert (ROOT / "tests" / "examples" / "line_robot.py").read_text() in shown
