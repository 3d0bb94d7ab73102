from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(("page", "module"), [("hardware-interface", "line_robot"), ("arm", "acme_arm")])
def test_a_how_to_shows_the_example_that_is_tested(page: str, module: str) -> None:
    shown = (ROOT / "docs" / "how-to" / f"{page}.md").read_text()
    assert (ROOT / "tests" / "examples" / f"{module}.py").read_text() in shown
