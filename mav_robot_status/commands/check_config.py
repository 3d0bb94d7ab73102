"""Explain a configuration."""

from __future__ import annotations

import argparse

from ..config import describe, load
from ..streams import say


def arguments(parser: argparse.ArgumentParser) -> None:
    """The file."""
    parser.add_argument("file", metavar="FILE")


def run(options: argparse.Namespace) -> int:
    """Print what the configuration means. Raises ConfigError, which names the place of an error, or UsageError."""
    from ..gateway.controller_config import check
    from ..gateway.events.file import event_table

    config = load(options.file)
    check(config)
    event_table(config)
    say(*describe(config))
    return 0
