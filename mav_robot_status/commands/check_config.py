"""Say what a configuration means."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..config import describe, load

if TYPE_CHECKING:
    import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Which configuration."""
    parser.add_argument("file", metavar="FILE")


def run(options: argparse.Namespace) -> int:
    """Raises ConfigError where its fault is."""
    from ..gateway.plant import check

    config = load(options.file)
    check(config)
    print("\n".join(describe(config)))  # noqa: T201
    return 0
