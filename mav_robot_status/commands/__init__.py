"""The subcommands: a row of `COMMANDS` and a module of the same name for each.

The module of a command is imported only for that command, and it imports what it needs when it runs. `options` has the
arguments that several commands share; `overrides` and `arms` apply them to the configuration.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from typing import Final, Protocol, cast

PROGRAM: Final = "mav-robot-status"
COMMANDS: Final = {
    "run": "publish the statuses of all vehicles heard, as JSON lines and as MAVLink (the default)",
    "explain": "show each field with its value, the rule, the message that it read and its age",
    "doctor": "find out why there is no status, and name the next step",
    "report": "draw recorded logs as one self-contained HTML file",
    "watch": "show a live table in the terminal",
    "board": "show all robots of an MQTT broker on one web page",
    "demo": "show fake vehicles and the gateway in one process, without any vehicle",
    "check-config": "explain a configuration, or show where its error is",
    "dialect": "write the dialect's XML, and a Lua dissector for Wireshark",
    "px4-events": "read the table of its events from a PX4, for `--px4-events`",
    "applet": "write the Lua script with which an ArduPilot reports its emergency stop",
    "completion": "write a script with which bash, zsh or fish completes the command line",
}
"""Every command with its help line, in the order of the help."""


class Command(Protocol):
    """A command's module."""

    def arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments of the command."""

    def run(self, options: argparse.Namespace) -> int:
        """Run the command and return its exit code. Raises MavRobotStatusError."""


def command(name: str) -> Command:
    """The module of a row of `COMMANDS`."""
    return cast("Command", import_module(f"{__name__}.{name.replace('-', '_')}"))
