"""The page of autopilot tables matches the tables in the code."""

from __future__ import annotations

import pathlib
import subprocess
import sys

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"


def test_the_generated_page_is_up_to_date(tmp_path: pathlib.Path) -> None:
    fresh = tmp_path / "autopilots.md"
    subprocess.run([sys.executable, str(DOCS / "make_reference.py"), str(fresh)], check=True)
    assert fresh.read_text(encoding="utf-8") == (DOCS / "reference" / "autopilots.md").read_text(encoding="utf-8"), (
        "run python docs/make_reference.py"
    )
