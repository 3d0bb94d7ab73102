"""Every view shows the words, shapes and tones of the one table. A new view is one more row of VIEWS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any, NamedTuple

import pytest

from mav_robot_status.interface import STATES
from mav_robot_status.language import LINK, LOOKS, TONES, headline

from . import scenes
from .browser import MISSING, Browser
from .scenes import Line, Page


class Shown(NamedTuple):
    """One value in a view; None: this view does not show it."""

    word: str
    shape: str | None
    tone: str | None


View = Callable[[Line], dict[str, Shown]]
"""Shows one robot; what it says of each field and of the link, and as `headline` of the whole."""

CHIP = """
    (chip) => [chip.innerText, chip.querySelector("use").getAttribute("href").slice(1),
               [...chip.classList].find((name) => name !== "chip") ?? null]
"""
NAMES = "return import('./words.js').then((words) => [...words.FIELDS, words.LINK].map((one) => [one.NAME, one.name]))"


def rows() -> Iterator[tuple[str, Any]]:
    """Every value of every field."""
    for field, looks in LOOKS.items():
        for value in looks:
            yield field, value


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if MISSING is not None:
        pytest.skip(MISSING)
    with closing(Browser()) as window:
        yield window


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with Page() as shown:
        yield shown


@pytest.fixture(scope="module")
def on_the_page(browser: Browser, page: Page) -> View:
    """The page of one robot."""
    names = [*(field.name for field in STATES), LINK]

    def view(line: Line) -> dict[str, Shown]:
        page.only([])
        page.put(line, last=line)
        place = f"{page.url}#/{line['handle']}"
        if browser.driver.current_url != place:
            browser.driver.get(place)
        browser.wait(f"document.querySelector('#who').innerText.includes('1.{line['component']}')")
        titles = dict(browser.ask(NAMES.replace("NAME", "title")))
        tiles = browser.ask(
            "return [...document.querySelectorAll('#tiles > div')].map((one) =>"
            f" [one.querySelector('dt').innerText, ({CHIP})(one.querySelector('.chip'))])"
        )
        found = {titles[title]: Shown(*chip) for title, chip in tiles}
        assert set(found) == set(names)
        word, shape, tone = browser.ask(
            "const top = document.querySelector('#verdict'); return [top.querySelector('strong').innerText,"
            " top.querySelector('use').getAttribute('href').slice(1), top.className]"
        )
        return {**found, "headline": Shown(word, shape, tone)}

    return view


@pytest.fixture(scope="module")
def on_the_board(browser: Browser, page: Page) -> View:
    """The line of one robot among others: its headline, and the short words of its fields."""

    def view(line: Line) -> dict[str, Shown]:
        page.only([scenes.parked("other", 200)])
        page.put(line)
        if browser.driver.current_url != f"{page.url}#/":
            browser.driver.get(f"{page.url}#/")
        row = (
            f"[...document.querySelectorAll('#rows tr')].find((one) => one.innerText.includes('1.{line['component']}'))"
        )
        browser.wait(row)
        heads = dict(browser.ask(NAMES.replace("NAME", "head")))
        cells = browser.ask(
            f"return [...{row}.querySelectorAll('.field, .link')].map((one) =>"
            f" [one.dataset.head, ({CHIP})(one.querySelector('.chip'))])"
        )
        whole = browser.ask(f"return ({CHIP})({row}.querySelector('.state .chip'))")
        return {**{heads[head]: Shown(*chip) for head, chip in cells}, "headline": Shown(*whole)}

    return view


VIEWS = ("on_the_page", "on_the_board")
SHORT = ("on_the_board",)
"""The views that use the short words."""


@pytest.mark.slow
@pytest.mark.parametrize("name", VIEWS)
def test_a_view_says_what_the_table_says(name: str, request: pytest.FixtureRequest) -> None:
    view: View = request.getfixturevalue(name)
    for number, (field, value) in enumerate(rows(), 1):
        line = scenes.line("robot", component=number)
        if field == LINK:
            line["link"] = {"state": value, "heartbeat_age": None}
        else:
            line[field] = value
        shown = view(line)
        look = LOOKS[field][value]
        word = look.short or look.word if name in SHORT else look.word
        assert shown[field] == Shown(word, shown[field].shape and look.shape, shown[field].tone and look.tone)
        whole = headline(line)
        assert shown["headline"] == Shown(whole.word, whole.state.shape, whole.tone), (field, value)


def test_the_page_has_the_colours_of_the_table(browser: Browser, page: Page) -> None:
    browser.driver.get(page.url)
    for theme in ("light", "dark"):
        browser.theme(theme)
        for name, tone in TONES.items():
            asked = f"return getComputedStyle(document.documentElement).getPropertyValue('--{name}').trim()"
            assert browser.ask(asked) == getattr(tone, theme)
    browser.theme("light")
