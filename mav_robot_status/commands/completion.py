"""Write a script with which a shell completes the command line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import Final, NamedTuple

from . import COMMANDS, PROGRAM, command

SHELLS: Final = ("bash", "zsh", "fish")
FILES: Final = ("FILE", "DIR", "LOG", "CONNECTION")
"""What the name of a value contains if it can be a file. A connection can be one: a device, or a recorded log."""


class Flag(NamedTuple):
    """One option of a command."""

    names: tuple[str, ...]
    takes: str
    """The name of its value in the help; empty for a switch."""
    choices: tuple[str, ...]
    words: str

    @property
    def is_file(self) -> bool:
        """Whether its value can be the name of a file."""
        return any(word in self.takes for word in FILES)


class Completed(NamedTuple):
    """What can be written after one command."""

    flags: tuple[Flag, ...]
    choices: tuple[str, ...]
    """The words that its first argument can be. Empty: a file, or a word that nobody can guess."""


def parsers() -> dict[str, argparse.ArgumentParser]:
    """The whole parser of each command."""
    made = {}
    for name in COMMANDS:
        made[name] = argparse.ArgumentParser(prog=f"{PROGRAM} {name}")
        command(name).arguments(made[name])
    return made


def completed() -> dict[str, Completed]:
    """What can be written after each command."""
    return {name: _completed(parser) for name, parser in parsers().items()}


def _completed(parser: argparse.ArgumentParser) -> Completed:
    actions = [action for one in (parser, *actions_of(parser).values()) for action in one._actions]
    flags = {
        tuple(one.option_strings): Flag(tuple(one.option_strings), takes(one), _choices(one), one.help or "")
        for one in actions
        if one.option_strings
    }
    return Completed(tuple(flags.values()), next((_choices(one) for one in actions if not one.option_strings), ()))


def actions_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the actions of a command: `px4-events` has `fetch`."""
    nested = next((one for one in parser._actions if isinstance(one, argparse._SubParsersAction)), None)
    return {} if nested is None else dict(nested.choices)


def takes(action: argparse.Action) -> str:
    """The name of the value of an argument in the help; empty for a switch."""
    if action.nargs == 0:
        return ""
    return action.metavar if isinstance(action.metavar, str) else action.dest.upper()


def _choices(action: argparse.Action) -> tuple[str, ...]:
    return tuple(str(one) for one in action.choices or ())


def arguments(parser: argparse.ArgumentParser) -> None:
    """The shell."""
    parser.add_argument("shell", choices=SHELLS, help="the shell that reads the script")


def run(options: argparse.Namespace) -> int:
    """Write the script to standard output."""
    sys.stdout.write("\n".join(_fish() if options.shell == "fish" else _bash(options.shell)) + "\n")
    return 0


def _bash(shell: str) -> Iterator[str]:
    """The script for bash, which zsh understands too."""
    found = completed()
    if shell == "zsh":
        yield "autoload -U +X compinit bashcompinit && compinit && bashcompinit"
    yield "_mav_robot_status() {"
    yield "    local IFS=$' \\n'"
    yield '    local current="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" command=run'
    yield "    COMPREPLY=()"
    yield f'    case "${{COMP_WORDS[1]}}" in {"|".join(found)}) command="${{COMP_WORDS[1]}}";; esac'
    yield '    case "$command $before" in'
    for name, (flags, _) in found.items():
        for flag in filter(lambda flag: flag.takes, flags):
            names = "|".join(f"'{name} {one}'" for one in flag.names)
            answer = _words(flag.choices) if flag.choices else "_mav_robot_status_files" if flag.is_file else ":"
            yield f"        {names}) {answer}; return;;"
    yield "    esac"
    yield '    case "$command $current" in'
    for name, (flags, _) in found.items():
        yield f"        '{name} '-*) {_words([one for flag in flags for one in flag.names])}; return;;"
    yield "    esac"
    yield f'    if [ "$COMP_CWORD" = 1 ]; then {_words([*found, "--help", "--version"])}; fi'
    for name, (_, choices) in found.items():
        if choices:
            yield f'    if [ "$command $COMP_CWORD" = "{name} 2" ]; then {_words(choices)}; return; fi'
    yield '    [ "${#COMPREPLY[@]}" != 0 ] || _mav_robot_status_files'
    yield "}"
    yield "_mav_robot_status_files() {"
    yield "    local IFS=$'\\n'"
    yield '    COMPREPLY=($(compgen -f -- "$current"))'
    yield "}"
    yield f"complete -o filenames -F _mav_robot_status {PROGRAM}"


def _words(words: tuple[str, ...] | list[str]) -> str:
    return f'COMPREPLY=($(compgen -W "{" ".join(words)}" -- "$current"))'


def _fish() -> Iterator[str]:
    found = completed()
    start = f"complete -c {PROGRAM}"
    none = f"not __fish_seen_subcommand_from {' '.join(found)}"
    for name, (flags, choices) in found.items():
        yield f"{start} -n '{none}' -a {name} -d {_quoted(COMMANDS[name])}"
        when = f"__fish_seen_subcommand_from {name}" if name != "run" else f"__fish_seen_subcommand_from run; or {none}"
        if choices:
            yield f"{start} -n '{when}' -f -a {_quoted(' '.join(choices))}"
        for flag in flags:
            names = " ".join(f"-l {one[2:]}" if one.startswith("--") else f"-s {one[1:]}" for one in flag.names)
            value = f" -x -a {_quoted(' '.join(flag.choices))}" if flag.choices else " -r" if flag.takes else ""
            value += " -F" if flag.takes and flag.is_file else ""
            yield f"{start} -n '{when}' {names}{value} -d {_quoted(flag.words)}"


def _quoted(text: str) -> str:
    """A text in fish's single quotes."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
