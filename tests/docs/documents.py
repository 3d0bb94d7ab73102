"""The documents as data: blocks of code, links and tables."""

from __future__ import annotations

import pathlib
import re
import textwrap
from collections.abc import Iterator
from typing import NamedTuple

ROOT = pathlib.Path(__file__).parents[2]
TOP = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")
DOCUMENTS = (*(ROOT / name for name in TOP), *sorted((ROOT / "docs").rglob("*.md")))

_FENCE = re.compile(r"^( *)```(\S*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


class Block(NamedTuple):
    """A fenced block."""

    document: pathlib.Path
    line: int
    """The number of its first line of code."""
    language: str
    code: str

    @property
    def name(self) -> str:
        return f"{name_of(self.document)}:{self.line}"


def name_of(document: pathlib.Path) -> str:
    """Its path in the repository."""
    return document.relative_to(ROOT).as_posix()


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
    """The links of a document to other files of the repository."""
    return [link for link in _LINK.findall(prose(document)) if "://" not in link]


def table(name: str, first: str, heading: str = "") -> list[list[str]]:
    """The rows of the table whose first column is headed `first`, below `heading`, without back quotes."""
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
