"""The command line: arguments -> configuration -> run. An error is one line on standard error, and an exit code."""

from __future__ import annotations

import argparse
import dataclasses
import logging
import sys
from typing import TYPE_CHECKING, Final

from . import __version__
from .config import Config, ControllerConfig, LinkConfig, PublisherConfig, VehicleConfig, describe
from .config import load as load_config
from .errors import MavRobotStatusError, UsageError
from .link.url import help_text, parse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

PROGRAM: Final = "mav-robot-status"
FORMATS: Final = ("native", "ros1", "ros2")


def main(argv: Sequence[str] | None = None) -> int:
    """The command. 0 done; 1 a link or output failed for good; 2 usage, configuration, missing log file."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] not in (*COMMANDS, "-h", "--help", "--version"):
        arguments.insert(0, "run")
    options = _parser().parse_args(arguments)
    try:
        command: Callable[[argparse.Namespace], int] = COMMANDS[options.command]
        return command(options)
    except MavRobotStatusError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)  # noqa: T201
        return error.exit_code
    except BrokenPipeError:
        from .publishers.json_lines import stdout_is_closed

        stdout_is_closed()
        return 0
    except KeyboardInterrupt:
        return 0


def run(options: argparse.Namespace) -> int:
    """The main job: links in, statuses out."""
    _log_to_stderr(options)
    config = overridden(load_config(options.config) if options.config else Config(), options)
    if not config.links:
        raise UsageError(f"no connection given; write for example {PROGRAM} udp:127.0.0.1:14550")
    urls = [parse(link.url) for link in config.links]
    logs = [url for url in urls if url.kind == "log"]
    if logs and (len(urls) > 1 or config.outs):
        raise UsageError(f"{logs[0].text}: a recorded log is replayed alone, without other connections or --out")
    if logs:
        from .gateway.replay import replay

        replay(config, logs[0].device, sys.stdout)
        return 0
    from .gateway.live import Live

    gateway = Live(config, sys.stdout)
    gateway.stop_on_signals()
    gateway.run()
    return 0


def demo(options: argparse.Namespace) -> int:
    """A fake autopilot and the gateway, in one process."""
    _log_to_stderr(options)
    from .demo import run_demo

    run_demo(sys.stdout, loop=options.loop)
    return 0


def check_config(options: argparse.Namespace) -> int:
    """Say what a configuration means."""
    from .gateway.plant import check

    config = load_config(options.file)
    check(config)
    print("\n".join(describe(config)))  # noqa: T201
    return 0


def dialect(options: argparse.Namespace) -> int:
    """Write the dialect's files."""
    from .mavlink.dialect_files import write_files

    for path in write_files(options.output):
        print(path)  # noqa: T201
    return 0


COMMANDS: Final[dict[str, Callable[[argparse.Namespace], int]]] = {
    "run": run,
    "demo": demo,
    "check-config": check_config,
    "dialect": dialect,
}


def overridden(config: Config, options: argparse.Namespace) -> Config:
    """The configuration with what the command line says instead."""
    links = tuple(LinkConfig(url, options.passive) for url in options.connections) or config.links
    if options.passive:
        links = tuple(dataclasses.replace(link, passive=True) for link in links)
    if options.baud is not None:
        links = tuple(dataclasses.replace(link, url=_with_baud(link.url, options.baud)) for link in links)
    changes: dict[str, object] = {"links": links}
    if options.out:
        changes["outs"] = tuple(LinkConfig(url) for url in options.out)
    if options.system is not None:
        changes["vehicles"] = tuple(v for v in config.vehicles if v.system == options.system) or (
            VehicleConfig(system=options.system),
        )
    changes["controllers"] = _controllers(config, options)
    for link in (*links, *changes.get("outs", config.outs)):  # type: ignore[misc]
        parse(link.url)
    return dataclasses.replace(config, **changes)  # type: ignore[arg-type]


def _controllers(config: Config, options: argparse.Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the command line's rate and JSON options; none if nothing differs from the default."""
    json_options: dict[str, object] = {}
    if options.json not in (None, "none"):
        json_options["path"] = options.json
    if options.format is not None:
        json_options["format"] = options.format
    if options.changes_only:
        json_options["changes_only"] = True
    rate = {} if options.rate is None else {"publish_rate": options.rate}
    if not (rate or json_options or options.json == "none"):
        return config.controllers
    from .gateway.plant import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

    changed = []
    for controller in config.controllers or (DEFAULT_CONTROLLER,):
        publishers = controller.publishers if controller.publishers is not None else DEFAULT_PUBLISHERS
        changed.append(
            dataclasses.replace(
                controller,
                parameters={**controller.parameters, **rate},
                publishers=tuple(
                    PublisherConfig(p.type, {**p.options, **json_options}) if p.type == "json" else p
                    for p in publishers
                    if p.type != "json" or options.json != "none"
                ),
            )
        )
    return tuple(changed)


def _with_baud(url: str, baud: int) -> str:
    parsed = parse(url, baud)
    return f"{parsed.device},{parsed.baud}" if parsed.kind == "serial" else url


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        description="RobotStatus of MAVLink vehicles: can it move, who is in charge, and if it cannot move, why? "
        "The status informs; it is no safety function.",
        epilog="The command `run` may be left out.",
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    runs = commands.add_parser(
        "run",
        help="the main job: statuses of the vehicles heard, as JSON lines and as MAVLink",
        epilog=help_text(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    runs.add_argument("connections", nargs="*", metavar="CONNECTION", help="where MAVLink comes from; see below")
    runs.add_argument("--config", metavar="FILE", help="configuration (YAML); options override it")
    runs.add_argument("--out", action="append", metavar="CONNECTION", help="where MAVLink goes besides; repeatable")
    runs.add_argument("--rate", type=_rate, metavar="HZ", help="publish_rate of the controllers (10)")
    runs.add_argument("--changes-only", action="store_true", help="JSON lines only when something changes")
    runs.add_argument("--json", metavar="FILE|-|none", help="where the JSON lines go (-: standard output)")
    runs.add_argument("--format", choices=FORMATS, help="form of the JSON lines (native)")
    runs.add_argument("--system", type=_system, metavar="N", help="only the vehicle with this system id")
    runs.add_argument("--baud", type=int, metavar="N", help="baud rate of serial connections (57600)")
    runs.add_argument("--passive", action="store_true", help="never send anything on the vehicle links")
    _verbosity(runs)

    demos = commands.add_parser("demo", help="a fake autopilot and the gateway in one process; about 30 s")
    demos.add_argument("--loop", action="store_true", help="begin again when it ends")
    _verbosity(demos)

    checks = commands.add_parser("check-config", help="what a configuration means, or where its fault is")
    checks.add_argument("file", metavar="FILE")

    dialects = commands.add_parser("dialect", help="write the dialect's XML, and Lua for Wireshark")
    dialects.add_argument("-o", "--output", metavar="DIR", default=".", help="folder to write to (this one)")
    return parser


def _verbosity(parser: argparse.ArgumentParser) -> None:
    group = parser.add_mutually_exclusive_group()
    group.add_argument("-v", "--verbose", action="store_true", help="more in the log")
    group.add_argument("-q", "--quiet", action="store_true", help="only warnings in the log")


def _rate(text: str) -> float:
    rate = float(text)
    if not abs(rate) <= 1000:
        raise argparse.ArgumentTypeError(f"{text} is not a rate; write a number of Hz up to 1000, 0 for none")
    return rate


def _system(text: str) -> int:
    number = int(text)
    if not 1 <= number <= 255:
        raise argparse.ArgumentTypeError(f"{text} is not a system id; write a number from 1 to 255")
    return number


def _log_to_stderr(options: argparse.Namespace) -> None:
    level = logging.DEBUG if options.verbose else logging.WARNING if options.quiet else logging.INFO
    logging.basicConfig(level=level, stream=sys.stderr, format=f"{PROGRAM}: %(message)s")


if __name__ == "__main__":
    sys.exit(main())
