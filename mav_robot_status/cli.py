"""The command line: arguments select a command. An error is one line on standard error and an exit code."""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
import threading
from collections.abc import Sequence
from typing import NoReturn

from .commands import COMMANDS, PROGRAM, command
from .errors import MavRobotStatusError, UsageError
from .streams import StderrHandler, complain, detach, open_missing, writing
from .version import __version__


class _Arguments(argparse.ArgumentParser):
    """Reports an error in one line. argparse would print all options first."""

    def error(self, message: str) -> NoReturn:
        """Raises UsageError."""
        raise UsageError(f"{message}; see {self.prog} --help")


def main(argv: Sequence[str] | None = None) -> int:
    """Returns the exit code: 0 done; 1 a link or output failed for good; 2 usage, configuration, missing log file."""
    open_missing()
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        if not arguments or arguments[0] not in (*COMMANDS, "-h", "--help", "-V", "--version"):
            _doubt_command(arguments[:1])
            arguments.insert(0, "run")
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, signal.default_int_handler)  # until the gateway installs its handler
        return _run(arguments)
    except MavRobotStatusError as error:
        complain(f"{PROGRAM}: {error}")
        return error.exit_code
    except BrokenPipeError:
        detach(sys.stdout)
        return 0
    except KeyboardInterrupt:
        return 0


def _doubt_command(first: Sequence[str]) -> None:
    """Raise UsageError if the first argument looks like a misspelt command."""
    for word in first:
        if ":" in word or os.path.exists(word):  # a connection
            continue
        import difflib

        near = difflib.get_close_matches(word, COMMANDS, 1, 0.75)
        if near:
            raise UsageError(f"there is no command '{word}'; did you mean '{near[0]}'?")


def _run(arguments: list[str]) -> int:
    try:
        options = _options(arguments)
        if "verbose" in options:
            _log_to_stderr(options)
        return command(options.command).run(options)
    finally:
        with writing():
            sys.stdout.flush()  # here, where a closed pipe can be handled


def _options(arguments: list[str]) -> argparse.Namespace:
    """The arguments, read. Only the given command is imported and declares its arguments."""
    if arguments[0] not in COMMANDS:
        return _parser().parse_args(arguments)
    from .commands.options import Help

    name = arguments[0]
    parser = _Arguments(prog=f"{PROGRAM} {name}", formatter_class=Help)
    command(name).arguments(parser)
    return parser.parse_args(arguments[1:], argparse.Namespace(command=name))


def _parser() -> argparse.ArgumentParser:
    """The parser of the help that lists every command, and of the version."""
    parser = _Arguments(
        prog=PROGRAM,
        description="RobotStatus of MAVLink vehicles: can it move, who is in charge, and if it cannot move, why? "
        "The status is information, not a safety function.",
        epilog="The command `run` may be left out. If there is no status, `mav-robot-status doctor CONNECTION` names "
        "the cause and the next step.",
    )
    parser.add_argument("-V", "--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, words in COMMANDS.items():
        commands.add_parser(name, help=words)
    return parser


def _log_to_stderr(options: argparse.Namespace) -> None:
    level = logging.DEBUG if options.verbose else logging.WARNING if options.quiet else logging.INFO
    logging.basicConfig(level=level, handlers=[StderrHandler(sys.stderr, f"{PROGRAM}: %(message)s")])


if __name__ == "__main__":
    sys.exit(main())
