"""Writes `docs/man/mav-robot-status.1` from the arguments of the commands: `python docs/make_man.py [OUTPUT_FILE]`.

`tests/docs/test_man.py` runs this and compares, so the page cannot drift from the help.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
from collections.abc import Iterator

from mav_robot_status.commands import COMMANDS, PROGRAM
from mav_robot_status.commands.completion import actions_of, parsers, takes
from mav_robot_status.links.kinds import KINDS

PAGE = pathlib.Path(__file__).resolve().parent / "man" / f"{PROGRAM}.1"

HEAD = f"""\
.\\" Generated from the arguments of the commands by `python docs/make_man.py`; do not edit.
.TH MAV\\-ROBOT\\-STATUS 1 "" "{PROGRAM}" "User Commands"
.SH NAME
{PROGRAM} \\- RobotStatus of MAVLink vehicles
.SH SYNOPSIS
.B {PROGRAM}
[\\fICOMMAND\\fR] \\fICONNECTION\\fR ... [\\fIOPTION\\fR ...]
.SH DESCRIPTION
Can a vehicle move, who is in charge, and if it cannot move, why?
The status is information, not a safety function.
Standard output carries data only, one JSON object a line; the log goes to standard error.
The command \\fBrun\\fR may be left out.
"""
TAIL = """\
.SH EXIT STATUS
.TP
.B 0
done
.TP
.B 1
a link or an output failed for good; \\fBdoctor\\fR: there is no status
.TP
.B 2
usage, configuration, missing log file
"""


def page() -> Iterator[str]:
    yield HEAD
    yield ".SH COMMANDS\n"
    for name, parser in parsers().items():
        yield f".SS {plain(name)}\n{sentence(COMMANDS[name])}\n"
        yield from entries(parser)
        for action, nested in actions_of(parser).items():
            yield f".PP\n.B {plain(f'{name} {action}')}\n"
            yield from entries(nested)
    yield ".SH CONNECTIONS\n"
    for kind in KINDS:
        yield f".TP\n.B {plain(kind.example)}\n{sentence(f'{kind.description}: {kind.forms}')}\n"
    yield TAIL


def entries(parser: argparse.ArgumentParser) -> Iterator[str]:
    """An entry for each argument, the positional ones first."""
    shown = [one for one in parser._actions if "--help" not in one.option_strings]
    for action in sorted(shown, key=lambda one: bool(one.option_strings)):
        if not isinstance(action, argparse._SubParsersAction):
            yield f".TP\n{name_of(action)}\n{sentence(action.help or 'see above')}\n"


def name_of(action: argparse.Action) -> str:
    flags = ", ".join(f"\\fB{plain(one)}\\fR" for one in action.option_strings)
    value = "|".join(map(str, action.choices)) if action.choices else takes(action)
    return " ".join(filter(None, (flags, f"\\fI{plain(value)}\\fR" if value else "")))


def plain(text: str) -> str:
    """A text that roff shows as it is: a hyphen can be copied and searched for."""
    return text.replace("\\", "\\e").replace("-", "\\-").replace("`", "\\(ga").replace("'", "\\(aq")


def sentence(text: str) -> str:
    """A line of text, which is not a request of roff."""
    return "\\&" + plain(" ".join(text.replace("%%", "%").split()))


if __name__ == "__main__":
    output = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else PAGE
    output.write_text("".join(page()), encoding="utf-8")
