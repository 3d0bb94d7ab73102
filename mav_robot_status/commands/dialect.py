"""Write the dialect's files, for other programs."""

from __future__ import annotations

import argparse

from ..streams import say


def arguments(parser: argparse.ArgumentParser) -> None:
    """The folder."""
    parser.add_argument("-o", "--output", metavar="DIR", default=".", help="folder to write to (the current one)")


def run(options: argparse.Namespace) -> int:
    """Print the names of the files."""
    from ..mavlink.dialect_files import write_files

    for path in write_files(options.output):
        say(str(path))
    return 0
