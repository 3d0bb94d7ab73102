"""What the command can do: a row of `COMMANDS` and a module of the same name for each.

A command's module is imported when it is asked for and not before, and what it needs when it runs. Beside them:
`options` are what several commands let a person say, `overrides` what is said instead of the configuration.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Final, Protocol, cast

if TYPE_CHECKING:
    import argparse

PROGRAM: Final = "mav-robot-status"
COMMANDS: Final = {
    "run": "the main job: statuses of the vehicles heard, as JSON lines and as MAVLink",
    "explain": "each field with its value, the rule, what it read, and how old that is",
    "doctor": "why is there no status? what is found on a connection, and the one next action",
    "report": "recorded logs as a picture: one HTML file that needs nothing else",
    "watch": "a live table in the terminal; ? there tells the keys",
    "board": "all robots of an MQTT broker on one web page",
    "demo": "a fake autopilot and the gateway in one process; about 30 s",
    "check-config": "what a configuration means, or where its fault is",
    "dialect": "write the dialect's XML, and Lua for Wireshark",
}
"""Every command with its line in the help, in the order in which the help shows them."""


class Command(Protocol):
    """A command's module."""

    def arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add what the command lets a person say."""

    def run(self, options: argparse.Namespace) -> int:
        """Do it; the exit code. Raises MavRobotStatusError."""


def command(name: str) -> Command:
    """The module of a row of `COMMANDS`."""
    return cast("Command", import_module(f"{__name__}.{name.replace('-', '_')}"))
