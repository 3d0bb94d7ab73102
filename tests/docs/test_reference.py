"""The reference page is what the tables in the code say."""

from __future__ import annotations

import pathlib
import subprocess
import sys

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"


def test_the_reference_page_is_as_the_tables_generate_it(tmp_path: pathlib.Path) -> None:
    fresh = tmp_path / "reference.md"
    subprocess.run([sys.executable, str(DOCS / "make_reference.py"), str(fresh)], check=True)
    assert fresh.read_text(encoding="utf-8") == (DOCS / "reference.md").read_text(encoding="utf-8"), (
        "run python docs/make_reference.py"
    )
