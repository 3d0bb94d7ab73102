"""Makes pictures of the page: `python docs/make_screenshots.py [-o FOLDER]`. Takes half a minute and needs chromium.

Without a folder, the few pictures of the documents go to `docs/screenshots`. With one, it gets every state: one robot
in each, fleets of several sizes, a group, new alarms, a gateway that is gone; on a desktop and a phone, light and dark.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
from collections.abc import Container, Iterator
from contextlib import ExitStack, closing
from typing import Any, NamedTuple

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from tests.system import scenes  # noqa: E402
from tests.system.browser import MISSING, Browser  # noqa: E402

SCREEN, WALL, PHONE = (1280, 860), (1920, 1080), (360, 740)
ALL = tuple(f"{kind}{name}-light" for kind in ("gone", "gone-fleet", "alarm", "help") for name in ("", "-phone"))
FEW = ("fleet-light", "fleet-phone-light", "lost-light", "vehicle-light", "vehicle-dark", "gone-phone-light")
"""The pictures of the documents."""
EXPLANATION = {
    "mode": {"value": "AUTO", "rule": "custom_mode 10 is AUTO", "source": "HEARTBEAT", "age": 0.4},
    "e_stopped": {"value": False, "rule": "the motors run", "source": "SERVO_OUTPUT_RAW", "age": 0.2},
    "drives_powered": {"value": True, "rule": "armed", "source": "HEARTBEAT", "age": 0.4},
    "motion_possible": {"value": True, "rule": "nothing inhibits motion", "source": "SYS_STATUS", "age": 0.3},
    "in_motion": {"value": True, "rule": "1.52 m/s is more than 0.1 m/s", "source": "VFR_HUD", "age": 0.1},
    "in_error": {"value": True, "rule": "battery 1 is critical", "source": "STATUSTEXT", "age": 40.2},
}


class Scene(NamedTuple):
    """What one picture shows."""

    name: str
    lines: list[scenes.Line]
    place: str = "#/"
    size: tuple[int, int] = SCREEN


def all_scenes() -> Iterator[Scene]:
    """Every picture, without its theme."""
    for state in scenes.STATES:
        for name, size in (("", SCREEN), ("-phone", PHONE)):
            yield Scene(f"{state.__name__.replace('_', '-')}{name}", [state("rover-1")], size=size)
    for number, size in ((3, SCREEN), (20, SCREEN), (50, WALL), (254, WALL), (20, PHONE)):
        yield Scene(f"fleet-{number}{'-phone' if size is PHONE else ''}", scenes.fleet(number), size=size)
    for name, size in (("", SCREEN), ("-phone", PHONE)):
        yield Scene(f"fleet{name}", scenes.fleet(12), size=size)
        yield Scene(f"group{name}", scenes.group(), "#/robot", size)
        yield Scene(f"group-list{name}", scenes.group(), "#/", size)
        yield Scene(f"vehicle{name}", [scenes.in_error("rover-north"), *scenes.fleet(3)], "#/rover-north", size)


def story(page: scenes.Page, handle: str, last: scenes.Line) -> None:
    """Ten minutes of a robot, for the bands."""
    steps: tuple[Any, ...] = (scenes.unsure, scenes.parked, scenes.failing, scenes.ready, scenes.moving, scenes.stopped)
    for n, state in enumerate((*steps, scenes.parked, scenes.moving, scenes.lost, scenes.moving)):
        page.put(state(handle, last["system"]), ago=540 - 50 * n)
    page.put(last)


def shoot(browser: Browser, page: scenes.Page, scene: Scene, path: pathlib.Path) -> None:
    """One picture."""
    browser.size(*scene.size)
    shown = next((one for one in scene.lines if scene.place == f"#/{one['handle']}"), None)
    page.only([one for one in scene.lines if one is not shown or "members" in one])
    if shown is not None and "members" not in shown:
        story(page, shown["handle"], shown)
    browser.driver.get("about:blank")
    browser.driver.get(f"{page.url}{scene.place}")
    if len(scene.lines) > 1 and shown is None:
        browser.wait(f"document.querySelectorAll('#rows tr').length === {len(scene.lines)}")
    else:
        browser.wait("document.querySelector('#verdict strong') && document.querySelector('#bands svg')")
        page.explain(str(scene.lines[0]["handle"]), EXPLANATION)
        browser.wait("document.querySelectorAll('#why tr').length === 6")
    browser.picture(path)


def gone(browser: Browser, folder: pathlib.Path, names: Container[str]) -> None:
    """A page whose gateway is gone, one with new alarms, and the help: those with these names."""

    def picture(name: str) -> None:
        if name in names:
            browser.picture(folder / f"{name}.png")

    for name, size in (("", SCREEN), ("-phone", PHONE)):
        browser.size(*size)
        for kind, lines in (("gone", [scenes.moving("rover-1")]), ("gone-fleet", scenes.fleet(12))):
            with scenes.Page() as page:
                page.only(lines)
                browser.driver.get(page.url)
                browser.wait("document.querySelector('#connection').innerText === 'live'")
            browser.wait("document.body.classList.contains('stale')")
            picture(f"{kind}{name}-light")
        with scenes.Page(alarm=True) as page:
            page.only(scenes.fleet(12))
            browser.driver.get("about:blank")
            browser.driver.get(page.url)
            browser.wait("!document.querySelector('#alarms').hidden")
            picture(f"alarm{name}-light")
            browser.driver.get(f"{page.url}help.html")
            picture(f"help{name}-light")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="a folder for the pictures of every state")
    parser.add_argument("--only", default="", help="only pictures with this in their name")
    options = parser.parse_args()
    if MISSING is not None:
        print(MISSING, file=sys.stderr)
        return 1
    folder = options.output or HERE / "screenshots"
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        browser = stack.enter_context(closing(Browser()))
        page = stack.enter_context(scenes.Page())
        for theme in ("light", "dark"):
            browser.theme(theme)
            for scene in all_scenes():
                name = f"{scene.name}-{theme}"
                if options.only in name and (options.output or name in FEW):
                    shoot(browser, page, scene, folder / f"{name}.png")
        if options.only in "gone alarm help":
            browser.theme("light")
            gone(browser, folder, FEW if options.output is None else ALL)
    return 0


if __name__ == "__main__":
    sys.exit(main())
