"""Draws docs/screenshots/watch.svg: the screen of `watch` with the demo's rover and some others, after sixteen seconds.

    .venv/bin/python docs/make_watch_screenshot.py [FILE]

It uses no sockets and no clock of the machine, so it draws the same picture every time.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.config import Config
from mav_robot_status.gateway.background import Rates, Row, on_a_board
from mav_robot_status.gateway.replay import ReplayPipeline
from mav_robot_status.hardware.mavlink.autopilots.wanted import COMMON, OUTPUT_WATCH
from mav_robot_status.mavlink.framing import Parser
from mav_robot_status.publishers.board import Board, BoardPublisher, Transition
from mav_robot_status.streams import NO_OUTPUT
from mav_robot_status.testing import DEMO, ManualClock, arducopter, ardurover, px4, px4_vtol
from mav_robot_status.testing.vehicle_model import VehicleModel
from mav_robot_status.views.terminal.app import WatchApp
from mav_robot_status.views.terminal.log_lines import LogLines
from mav_robot_status.views.terminal.text import Signs

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
SECONDS, TICK, LOOKS = 15.8, 0.02, 0.5
SIZE = 118, 34


class Source:
    """Plays the scenarios on a clock of its own."""

    connection, advice, explained = "udp:127.0.0.1:14550", "", ""

    def __init__(self) -> None:
        self._clock = ManualClock()
        self._pipeline = ReplayPipeline(on_a_board(Config()), NO_OUTPUT)
        self._feeds = []
        for number, scenario in enumerate(SCENARIOS, 1):
            model = VehicleModel(scenario, self._clock.now().mono)
            for wanted in (*COMMON, *OUTPUT_WATCH):  # the gateway requests missing messages
                model.request(wanted.id, 1 / wanted.rate)
            self._feeds.append((model, number, Parser(None), Rates()))

    def play(self, seconds: float) -> None:
        """Pass some time."""
        for _ in range(round(seconds / TICK)):
            now = self._clock.advance(TICK)
            for model, number, parser, rates in self._feeds:
                for outgoing in model.run(now):
                    for frame in parser.feed(outgoing.frame(number)):
                        self._pipeline.vehicles.on_frame(frame, now)
                        rates.take(frame.message_id, now.mono)
            self._pipeline.tick(now)

    @property
    def board(self) -> Board:
        """The statuses."""
        return next(p.board for p in self._pipeline.publishers.values() if isinstance(p, BoardPublisher))

    @property
    def version(self) -> int:
        """Of the board."""
        return self.board.version

    def now(self) -> Instant:
        """The time of the story."""
        return self._clock.now()

    def wait(self, seconds: float) -> bool:
        """It continues."""
        return False

    def rows(self) -> list[Row]:
        """One row for each vehicle."""
        now, rates = self.now().mono, {number: rates for _, number, _, rates in self._feeds}
        return [
            Row(e.line, e.stamp, e.version, (e.heartbeat_age or 0.0) + now - e.at, rates[e.line["system"]].at(now))
            for e in self.board
        ]

    def changes(self, handles: Iterable[str], most: int) -> list[tuple[str, Transition]]:
        """The changes of these handles, the latest first."""
        found = [(handle, change) for handle in handles for change in self.board.entries[handle].transitions]
        return sorted(found, key=lambda named: -named[1].at)[:most]

    def explanation(self) -> Mapping[str, Any] | None:
        """The evidence of the selected handle."""
        return self._pipeline.explain(self.explained, self.now())


def main() -> None:
    """Write the file."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    path.parent.mkdir(exist_ok=True)
    logging.disable()
    os.environ["TZ"] = "UTC"
    time.tzset()
    svg = asyncio.run(drawn(Source()))
    # the picture must not load fonts from the network
    svg = re.sub(r"@font-face \{.*?\}", "", svg, flags=re.DOTALL)
    svg = re.sub(r"terminal-\d+", "watch", svg)  # a number of each run
    path.write_text("".join(line.rstrip() + "\n" for line in svg.splitlines()), "utf-8")


async def drawn(source: Source) -> str:
    """The screen at the end of the story, as SVG. It looks often: what was known before a loss is remembered."""
    app = WatchApp(source, LogLines(), Signs())
    async with app.run_test(size=SIZE) as pilot:
        for _ in range(round(SECONDS / LOOKS)):
            source.play(LOOKS)
            app.look()
        await pilot.pause()
        app.refresh(repaint=True, layout=True)
        await pilot.pause()
        return app.export_screenshot(title="mav-robot-status watch udp:127.0.0.1:14550")


if __name__ == "__main__":
    main()
