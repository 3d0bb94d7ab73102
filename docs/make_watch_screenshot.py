"""Draws docs/screenshots/watch.svg: the screen of `watch` with the demo's rover and some others, after sixteen seconds.

    .venv/bin/python docs/make_watch_screenshot.py [FILE]

It uses no sockets, threads or clock, so it draws the same picture every time.
"""

from __future__ import annotations

import io
import logging
import re
import sys
from pathlib import Path

from rich.console import Console
from rich.text import Text

from mav_robot_status.config import Config
from mav_robot_status.gateway.background import Rates, on_a_board
from mav_robot_status.gateway.replay import ReplayPipeline
from mav_robot_status.hardware.mavlink.autopilots.wanted import COMMON, OUTPUT_WATCH
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.publishers.board import Board, BoardPublisher
from mav_robot_status.streams import NO_OUTPUT
from mav_robot_status.testing import DEMO, ManualClock, arducopter, ardurover, px4, px4_vtol
from mav_robot_status.testing.vehicle_model import VehicleModel
from mav_robot_status.views.terminal.paint import STYLES
from mav_robot_status.views.terminal.render import render
from mav_robot_status.views.terminal.state import Logged, State, Ui, Vehicle

FILE = Path(__file__).parent / "screenshots" / "watch.svg"
SCENARIOS = (
    DEMO,
    arducopter.AUTO,
    px4.KILL,
    arducopter.LINK_SILENCE,
    ardurover.RC_ESTOP,
    px4_vtol.TRANSITION,
    ardurover.PREARM_FAILING,
)
CHOSEN = 0
SECONDS, TICK = 15.8, 0.02
SIZE = 100, 28


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    path.parent.mkdir(exist_ok=True)
    logging.disable()
    console = Console(record=True, width=SIZE[0], file=io.StringIO(), color_system="truecolor", force_terminal=True)
    for line in render(play(), *SIZE):
        console.print(Text.assemble(*((span.text, STYLES[span.style]) for span in line)), end="\n", no_wrap=True)
    svg = console.export_svg(title="mav-robot-status watch udp:127.0.0.1:14550", unique_id="watch")
    # the picture must not load fonts from the network
    svg = re.sub(r"@font-face \{.*?\}", "", svg, flags=re.DOTALL)
    path.write_text("".join(line.rstrip() + "\n" for line in svg.splitlines()), "utf-8")


def play() -> State:
    """The state of the screen after SECONDS."""
    clock = ManualClock()
    pipeline = ReplayPipeline(on_a_board(Config()), NO_OUTPUT)
    board = next(p.board for p in pipeline.publishers.values() if isinstance(p, BoardPublisher))
    feeds = []
    for number, scenario in enumerate(SCENARIOS, 1):
        model = VehicleModel(scenario, clock.now().mono)
        for wanted in (*COMMON, *OUTPUT_WATCH):  # the gateway requests missing messages
            model.request(wanted.id, 1 / wanted.rate)
        feeds.append((model, number, Parser(None), Rates()))
    log = []
    for _ in range(round(SECONDS / TICK)):
        now = clock.advance(TICK)
        for model, number, parser, rates in feeds:
            for outgoing in model.run(now):
                for frame in parser.feed(outgoing.frame(number)):
                    pipeline.vehicles.take(frame, now)
                    rates.take(frame.message_id, now.mono)
        lost = _lost(board)
        pipeline.tick(now)
        log += [
            Logged(now.unix_us, f"lost vehicle {name}: no heartbeat for 3.5 s", True) for name in _lost(board) - lost
        ]
    now = clock.now()
    vehicles = []
    for entry, (_, _, _, rates) in zip(board, feeds, strict=True):
        age = None if entry.heartbeat_age is None else entry.heartbeat_age + now.mono - entry.at
        vehicles.append(Vehicle(entry.line, age, rates.at(now.mono)))
    chosen = vehicles[CHOSEN]
    changes = sorted(board.entries[chosen.handle].transitions, key=lambda transition: -transition.at)
    return State(
        "udp:127.0.0.1:14550",
        now,
        tuple(vehicles),
        Ui(chosen.handle),
        changes=tuple((chosen.name, transition) for transition in changes),
        log=tuple(log),
    )


def _lost(board: Board) -> set[str]:
    return {
        f"{entry.line['system']}.{entry.line['component']}" for entry in board if entry.line["link"]["state"] == "LOST"
    }


if __name__ == "__main__":
    main()
