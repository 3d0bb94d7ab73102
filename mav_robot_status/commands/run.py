"""The main job: links in, statuses out; or a recorded log instead of the links."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

from ..errors import UsageError
from ..link.url import parse
from . import PROGRAM
from .options import baud, broker, connections, rate, system, verbosity, web
from .overrides import configured

if TYPE_CHECKING:
    import argparse

    from ..config import Config

FORMATS: Final = ("native", "ros1", "ros2")


def arguments(parser: argparse.ArgumentParser) -> None:
    """All that a gateway can be told."""
    connections(parser)
    parser.add_argument("--config", metavar="FILE", help="configuration (YAML); options override it")
    parser.add_argument("--out", action="append", metavar="CONNECTION", help="where MAVLink goes besides; repeatable")
    parser.add_argument("--rate", type=rate, metavar="HZ", help="publish_rate of the controllers (10)")
    parser.add_argument("--changes-only", action="store_true", help="JSON lines only when something changes")
    parser.add_argument("--json", metavar="FILE|-|none", help="where the JSON lines go (-: standard output)")
    parser.add_argument("--format", choices=FORMATS, help="form of the JSON lines (native)")
    parser.add_argument("--system", type=system, metavar="N", help="only the vehicle with this system id")
    parser.add_argument("--baud", type=baud, metavar="N", help="baud rate of serial connections (57600)")
    parser.add_argument("--signing-key", metavar="FILE", help="sign what is sent, believe only what is signed")
    parser.add_argument("--record", metavar="FILE", help="record everything received and sent")
    web(parser)
    parser.add_argument("--mqtt", metavar="URL", help="statuses and events to a broker, e.g. mqtts://broker/robots")
    parser.add_argument("--mqtt-robot", metavar="NAME", help="what a robot is called there ({host}-{system})")
    parser.add_argument("--mqtt-spool", metavar="FILE", help="where events wait that cannot be delivered")
    broker(parser)
    parser.add_argument("--forward", action="store_true", help="pass every frame on between the links and the outs")
    parser.add_argument("--passive", action="store_true", help="never send anything on the vehicle links")
    verbosity(parser)


def run(options: argparse.Namespace) -> int:
    """Until it is ended, or the log is."""
    config = configured(options)
    log = _log(config)
    if log is None:
        return _live(config, options)
    _check_replay(config, options, log)
    from ..gateway.replay import replay

    replay(config, log, sys.stdout)
    return 0


def _log(config: Config) -> str | None:
    """The first recorded log among the connections. Raises UsageError for what is no connection."""
    urls = [parse(link.url) for link in config.links]
    return next((url.device for url in urls if url.kind == "log"), None)


def _live(config: Config, options: argparse.Namespace) -> int:
    from ..gateway.live import Live
    from ..gateway.notify import Notifier

    gateway = Live(config, sys.stdout, notifier=Notifier())
    gateway.stop_on_signals()
    if options.config:
        gateway.reload_on_hangup(lambda: _again(options))
    gateway.run()
    return 0


def _again(options: argparse.Namespace) -> Config:
    """The configuration, read again while the gateway runs."""
    config = configured(options)
    if log := _log(config):
        raise UsageError(f"{log}: a recorded log is replayed alone, by a command of its own")
    return config


def _check_replay(config: Config, options: argparse.Namespace, log: str) -> None:
    if options.http is not None:
        raise UsageError(f"{log}: a recorded log has no live page; write `{PROGRAM} report {log}`")
    if options.mqtt is not None:
        raise UsageError(f"{log}: a recorded log is no robot's status now: replay it without --mqtt")
    if len(config.links) > 1 or config.outs:
        raise UsageError(f"{log}: a recorded log is replayed alone, without other connections or --out")
    if config.record is not None or config.forward:
        raise UsageError(f"{log}: a recorded log is only replayed, without --record and --forward")
