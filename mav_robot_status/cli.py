"""The command line: arguments -> configuration -> run. An error is one line on standard error, and an exit code."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import logging
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING, Final

from . import __version__
from .config import Config, ControllerConfig, LinkConfig, PublisherConfig, SigningConfig, VehicleConfig, describe
from .config import load as load_config
from .errors import MavRobotStatusError, NothingHeardError, UsageError
from .interface import DEFAULT_HANDLE_NAME
from .link.url import help_text, parse
from .streams import StderrHandler, complain, detach, open_missing

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

PROGRAM: Final = "mav-robot-status"
OVERRIDES: Final = (
    "out", "rate", "changes_only", "json", "format", "system", "baud", "passive", "signing_key", "record", "forward",
    "http", "http_token_file", "http_open", "mqtt", "mqtt_robot", "mqtt_spool",
)  # fmt: skip
"""Options that override the configuration."""
FORMATS: Final = ("native", "ros1", "ros2")
OF_BROKER: Final = ("user", "password_file", "ca", "cert", "key", "version", "keepalive")
"""Options of `--mqtt` that the board has too."""


def main(argv: Sequence[str] | None = None) -> int:
    """The command. 0 done; 1 a link or output failed for good; 2 usage, configuration, missing log file."""
    open_missing()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] not in (*COMMANDS, "-h", "--help", "--version"):
        arguments.insert(0, "run")
    try:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, signal.default_int_handler)  # until the gateway has a handler of its own
        return _run(arguments)
    except MavRobotStatusError as error:
        complain(f"{PROGRAM}: {error}")
        return error.exit_code
    except BrokenPipeError:
        detach(sys.stdout)
        return 0
    except KeyboardInterrupt:
        return 0


def _run(arguments: list[str]) -> int:
    try:
        options = _parser().parse_args(arguments)
        command: Callable[[argparse.Namespace], int] = COMMANDS[options.command]
        return command(options)
    finally:
        sys.stdout.flush()  # here, where a reader that has gone can be dealt with


def run(options: argparse.Namespace) -> int:
    """The main job: links in, statuses out."""
    _log_to_stderr(options)
    config = _to_run(options)
    urls = [parse(link.url) for link in config.links]
    logs = [url for url in urls if url.kind == "log"]
    if logs and options.http is not None:
        raise UsageError(f"{logs[0].text}: a recorded log has no live page; write `{PROGRAM} report {logs[0].text}`")
    if logs and options.mqtt is not None:
        raise UsageError(f"{logs[0].text}: a recorded log is no robot's status now: replay it without --mqtt")
    if logs and (len(urls) > 1 or config.outs):
        raise UsageError(f"{logs[0].text}: a recorded log is replayed alone, without other connections or --out")
    if logs and (config.record is not None or config.forward):
        raise UsageError(f"{logs[0].text}: a recorded log is only replayed, without --record and --forward")
    if logs:
        from .gateway.replay import replay

        replay(config, logs[0].device, sys.stdout)
        return 0
    from .gateway.live import Live
    from .gateway.notify import Notifier

    gateway = Live(config, sys.stdout, notifier=Notifier())
    gateway.stop_on_signals()
    if options.config:
        gateway.reload_on_hangup(lambda: _to_run_live(options))
    gateway.run()
    return 0


def _to_run(options: argparse.Namespace) -> Config:
    config = overridden(load_config(options.config) if options.config else Config(), options)
    if not config.links:
        raise UsageError(f"no connection given; write for example {PROGRAM} udp:127.0.0.1:14550")
    return config


def _to_run_live(options: argparse.Namespace) -> Config:
    config = _to_run(options)
    for link in config.links:
        if parse(link.url).kind == "log":
            raise UsageError(f"{link.url}: a recorded log is replayed alone, by a command of its own")
    return config


def explain(options: argparse.Namespace) -> int:
    """Why each field has its value, now or at a moment of a log."""
    _log_to_stderr(options)
    from .gateway.explain import as_json, as_table, explain_live, explain_log

    config = overridden(load_config(options.config) if options.config else Config(), options)
    urls = [parse(link.url) for link in config.links]
    if not urls:
        raise UsageError(f"no connection given; write for example {PROGRAM} explain udp:127.0.0.1:14550")
    if len(urls) == 1 and urls[0].kind == "log":
        found = explain_log(config, urls[0].device, options.at)
    elif options.at is not None:
        raise UsageError("--at is a moment of a recorded log; a live connection is explained now")
    else:
        found = explain_live(config, sys.stdout)
    if not found:
        raise NothingHeardError("no autopilot was heard, so there is nothing to explain")
    print(as_json(found) if options.as_json else as_table(found))  # noqa: T201
    return 0


def doctor(options: argparse.Namespace) -> int:
    """Why is there no status? 0: one can be had on every connection, 1: not."""
    _log_to_stderr(options)
    from .gateway.doctor.listen import examine
    from .gateway.doctor.report import as_json, as_text

    config = overridden(load_config(options.config) if options.config else Config(), options)
    if not config.links:
        raise UsageError(f"no connection given; write for example {PROGRAM} doctor udp:127.0.0.1:14550")
    for link in config.links:  # what is no connection shows now, before the first is listened to
        parse(link.url)
    ok = True
    for link in config.links:
        found, diagnosis = examine(config, link, options.seconds)
        ok = ok and diagnosis.ok
        print(as_json(found, diagnosis) if options.as_json else as_text(found, diagnosis), flush=True)  # noqa: T201
    return 0 if ok else 1


def report(options: argparse.Namespace) -> int:
    """Recorded logs as a picture, or added up as JSON."""
    _log_to_stderr(options)
    from .gateway.report import watch
    from .views.progress import ProgressLine
    from .views.report import as_html, as_json, save
    from .views.timeline import TimelineBuilder

    config = load_config(options.config) if options.config else Config()
    if options.system is not None:
        config = _only(config, options.system)
    timelines = []
    for path in options.logs:
        builder = TimelineBuilder(os.path.basename(path))
        with contextlib.closing(ProgressLine(sys.stderr, f"reading {builder.timeline.name}")) as progress:
            summary = watch(config, path, builder, progress)
        logging.getLogger(__name__).info("%s", summary)
        timelines.append(builder.timeline)
    if not any(timeline.vehicles for timeline in timelines):
        raise NothingHeardError("no autopilot was heard, so there is nothing to show")
    if options.as_json:
        print(as_json(timelines))  # noqa: T201
    if options.output or not options.as_json:
        output = options.output or f"{os.path.splitext(timelines[0].name)[0]}.html"
        save(as_html(timelines, f"{PROGRAM} {__version__}"), output)
        if not options.as_json:
            print(output)  # noqa: T201
    return 0


def watch(options: argparse.Namespace) -> int:
    """A live table of the vehicles, until the person ends it."""
    _log_to_stderr(options)
    from .gateway.watched import Watched
    from .views.terminal import show

    config = overridden(load_config(options.config) if options.config else Config(), options)
    if not config.links:
        raise UsageError(f"no connection given; write for example {PROGRAM} watch udp:127.0.0.1:14550")
    for url in (parse(link.url) for link in config.links):
        if url.kind == "log":
            raise UsageError(f"{url.text} is a recorded log; see it as a picture: {PROGRAM} report {url.text}")
    with Watched(config) as source:
        show(source)
    return 0


def board(options: argparse.Namespace) -> int:
    """All robots of an MQTT broker on one page, until it is ended."""
    _log_to_stderr(options)
    from .publishers.mqtt.options import read_broker
    from .publishers.web.options import read as read_web

    broker = read_broker(_mqtt_options(options, options.broker, OF_BROKER))
    page = read_web(_page_options(options))
    try:
        from .gateway.board import FleetBoard
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("mav_robot_status"):
            raise
        raise UsageError("the board needs extras: pip install 'mav-robot-status[mqtt,web]'") from None
    fleet = FleetBoard(broker, page)
    fleet.stop_on_signals()
    fleet.run()
    return 0


def demo(options: argparse.Namespace) -> int:
    """A fake autopilot and the gateway, in one process."""
    _log_to_stderr(options)
    from .demo import DEMO_CONTROLLER, run_demo

    page = _with_page((DEMO_CONTROLLER,), options)
    run_demo(sys.stdout, loop=options.loop, controllers=page)
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
    "explain": explain,
    "doctor": doctor,
    "report": report,
    "watch": watch,
    "board": board,
    "demo": demo,
    "check-config": check_config,
    "dialect": dialect,
}


def overridden(config: Config, options: argparse.Namespace) -> Config:
    """The configuration with what the command line says instead."""
    links = tuple(LinkConfig(url, bool(options.passive)) for url in options.connections) or config.links
    if options.passive:
        links = tuple(dataclasses.replace(link, passive=True) for link in links)
    if options.baud is not None:
        links = tuple(dataclasses.replace(link, url=_with_baud(link.url, options.baud)) for link in links)
    outs = tuple(LinkConfig(url) for url in options.out) if options.out else config.outs
    for out in outs:
        if parse(out.url).kind == "log":
            raise UsageError(f"{out.url!r} is a log, and an out is sent to: write one like udpout:192.168.1.20:14550")
    if options.system is not None:
        config = _only(config, options.system)
    return dataclasses.replace(
        config,
        links=links,
        outs=outs,
        controllers=_with_mqtt(_with_page(_controllers(config, options), options), options),
        signing=_signing(config.signing, options.signing_key),
        record=config.record if options.record is None else options.record,
        forward=config.forward or bool(options.forward),
    )


def _signing(section: SigningConfig | None, key_file: str | None) -> SigningConfig | None:
    if key_file is None:
        return section
    return SigningConfig(key_file) if section is None else dataclasses.replace(section, key_file=key_file)


def _only(config: Config, system: int) -> Config:
    """The configuration for one vehicle; the controllers of the others are left out."""
    vehicles = tuple(v for v in config.vehicles if v.system == system) or (VehicleConfig(system=system),)
    others = {v.handle for v in config.vehicles} - {v.handle for v in vehicles}
    controllers = tuple(
        c for c in config.controllers if c.parameters.get("handle_name", DEFAULT_HANDLE_NAME) not in others
    )
    return dataclasses.replace(config, vehicles=vehicles, controllers=controllers)


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
    if options.json not in (None, "none") and not any(p.type == "json" for c in changed for p in c.publishers or ()):
        asked = PublisherConfig("json", json_options)
        return tuple(dataclasses.replace(c, publishers=(asked, *(c.publishers or ()))) for c in changed)
    return tuple(changed)


def _with_page(controllers: tuple[ControllerConfig, ...], options: argparse.Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the web page of the command line, instead of one in the configuration."""
    if options.http is None:
        for option in ("http_token_file", "http_open"):
            if getattr(options, option):
                raise UsageError(f"--{option.replace('_', '-')} is for a web page: add --http 127.0.0.1:8765")
        return controllers
    return _with(controllers, PublisherConfig("http", _page_options(options)))


def _page_options(options: argparse.Namespace) -> dict[str, object]:
    asked: dict[str, object] = {"listen": options.http}
    if options.http_token_file:
        asked["token_file"] = options.http_token_file
    if options.http_open:
        asked["open"] = True
    return asked


def _with_mqtt(controllers: tuple[ControllerConfig, ...], options: argparse.Namespace) -> tuple[ControllerConfig, ...]:
    """The controllers with the broker of the command line, instead of one in the configuration."""
    names = (*OF_BROKER, "robot", "spool")
    if options.mqtt is None:
        for name in names:
            if getattr(options, f"mqtt_{name}", None):
                wanted = f"--mqtt-{name.replace('_', '-')}"
                raise UsageError(f"{wanted} is for a broker: add --mqtt mqtts://broker/prefix")
        return controllers
    return _with(controllers, PublisherConfig("mqtt", _mqtt_options(options, options.mqtt, names)))


def _mqtt_options(options: argparse.Namespace, url: str, names: tuple[str, ...]) -> dict[str, object]:
    given = {name: getattr(options, f"mqtt_{name}", None) for name in names}
    return {"url": url, **{name: value for name, value in given.items() if value is not None}}


def _with(controllers: tuple[ControllerConfig, ...], asked: PublisherConfig) -> tuple[ControllerConfig, ...]:
    """The controllers with a publisher, instead of one of its type."""
    from .gateway.plant import DEFAULT_CONTROLLER, DEFAULT_PUBLISHERS

    return tuple(
        dataclasses.replace(
            c,
            publishers=(
                *(p for p in (DEFAULT_PUBLISHERS if c.publishers is None else c.publishers) if p.type != asked.type),
                asked,
            ),
        )
        for c in controllers or (DEFAULT_CONTROLLER,)
    )


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
    parser.set_defaults(**dict.fromkeys(OVERRIDES))  # for the commands that do not have them all
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
    runs.add_argument("--baud", type=_baud, metavar="N", help="baud rate of serial connections (57600)")
    runs.add_argument("--signing-key", metavar="FILE", help="sign what is sent, believe only what is signed")
    runs.add_argument("--record", metavar="FILE", help="record everything received and sent")
    _web(runs)
    runs.add_argument("--mqtt", metavar="URL", help="statuses and events to a broker, e.g. mqtts://broker/robots")
    runs.add_argument("--mqtt-robot", metavar="NAME", help="what a robot is called there ({host}-{system})")
    runs.add_argument("--mqtt-spool", metavar="FILE", help="where events wait that cannot be delivered")
    _broker(runs)
    runs.add_argument("--forward", action="store_true", help="pass every frame on between the links and the outs")
    runs.add_argument("--passive", action="store_true", help="never send anything on the vehicle links")
    _verbosity(runs)

    explains = commands.add_parser(
        "explain",
        help="each field with its value, the rule, what it read, and how old that is",
        epilog=help_text(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    explains.add_argument("connections", nargs="*", metavar="CONNECTION", help="where MAVLink comes from; see below")
    explains.add_argument("--at", metavar="TIME", help="moment of a log: 2026-11-20T18:49:07Z, or +44 (seconds)")
    explains.add_argument("--as-json", action="store_true", help="as JSON, one object for each vehicle")
    explains.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    explains.add_argument("--system", type=_system, metavar="N", help="only the vehicle with this system id")
    explains.add_argument("--baud", type=_baud, metavar="N", help="baud rate of serial connections (57600)")
    explains.add_argument("--signing-key", metavar="FILE", help="believe only what is signed with this key")
    explains.add_argument("--passive", action="store_true", help="never send anything on the vehicle links")
    _verbosity(explains)

    doctors = commands.add_parser(
        "doctor",
        help="why is there no status? what is found on a connection, and the one next action",
        epilog=help_text(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    doctors.add_argument("connections", nargs="*", metavar="CONNECTION", help="what to listen to; see below")
    doctors.add_argument(
        "--seconds", type=_seconds, metavar="S", default=5.0, help="listen so long, from the first heartbeat on (5)"
    )
    doctors.add_argument("--as-json", action="store_true", help="as JSON, one object for each connection")
    doctors.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    doctors.add_argument("--system", type=_system, metavar="N", help="only the vehicle with this system id")
    doctors.add_argument("--baud", type=_baud, metavar="N", help="baud rate of serial connections (57600)")
    doctors.add_argument("--signing-key", metavar="FILE", help="believe only what is signed with this key")
    doctors.add_argument("--passive", action="store_true", help="never send anything on the connections")
    _verbosity(doctors)

    reports = commands.add_parser("report", help="recorded logs as a picture: one HTML file that needs nothing else")
    reports.add_argument("logs", nargs="+", metavar="LOG", help="a recorded log (.tlog)")
    reports.add_argument("-o", "--output", metavar="FILE.html", help="where to write (the log's name with .html, here)")
    reports.add_argument("--as-json", action="store_true", help="totals and intervals as JSON instead, or besides -o")
    reports.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    reports.add_argument("--system", type=_system, metavar="N", help="only the vehicle with this system id")
    _verbosity(reports)

    watches = commands.add_parser(
        "watch",
        help="a live table in the terminal; ? there tells the keys",
        epilog=help_text(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    watches.add_argument("connections", nargs="*", metavar="CONNECTION", help="where MAVLink comes from; see below")
    watches.add_argument("--config", metavar="FILE", help="configuration (YAML)")
    watches.add_argument("--system", type=_system, metavar="N", help="only the vehicle with this system id")
    watches.add_argument("--baud", type=_baud, metavar="N", help="baud rate of serial connections (57600)")
    watches.add_argument("--signing-key", metavar="FILE", help="believe only what is signed with this key")
    watches.add_argument("--passive", action="store_true", help="never send anything on the vehicle links")
    _verbosity(watches)

    boards = commands.add_parser("board", help="all robots of an MQTT broker on one web page")
    boards.add_argument("broker", metavar="URL", help="what the gateways were given, e.g. mqtts://broker/robots")
    _web(boards)
    boards.set_defaults(http="127.0.0.1:8765")
    _broker(boards)
    _verbosity(boards)

    demos = commands.add_parser("demo", help="a fake autopilot and the gateway in one process; about 30 s")
    demos.add_argument("--loop", action="store_true", help="begin again when it ends")
    _web(demos)
    _verbosity(demos)

    checks = commands.add_parser("check-config", help="what a configuration means, or where its fault is")
    checks.add_argument("file", metavar="FILE")

    dialects = commands.add_parser("dialect", help="write the dialect's XML, and Lua for Wireshark")
    dialects.add_argument("-o", "--output", metavar="DIR", default=".", help="folder to write to (this one)")
    return parser


def _web(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--http", metavar="HOST:PORT", help="the statuses as a live web page, e.g. on 127.0.0.1:8765")
    parser.add_argument("--http-token-file", metavar="FILE", help="show the page's data only to who has this token")
    parser.add_argument("--http-open", action="store_true", help="show them to everybody who can reach HOST:PORT")


def _broker(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--mqtt-user", metavar="NAME", help="who we are to the broker")
    parser.add_argument(
        "--mqtt-password-file", metavar="FILE", help="the password, unless it is in MAV_ROBOT_STATUS_MQTT_PASSWORD"
    )
    parser.add_argument("--mqtt-ca", metavar="FILE", help="authority to believe (PEM), instead of the system's")
    parser.add_argument("--mqtt-cert", metavar="FILE", help="our own certificate (PEM)")
    parser.add_argument("--mqtt-key", metavar="FILE", help="its key, if it is not in the same file")
    parser.add_argument("--mqtt-version", choices=("5", "3.1.1"), help="of the protocol (5)")
    parser.add_argument(
        "--mqtt-keepalive", type=float, metavar="S", help="how soon a broken connection is noticed, in seconds (10)"
    )


def _verbosity(parser: argparse.ArgumentParser) -> None:
    group = parser.add_mutually_exclusive_group()
    group.add_argument("-v", "--verbose", action="store_true", help="more in the log")
    group.add_argument("-q", "--quiet", action="store_true", help="only warnings in the log")


def _rate(text: str) -> float:
    with contextlib.suppress(ValueError):
        if abs(rate := float(text)) <= 1000:
            return rate
    raise argparse.ArgumentTypeError(f"{text!r} is not a rate; write a number of Hz up to 1000, 0 for none")


def _seconds(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0 < (seconds := float(text)) <= 3600:
            return seconds
    raise argparse.ArgumentTypeError(f"{text!r} is no time to listen; write a number of seconds up to 3600")


def _system(text: str) -> int:
    return _number(text, "a system id", 255)


def _baud(text: str) -> int:
    return _number(text, "a baud rate", 99_999_999)


def _number(text: str, what: str, most: int) -> int:
    with contextlib.suppress(ValueError):
        if 1 <= (number := int(text)) <= most:
            return number
    raise argparse.ArgumentTypeError(f"{text!r} is not {what}; write a number from 1 to {most}")


def _log_to_stderr(options: argparse.Namespace) -> None:
    level = logging.DEBUG if options.verbose else logging.WARNING if options.quiet else logging.INFO
    logging.basicConfig(level=level, handlers=[StderrHandler(sys.stderr)], format=f"{PROGRAM}: %(message)s")


if __name__ == "__main__":
    sys.exit(main())
