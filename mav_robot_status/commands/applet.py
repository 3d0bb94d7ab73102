"""Write the applet for ArduPilot: a Lua script with which the autopilot reports its emergency stop."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Final

from ..data_files import data_file
from ..errors import LinkError
from ..streams import say

NAME: Final = "robot_status.lua"


def arguments(parser: argparse.ArgumentParser) -> None:
    """The file."""
    parser.add_argument("-o", "--output", metavar="FILE", default="-", help="file to write (standard output)")


def run(options: argparse.Namespace) -> int:
    """Write the script. Raises LinkError if that fails."""
    script = data_file(NAME, "contrib/ardupilot").read_text("utf-8")
    if options.output == "-":
        sys.stdout.write(script)
        return 0
    try:
        Path(options.output).write_text(script, "utf-8")
    except OSError as error:
        raise LinkError(f"cannot write {options.output}: {error.strerror}") from None
    say(options.output)
    return 0
