"""Run the gateway on live links, or replay a recorded log."""

from __future__ import annotations

import argparse
import sys

from ..config import Config
from ..errors import UsageError
from ..links.url import parse
from ..publishers.json_lines import JsonOptions
from . import PROGRAM
from .options import (
    arms,
    baud,
    connections,
    gap,
    names,
    publisher,
    publishers,
    px4_events,
    rate,
    system,
    value_of,
    verbosity,
)
from .overrides import configured


def arguments(parser: argparse.ArgumentParser) -> None:
    """All arguments of a gateway."""
    connections(parser)
    parser.add_argument("--config", metavar="FILE", help="configuration (YAML); options override it")
    parser.add_argument("--out", action="append", metavar="CONNECTION", help="also send MAVLink there; repeatable")
    parser.add_argument("--rate", type=rate, metavar="HZ", help="publish_rate of the controllers (10)")
    publisher(parser, JsonOptions)
    parser.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    names(parser)
    parser.add_argument("--baud", type=baud, metavar="N", help="baud rate of serial connections (57600)")
    parser.add_argument("--signing-key", metavar="FILE", help="sign sent frames, accept only signed frames")
    px4_events(parser)
    parser.add_argument("--record", metavar="FILE", help="record all frames received and sent")
    publishers(parser)
    arms(parser)
    parser.add_argument("--forward", action="store_true", help="forward every frame between the links and the outs")
    parser.add_argument("--passive", action="store_true", help="never send on the vehicle links")
    parser.add_argument("--no-kernel-filter", action="store_true", help="has no effect any more; remove it")
    parser.add_argument("--raw", action="store_true", help="the log is a raw capture of MAVLink, without time stamps")
    parser.add_argument(
        "--max-gap", type=gap, metavar="S", help="once the link is lost, a longer silence in a log is one line (60)"
    )
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Run until a signal, or until the end of the log."""
    config = configured(options)
    log = _log(config)
    if log is None:
        _check_live(options)
        return _live(config, options)
    _check_replay(config, options, log)
    from ..gateway.replay import replay

    replay(config, log, sys.stdout, raw=options.raw)
    return 0


def _log(config: Config) -> str | None:
    """The first recorded log among the connections. Raises UsageError for an invalid connection."""
    urls = [parse(link.url) for link in config.links]
    return next((url.device for url in urls if url.kind.is_log), None)


def _live(config: Config, options: argparse.Namespace) -> int:
    from ..gateway.event_loop import EventLoop
    from ..gateway.systemd import SystemdNotifier

    gateway = EventLoop(config, sys.stdout, notifier=SystemdNotifier())
    gateway.stop_on_signals()
    if options.config:
        gateway.reload_on_hangup(lambda: _again(options))
    gateway.run()
    return 0


def _again(options: argparse.Namespace) -> Config:
    """Read the configuration again while the gateway runs."""
    config = configured(options)
    if log := _log(config):
        raise UsageError(f"{log}: a recorded log is replayed alone, with a separate command")
    return config


def _check_live(options: argparse.Namespace) -> None:
    for option in ("--raw", "--max-gap"):
        if value_of(options, option):
            raise UsageError(f"{option} is for a recorded log; write for example {PROGRAM} flight.tlog {option}")


def _check_replay(config: Config, options: argparse.Namespace, log: str) -> None:
    if value_of(options, "--http") is not None:
        raise UsageError(f"{log}: a recorded log has no live page; write `{PROGRAM} report {log}`")
    for option in ("--mqtt", "--simple-message", "--ros2", "--arm"):
        if value_of(options, option) is not None:
            raise UsageError(f"{log}: a recorded log is not a live status: replay it without {option}")
    if len(config.links) > 1 or config.outs:
        raise UsageError(f"{log}: a recorded log is replayed alone, without other connections or --out")
    if config.record is not None or config.forward:
        raise UsageError(f"{log}: a recorded log is only replayed, without --record and --forward")
