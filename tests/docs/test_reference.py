"""The generated pages match the tables in the code."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import pytest

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.parametrize(
    ("script", "name"),
    [
        ("make_reference.py", "reference/autopilots.md"),
        ("make_language.py", "explanation/language-of-state.md"),
        ("make_unknown.py", "explanation/unknown.md"),
    ],
)
def test_a_generated_page_is_up_to_date(script: str, name: str, tmp_path: pathlib.Path) -> None:
    fresh = tmp_path / "fresh.md"
    subprocess.run([sys.executable, str(DOCS / script), str(fresh)], check=True)
    assert fresh.read_text(encoding="utf-8") == (DOCS / name).read_text(encoding="utf-8"), f"run python docs/{script}"
