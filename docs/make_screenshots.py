"""Makes the pictures of `docs/how-to/web.md`: `python docs/make_screenshots.py [FOLDER]`. Takes two minutes.

Runs the demo's rover, some more vehicles, a real gateway with its page, and chromium.
"""

from __future__ import annotations

import dataclasses
import pathlib
import sys
import threading
import time
from contextlib import ExitStack, closing

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from mav_robot_status.config import Config, LinkConfig, PublisherConfig, VehicleConfig  # noqa: E402
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER  # noqa: E402
from mav_robot_status.gateway.event_loop import EventLoop  # noqa: E402
from mav_robot_status.publishers.web.publisher import HttpPublisher  # noqa: E402
from mav_robot_status.testing import DEMO, FakeAutopilot, arducopter, ardurover, px4  # noqa: E402
from tests.system.browser import MISSING, Browser  # noqa: E402

HISTORY = 90.0
"""Seconds that the demo runs, in a loop, before the pictures: the bands then have a history."""
CRASHED = "document.querySelector('#rows tr td:nth-child(7)')?.innerText.includes('4001')"
"""True after the demo's rover has hit a wall."""
SCREEN, PHONE = (1280, 860), (360, 740)
VEHICLES = tuple(
    VehicleConfig(system=system, handle=name)
    for system, name in enumerate(("rover-north", "copter-3", "rover-south", "px4-quad", "spare"), 1)
)


class Site:
    """The vehicles, the gateway and its page."""

    def __init__(self, stack: ExitStack) -> None:
        page = PublisherConfig("http", {"listen": "127.0.0.1:0"})
        controller = dataclasses.replace(DEFAULT_CONTROLLER, publishers=(page,))
        links = (LinkConfig("udpin:127.0.0.1:0"),)
        self.gateway = EventLoop(Config(links=links, vehicles=VEHICLES, controllers=(controller,)), sys.stdout)
        publisher = next(iter(self.gateway.pipeline.publishers.values()))
        assert isinstance(publisher, HttpPublisher)
        self.url = publisher.url
        self.thread = threading.Thread(target=self.gateway.run, daemon=True)
        self.thread.start()
        stack.callback(self.stop)
        to = ("127.0.0.1", self.gateway.endpoints[0].link.port)  # type: ignore[attr-defined]
        scenarios = (DEMO, arducopter.READY, ardurover.AUTO, px4.READY, ardurover.READY)
        self.vehicles = [
            stack.enter_context(
                FakeAutopilot(scenario, to=to, system=system, loop=scenario is DEMO, on_note=lambda step: None)
            )
            for system, scenario in enumerate(scenarios, 1)
        ]

    def run(self) -> None:
        """Run the vehicles until the page has something to show."""
        time.sleep(5)
        self.vehicles[1].set(safety_switch=True)
        self.vehicles[4].silence()
        time.sleep(HISTORY)

    def stop(self) -> None:
        """End the gateway."""
        self.gateway.stop()
        self.thread.join()


def main() -> int:
    if MISSING is not None:
        print(MISSING, file=sys.stderr)
        return 1
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "screenshots"
    folder.mkdir(exist_ok=True)
    with ExitStack() as stack:
        browser = stack.enter_context(closing(Browser()))
        site = Site(stack)
        site.run()
        browser.driver.get(f"{site.url}#/")
        browser.wait(CRASHED, 60)
        for theme in ("light", "dark"):
            browser.theme(theme)
            for name, size in (("", SCREEN), ("-phone", PHONE)):
                browser.size(*size)
                browser.driver.get("about:blank")
                browser.driver.get(f"{site.url}#/")
                browser.wait("document.querySelectorAll('#rows tr').length === 5")
                browser.picture(folder / f"fleet{name}-{theme}.png")
                browser.ask("location.hash = '#/rover-north'")
                browser.wait(
                    "document.querySelectorAll('#why tr').length === 6 && document.querySelector('#bands svg')"
                )
                browser.picture(folder / f"vehicle{name}-{theme}.png")
        browser.theme("light")
        site.stop()
        browser.wait("document.body.classList.contains('stale')")
        time.sleep(5)
        browser.picture(folder / "gone-phone-light.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
