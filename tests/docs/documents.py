"""The documents as data: their blocks of code, links and tables."""

from __future__ import annotations

import pathlib
import re
import textwrap
from collections.abc import Iterator
from typing import NamedTuple

ROOT = pathlib.Path(__file__).parents[2]
DOCUMENTS = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))

_FENCE = re.compile(r"^( *)```(\S*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


class Block(NamedTuple):
    """A fenced block."""

    document: pathlib.Path
    line: int
    """Of its first line of code."""
    language: str
    code: str

    @property
    def name(self) -> str:
        return f"{self.document.name}:{self.line}"


def blocks(*languages: str) -> list[Block]:
    """The blocks of all documents, or only those in these languages."""
    found = []
    for document in DOCUMENTS:
        text = document.read_text()
        for fence in _FENCE.finditer(text):
            line = text.count("\n", 0, fence.start()) + 2
            found.append(Block(document, line, fence[2], textwrap.dedent(fence[3])))
    return [block for block in found if not languages or block.language in languages]


def prose(document: pathlib.Path) -> str:
    """A document without its blocks."""
    return _FENCE.sub("", document.read_text())


def links(document: pathlib.Path) -> list[str]:
    """Where it points to inside the repository."""
    return [link for link in _LINK.findall(prose(document)) if "://" not in link]


def table(name: str, first: str, heading: str = "") -> list[list[str]]:
    """The rows of the table whose first column is headed `first`, below `heading`; back quotes are taken away."""
    lines = iter((ROOT / name).read_text().splitlines())
    if heading:
        next(line for line in lines if line == heading)
    next(line for line in lines if line.startswith(f"| {first} |"))
    next(lines)
    return list(_rows(lines))


def _rows(lines: Iterator[str]) -> Iterator[list[str]]:
    for line in lines:
        if not line.startswith("|"):
            return
        yield [cell.strip().replace("`", "") for cell in line.strip("|").split("|")]
