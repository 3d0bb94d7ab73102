"""Files for other programs: a wheel has them in `data/`, a checkout in folders of its own."""

from __future__ import annotations

from pathlib import Path


def data_file(name: str, folder: str) -> Path:
    """The path of a file in the installed package, or in `folder` of a checkout."""
    package = Path(__file__).resolve().parent
    installed = package / "data" / name
    return installed if installed.exists() else package.parent / folder / name
