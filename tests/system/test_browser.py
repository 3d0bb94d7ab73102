"""The page in a real browser: what it shows of each state, and how it can be used."""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import now
from mav_robot_status.testing import FakeAutopilot, ardurover

from ..deadline import in_time, wait_until
from ..ports import free_port
from . import scenes
from .browser import MISSING, Browser
from .gateway_process import Gateway
from .scenes import Page
from .test_web import PAGE, url
from .wire import Wire

pytestmark = pytest.mark.skipif(MISSING is not None, reason=MISSING or "")

HANDLE = "industrial_robot_status_handle"
NARROW = 360
LIVE = "document.querySelector('#connection').innerText === 'live'"
WORD = "document.querySelector('#verdict strong')?.innerText"
ORDER = "[...document.querySelectorAll('#rows th a')].map((one) => one.innerText)"
OUTSIDE = (
    "return [...document.querySelectorAll('header *, main *, footer *')].filter((one) => one.checkVisibility()"
    " && one.getBoundingClientRect().right > innerWidth + 1).map((one) => one.outerHTML)"
)
AXE = (
    "const [options, done] = arguments;"
    "axe.run(options).then((found) => done(found.violations.map((one) => [one.id, one.nodes[0].html])))"
)
GROUP = scenes.group()


def cell(head: str) -> str:
    return f"document.querySelector('#rows td[data-head=\"{head}\"]')?.innerText"


def tile(title: str) -> str:
    return (
        f"[...document.querySelectorAll('#tiles > div')].find((one) => one.innerText.startsWith('{title}'))"
        "?.querySelector('.chip').innerText"
    )


@pytest.fixture(scope="module")
def window() -> Iterator[Browser]:
    with closing(Browser()) as browser:
        yield browser


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with Page() as shown:
        yield shown


@pytest.fixture
def browser(window: Browser) -> Iterator[Browser]:
    """The window with the light theme. At the end its console has no errors."""
    window.size(1280, 860)
    window.theme("light")
    window.log()
    yield window
    bad = [line for line in window.log() if "ERR_" not in line and "401" not in line]
    window.driver.get("about:blank")
    assert bad == []


def look_at(browser: Browser, page: Page, lines: list[scenes.Line], place: str = "#/") -> None:
    """Open the page with these robots on it."""
    page.only(lines)
    browser.driver.get("about:blank")
    browser.driver.get(f"{page.url}{place}")
    listed = "document.querySelectorAll('#rows tr').length"
    one = len(lines) == 1 or place not in ("#/", "#?all")
    browser.wait(f"{LIVE} && " + (f"{WORD} !== undefined" if one else f"{listed} === {len(lines)}"))


def test_the_page_shows_arming_within_a_second(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    browser.driver.get(url(gate) + "/")
    browser.wait("!document.querySelector('#empty').hidden")
    rover = wire(gate.address).beating()
    browser.wait(f"{tile('Drives')} === 'off'")
    rover.beat(armed=True)
    armed = time.time()
    assert in_time(browser.wait(f"{tile('Drives')} === 'POWERED'") - armed, 1.0)
    assert browser.ask(f"return {tile('Emergency stop')}") == "unknown"


def test_nothing_is_known_on_the_page_until_a_restarted_gateway_answers(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    page = ("--http", f"127.0.0.1:{free_port()}")
    gate = gateway("udpin:127.0.0.1:0", *page)
    rover = wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{tile('Drives')} === 'off'")
    gate.stop()
    browser.wait("document.body.classList.contains('stale')")
    assert "NOT CONNECTED" in browser.text("header")
    assert browser.text("#banner").startswith("No connection to the gateway since ")
    assert browser.ask(f"return {WORD}") == "UNKNOWN"
    assert ": PARKED. It may be moving." in browser.text("#verdict")
    assert browser.ask(f"return {tile('Drives')}") == "unknown"
    assert "Last heard: off" in browser.text("#tiles")
    again = gateway("udpin:127.0.0.1:0", *page)
    rover.to = again.address
    rover.beat(armed=True)
    browser.wait(f"{LIVE} && !document.body.classList.contains('stale') && {tile('Drives')} === 'POWERED'")
    assert browser.ask("return document.querySelector('#banner').hidden")


def test_the_page_reports_a_silent_gateway(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{tile('Drives')} === 'off'")
    gate.process.send_signal(signal.SIGSTOP)
    try:
        browser.wait("document.body.classList.contains('stale')")
    finally:
        gate.process.send_signal(signal.SIGCONT)
    browser.wait(f"{LIVE} && !document.body.classList.contains('stale')")


def test_the_page_reports_a_gateway_that_answers_while_its_loop_hangs(browser: Browser) -> None:
    with Page() as page:
        page.put(scenes.parked("rover"))
        page.server.turned = now().mono
        browser.driver.get(page.url)
        browser.wait(LIVE)
        page.server.turned = now().mono - 60
        browser.wait("document.querySelector('#banner').innerText.startsWith('The gateway has been stalled for 6')")
        assert browser.text("#connection") == "STALLED"
        browser.wait(f"{WORD} === 'UNKNOWN'")


def test_the_reasons_of_the_fields_end_when_nothing_arrives_from_the_gateway(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    wire(gate.address).beating()
    browser.driver.get(f"{url(gate)}/#/{HANDLE}")
    browser.wait("document.querySelector('#why').innerText.includes('off')")
    gate.process.send_signal(signal.SIGSTOP)
    try:
        browser.wait("document.querySelector('#why').innerText === ''")
        assert browser.ask("return document.querySelector('#no-why').hidden") is False
    finally:
        gate.process.send_signal(signal.SIGCONT)


def test_a_robot_that_the_gateway_no_longer_has_is_not_shown(browser: Browser, page: Page) -> None:
    page.only([scenes.parked("rover"), scenes.parked("boat")])
    browser.driver.get(f"{page.url}#/rover")
    browser.wait(f"{WORD} === 'PARKED'")
    page.only([scenes.parked("boat")])
    browser.wait("document.querySelector('#who').innerText === 'The gateway has no such robot.'")
    assert browser.text("#verdict") == browser.text("#tiles") == browser.text("#why") == ""


def test_a_lost_link_says_since_when_and_what_was_last_known(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    rover = wire(gate.address).beating()
    browser.driver.get(f"{url(gate)}/#/{HANDLE}")
    browser.wait(f"{WORD} === 'PARKED'")
    rover.beating(False)
    browser.wait(f"{WORD} === 'LOST'")
    assert "Last heard " in browser.text("#verdict")
    assert ": disarmed, MANUAL. It may be moving." in browser.text("#verdict")
    assert "why this is unknown" in browser.text("#causes").lower()
    assert "motion" not in browser.text("#causes").lower()
    assert browser.text("#tiles").count("unknown") == 6
    assert "Last heard: off" in browser.text("#tiles")
    struck = "[...document.querySelectorAll('*')].map((one) => getComputedStyle(one).textDecorationLine)"
    assert "line-through" not in browser.ask(f"return {struck}")
    browser.driver.get(f"{url(gate)}/#?all")
    browser.wait("document.querySelector('#rows .state')?.innerText === 'LOST'")
    assert "Last heard " in browser.text("#rows .why-cell")


def test_a_loss_ends_no_error_in_the_list_of_changes(browser: Browser, page: Page) -> None:
    page.only([])
    for ago, state in ((50, scenes.in_error), (40, scenes.lost), (30, scenes.in_error), (20, scenes.moving)):
        page.put(state("tug"), ago=ago)
    browser.driver.get(f"{page.url}#/tug")
    browser.wait("document.querySelector('#changes').innerText.includes('Error begins')")
    changes = browser.text("#changes")
    assert (changes.count("Error begins"), changes.count("Error ends")) == (1, 1)
    assert "LINK_STALE" not in changes
    assert "unknown" not in changes  # the link says it


def test_a_robot_has_its_explanation_bands_and_changes(
    browser: Browser, gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway(*PAGE)
    fake = autopilot(ardurover.READY, gate.address)
    browser.driver.get(f"{url(gate)}/#/{HANDLE}")
    browser.wait("document.querySelectorAll('#why tr').length === 6")
    fake.arm()
    browser.wait(
        "[...document.querySelectorAll('#why tr')]"
        ".some((row) => /Drives powered\\s+POWERED\\s+armed/.test(row.innerText))"
    )
    assert browser.ask("return document.querySelectorAll('#bands [role=img]').length") == 7
    labels = browser.ask(
        "return [...document.querySelectorAll('#bands [role=img]')].map((svg) => svg.getAttribute('aria-label'))"
    )
    drives = next(label for label in labels if label.startswith("Drives powered"))
    assert "off from " in drives
    assert "POWERED from " in drives
    assert "DISARMED" in browser.text("#changes")


def test_the_only_robot_is_shown_at_once_and_the_list_is_one_click_away(browser: Browser, page: Page) -> None:
    look_at(browser, page, [scenes.parked("mower")])
    assert browser.text("#vehicle-title") == "mower"
    browser.driver.find_element("css selector", ".back a").click()
    browser.wait(f"document.querySelector('#vehicle').hidden && {ORDER}.length === 1")
    browser.driver.find_element("css selector", "#rows a").click()
    browser.wait(f"!document.querySelector('#vehicle').hidden && {WORD} === 'PARKED'")
    look_at(browser, page, [scenes.parked("mower")])
    page.put(scenes.parked("tug", 2))
    browser.wait(f"{ORDER}.length === 2")


def test_a_headline_has_its_reason_and_a_next_step_that_opens_the_help(browser: Browser, page: Page) -> None:
    look_at(browser, page, [scenes.failing("mower")])
    assert browser.ask(f"return {WORD}") == "CANNOT ARM"
    assert "Cannot arm: “GPS 1: Bad fix”." in browser.text("#verdict")
    quoted = browser.ask("return [...document.querySelectorAll('#verdict bdi')].map((one) => one.innerText)")
    assert "GPS 1: Bad fix" in quoted  # kept apart from our words
    assert "PREARM_FAILING" not in browser.text("#verdict")
    browser.driver.find_element("css selector", "#verdict .step a").click()
    browser.wait("document.querySelector('h2:target') !== null")
    assert "help.html#gps" in browser.driver.current_url


def test_problems_are_first_and_a_row_moves_only_when_its_rank_changes(browser: Browser, page: Page) -> None:
    states = {"a": scenes.parked, "b": scenes.moving, "c": scenes.lost, "d": scenes.in_error, "e": scenes.stopped}
    look_at(browser, page, [state(name, n) for n, (name, state) in enumerate(states.items(), 1)])
    assert browser.ask(f"return {ORDER}") == ["e", "d", "c", "b", "a"]
    page.put(scenes.in_error("a", 1))
    browser.wait(f"{ORDER}.join('') === 'eadcb'")
    error = scenes.error(2001, "RADIO_FAILSAFE", "Radio Failsafe")
    page.put(scenes.in_error("d", 4) | {"error_code": 2001, "errors": [error]})
    browser.wait("document.querySelector('#rows').innerText.includes('Radio Failsafe')")
    assert browser.ask(f"return {ORDER}") == ["e", "a", "d", "c", "b"]


def test_counts_filter_and_a_search_finds_and_columns_sort(browser: Browser, page: Page) -> None:
    look_at(browser, page, scenes.fleet(24))
    counts = browser.ask("return [...document.querySelectorAll('#filters button')].map((one) => one.innerText)")
    assert counts == ["24 All", "2 In error", "2 E-stopped", "4 Not heard", "8 Can move"]
    button = browser.driver.find_elements("css selector", "#filters button")
    button[3].click()
    browser.wait(f"{ORDER}.length === 4")
    assert set(browser.text("#rows .state").split("\n")) <= {"LOST", "NOT HEARD"}
    button[3].click()
    browser.wait(f"{ORDER}.length === 24")
    search = browser.driver.find_element("id", "search")
    search.send_keys("battery")
    browser.wait(f"{ORDER}.length === 2")
    search.send_keys(" of nobody")
    browser.wait("!document.querySelector('#none').hidden")
    search.clear()
    search.send_keys(" ")
    browser.wait(f"{ORDER}.length === 24")
    browser.driver.find_element("css selector", "#head .robot button").click()
    browser.wait("document.querySelector('#head .robot').getAttribute('aria-sort') === 'ascending'")
    names = browser.ask(f"return {ORDER}")
    assert names[:3] == ["Boat 16", "boat-6", "carrier-8"]
    browser.driver.find_element("css selector", "#head .robot button").click()
    browser.wait("document.querySelector('#head .robot').getAttribute('aria-sort') === 'descending'")
    assert browser.ask(f"return {ORDER}") == names[::-1]


def test_a_name_is_the_title(browser: Browser, page: Page) -> None:
    one = scenes.parked(HANDLE)
    look_at(browser, page, [one | {"vehicle": scenes.vehicle("HOLD", name="Rover A")}])
    assert browser.text("#vehicle-title") == "Rover A"
    assert HANDLE in browser.text("#who")


def test_a_group_has_its_members_below_it_and_its_reasons_name_them(browser: Browser, page: Page) -> None:
    look_at(browser, page, scenes.group())
    rows = "return [...document.querySelectorAll('#rows tr')].map((row) => [row.querySelector('a').innerText, "
    assert browser.ask(rows + "row.classList.contains('member')])") == [["robot", False], ["base", True], ["arm", True]]
    assert browser.text("#filters").startswith("2 All")
    assert browser.text("#fleet-title") == "2 robots"
    browser.ask("location.hash = '#/robot'")
    browser.wait("document.querySelectorAll('#members-rows tr').length === 2")
    browser.wait(f"{WORD} === 'ARMED'")
    assert "arm is stopped; base is READY and may move." in browser.text("#verdict")
    assert browser.ask("return document.querySelector('#verdict').className") == "alarm"
    members = "[...document.querySelectorAll('#members-rows td[data-head=\"E-stop\"]')].map((one) => one.innerText)"
    assert browser.ask(f"return {members}") == ["no", "STOP"]
    assert "base, arm" in browser.text("#who")
    browser.ask("location.hash = '#/base'")
    browser.wait("document.querySelector('#vehicle-title').innerText === 'base'")
    assert browser.ask("return document.querySelector('#members').hidden") is True


def test_texts_of_a_robot_are_not_interpreted_as_html(browser: Browser, page: Page) -> None:
    text = "<script>document.title='x'</script><img src=x>"
    hostile = scenes.in_error("tug") | {"in_error": True, "errors": [scenes.error(2004, text, text)]}
    look_at(browser, page, [hostile | {"vehicle": scenes.vehicle(text, name=text)}])
    browser.wait("document.querySelector('#changes').innerText.includes('Error begins')")
    for part in ("#verdict", "#causes", "#changes", "#vehicle-title"):
        assert text.lower() in browser.text(part).lower(), part
    assert browser.ask("return document.querySelectorAll('main script, main img').length") == 0
    assert browser.ask("return document.title") != "x"


def test_twenty_robots_fit_on_a_screen_and_fifty_on_a_wall(browser: Browser, page: Page) -> None:
    rows = "[...document.querySelectorAll('#rows tr')]"
    lowest = f"return Math.max(...{rows}.map((one) => one.getBoundingClientRect().bottom))"
    for number, size in ((20, (1280, 860)), (50, (1920, 1080))):
        browser.size(*size)
        look_at(browser, page, scenes.fleet(number))
        assert browser.ask(lowest) <= size[1], number
        assert browser.ask(OUTSIDE) == []


def test_with_254_robots_only_the_cells_that_change_are_drawn_again(browser: Browser, page: Page) -> None:
    look_at(browser, page, scenes.fleet(254))
    browser.ask(
        "window.made = {};"
        "new MutationObserver((list) => {"
        "  for (const { target } of list) {"
        "    const cell = (target.closest ? target : target.parentElement).closest('td, th');"
        "    if (!cell || cell.className === 'link') continue;"  # the age of what was heard
        "    const handle = cell.closest('tr').querySelector('a').hash;"
        "    (window.made[handle] ??= {})[cell.dataset.head ?? 'name'] = true;"
        "  }"
        "}).observe(document.querySelector('#rows'),"
        "  { childList: true, subtree: true, characterData: true, attributes: true })"
    )
    changing = [line for line in scenes.fleet(254) if line["mode"] == "MANUAL" and line["in_motion"] is False][:60]
    places = [f"#/{one['handle']}" for one in changing]
    links = f"[...document.querySelectorAll('#rows a')].filter((one) => {json.dumps(places)}.includes(one.hash))"
    page.put(*(one | {"in_motion": None} for one in changing))
    browser.wait(f"{links}.every((one) => one.closest('tr').innerText.includes('unk'))")
    made = browser.ask("return window.made")
    assert set(made) == set(places)
    assert {head for cells in made.values() for head in cells} <= {"Moves", "Why"}


def test_with_254_robots_a_crash_is_seen_at_once_and_at_the_top(browser: Browser, page: Page) -> None:
    lines = [scenes.parked(f"robot-{n}", n) for n in range(1, 255)]
    look_at(browser, page, lines)
    assert browser.text("#fleet-title") == "254 robots"
    page.put(scenes.crashed("robot-200", 200))
    crashed = time.time()
    seen = browser.wait(f"{ORDER}[0] === 'robot-200'")
    assert in_time(seen - crashed, 1.0)
    assert browser.text("#rows .state") == "CRASHED"


def test_everything_fits_on_a_phone(browser: Browser, page: Page) -> None:
    browser.size(NARROW, 740)
    for lines in (scenes.fleet(12), [scenes.in_error("a-robot-with-a-long-name-1")], [scenes.lost("rover")]):
        look_at(browser, page, lines)
        assert browser.ask(OUTSIDE) == []
        spans = "[...document.querySelectorAll('.why-cell span')]"
        halves = f"{spans}.map((one) => one.parentElement.clientHeight - one.offsetHeight)"
        assert min(browser.ask(f"return {halves}"), default=0) >= 0  # no half line
    assert browser.ask("return parseFloat(getComputedStyle(document.querySelector('#verdict strong')).fontSize)") >= 28
    assert browser.ask("return document.querySelector('#verdict').getBoundingClientRect().bottom < innerHeight")


def test_the_page_can_be_used_with_the_keyboard_alone(browser: Browser, page: Page) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    look_at(browser, page, [scenes.parked("tug"), scenes.parked("mower", 2)])
    focused = "document.activeElement.closest('#rows') !== null"
    stops = 0
    while not browser.ask(f"return {focused}"):
        ActionChains(browser.driver).send_keys(Keys.TAB).perform()
        stops += 1
        assert stops < 30
    ActionChains(browser.driver).send_keys(Keys.TAB).perform()
    page.put(scenes.ready("tug"))
    browser.wait(f"{cell('Drives')} === 'ON'")
    assert browser.ask(f"return {ORDER}") == ["tug", "mower"]
    assert browser.ask("return document.activeElement.innerText") == "tug"  # a row keeps the focus when it moves
    ActionChains(browser.driver).send_keys(Keys.ENTER).perform()
    browser.wait("document.activeElement.id === 'vehicle-title' && !document.querySelector('#vehicle').hidden")


def test_a_new_alarm_is_marked_until_a_person_acknowledges_it(browser: Browser) -> None:
    with Page(alarm=True) as page:
        look_at(browser, page, [scenes.moving("tug"), scenes.parked("mower", 2)])
        assert browser.text("#sound") == "Sound off: click once to turn it on"
        assert browser.ask("return document.querySelector('#alarms').hidden")
        page.put(scenes.in_error("tug"), scenes.stopped("mower", 2))
        browser.wait("document.querySelectorAll('#alarm-list li').length === 2")
        assert browser.ask("return document.title").startswith("▲ NEW")
        assert browser.ask("return document.querySelectorAll('#rows tr.new').length") == 2
        browser.driver.find_element("id", "acknowledge").click()
        browser.wait(
            "document.querySelector('#alarms').hidden && document.querySelectorAll('#rows tr.new').length === 0"
        )
        assert browser.text("#sound") == "Sound on"  # the click allowed it
        page.put(scenes.lost("tug"))
        browser.wait("document.querySelectorAll('#alarm-list li').length === 1")
        page.put(scenes.in_error("tug"))  # heard again: its error is not new, and the loss stays marked
        browser.wait("document.querySelectorAll('#rows tr.alarm').length === 2")
        assert "LOST" in browser.text("#alarm-list")
        assert browser.ask("return document.querySelectorAll('#alarm-list li').length") == 1


def test_an_acknowledgement_counts_for_everybody_who_looks(browser: Browser) -> None:
    with Page(alarm=True) as page, closing(Browser()) as other:
        page.only([scenes.moving("tug"), scenes.parked("mower", 2)])
        page.put(scenes.stopped("mower", 2))
        for one in (browser, other):
            one.driver.get(page.url)
            one.wait("document.querySelectorAll('#alarm-list li').length === 1")
        assert browser.text("#alarm-list button") == "Acknowledge"
        other.driver.find_element("css selector", "#alarm-list button").click()
        for one in (browser, other):
            one.wait("document.querySelector('#alarms').hidden")
            one.wait("document.querySelectorAll('#log li').length === 2")
        first, second = browser.text("#log").split("\n")[:2]
        assert re.fullmatch(r"\d\d:\d\d:\d\d mower EMERGENCY STOP engaged \(acknowledged\)", first)
        assert re.fullmatch(r"\d\d:\d\d:\d\d mower EMERGENCY STOP engaged", second)


def test_the_events_have_begin_and_end_the_newest_first(browser: Browser, page: Page) -> None:
    page.only([])
    look_at(browser, page, [scenes.parked("tug"), scenes.parked("mower", 2)])
    for state in (scenes.stopped, scenes.parked, scenes.lost) * 70:
        page.put(state("tug"))
    log = "document.querySelector('[role=log][aria-label=Events]')"
    browser.wait(f"{log}?.innerText.includes('LOST')")
    browser.wait(f"{log}.querySelectorAll('li').length >= 200")
    texts = browser.ask(f"return [...{log}.querySelectorAll('li')].map((one) => one.innerText)")
    assert re.match(r"\d\d:\d\d:\d\d tug LOST nothing heard", texts[0])
    assert any(re.match(r"\d\d:\d\d:\d\d tug EMERGENCY STOP released, now PARKED", one) for one in texts)


def test_a_band_shows_no_time_for_which_its_field_is_not_kept(browser: Browser, page: Page) -> None:
    page.only([])
    for n in range(700):
        page.put((scenes.parked, scenes.ready)[n % 2]("tug"), ago=70 - n / 10)
    browser.driver.get(f"{page.url}#/tug")
    label = "document.querySelector('#bands [role=img][aria-label^=\"Drives powered\"]')"
    browser.wait(f"{label}?.getAttribute('aria-label').includes('not kept before ')")
    first = "Math.min(...[...LABEL.querySelectorAll('rect')].map((one) => parseFloat(one.getAttribute('x'))))"
    oldest = browser.ask(f"return {first.replace('LABEL', label)}")
    assert oldest >= 100 * (1 - 15 / 600)  # 120 changes at 10 Hz are 12 s
    quiet = browser.ask(f"return {first.replace('LABEL', label.replace('Drives powered', 'Error'))}")
    assert quiet <= 100 * (1 - 65 / 600)  # nothing displaced what is known of a quiet field


@pytest.mark.parametrize("address", ["wall", "?wall"])
def test_a_wall_shows_the_robots_in_trouble_in_large_letters_and_nothing_below_its_edge(
    browser: Browser, page: Page, address: str
) -> None:
    browser.size(1920, 1080)
    page.only(scenes.fleet(254))
    browser.driver.get("about:blank")
    browser.driver.get(page.url + address)
    browser.wait("document.querySelectorAll('#wall-robots li').length > 0")
    assert browser.text("#wall-counts").startswith("254 robots")
    size = "return parseFloat(getComputedStyle(document.querySelector(arguments[0])).fontSize)"
    assert browser.ask(size, "#wall-robots strong") >= 72
    assert browser.ask(size, "#wall-robots .name") >= 28
    words = browser.ask("return [...document.querySelectorAll('#wall-robots strong')].map((one) => one.innerText)")
    assert words[0] == "EMERGENCY STOP"
    lowest = browser.ask(
        "return Math.max(...[...document.querySelectorAll('#wall *')].map((one) => one.getBoundingClientRect().bottom))"
    )
    assert lowest <= 1080
    rest = re.fullmatch(r"and (\d+) more", browser.text("#wall-rest"))
    assert rest is not None
    assert browser.ask("return document.querySelectorAll('header, button, input').length > 0")
    assert not browser.ask(
        "return [...document.querySelectorAll('header, button, footer')].some((one) => one.checkVisibility())"
    )
    before = browser.text("#wall-clock")
    browser.wait(f"document.querySelector('#wall-clock').innerText !== '{before}'")


def test_a_page_that_a_person_left_keeps_no_connection(browser: Browser) -> None:
    with Page() as page:
        for _ in range(8):  # a browser has six connections to a server
            look_at(browser, page, [scenes.parked("tug")])
        browser.driver.get("about:blank")
        wait_until(lambda: not page.server.watched)


def test_without_the_option_there_are_no_alarms(browser: Browser, page: Page) -> None:
    look_at(browser, page, scenes.fleet(12))
    assert browser.ask("return document.querySelector('#alarms').hidden && document.querySelector('#sound').hidden")


@pytest.mark.slow
def test_axe_finds_nothing_in_any_state_light_or_dark(browser: Browser, page: Page) -> None:
    axe = Path(pytest.importorskip("axe_core_python", reason="pip install -e '.[dev]'").__file__).with_name(
        "axe.min.js"
    )
    script = axe.read_text("utf-8")
    found: dict[str, Any] = {}
    for lines, place in (
        *(([state("rover")], "#/") for state in scenes.STATES),
        (scenes.fleet(12), "#/"),
        (GROUP, "#/robot"),
    ):
        look_at(browser, page, lines, place)
        browser.ask(script)
        found |= {f"{lines} {one}": one for one in inspected(browser)}
    browser.driver.get(f"{page.url}help.html")
    browser.ask(script)
    found |= {f"help {one}": one for one in inspected(browser)}
    assert found == {}


def inspected(browser: Browser) -> list[Any]:
    """What axe finds in the light theme, and of the colours in the dark one."""
    found = list(browser.driver.execute_async_script(AXE, {}))
    browser.theme("dark")
    found += browser.driver.execute_async_script(AXE, {"runOnly": ["color-contrast"]})
    browser.theme("light")
    return found


def test_a_token_opens_the_page(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire], tmp_path: Path
) -> None:
    token = tmp_path / "token"
    token.write_text("correct-horse-battery")
    token.chmod(0o600)
    gate = gateway(*PAGE, "--http-token-file", str(token))
    wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait("document.activeElement.id === 'token-field'")
    assert "System" not in browser.text("main")
    field = browser.driver.find_element("id", "token-field")
    field.send_keys("wrong\n")
    browser.wait("!document.querySelector('#wrong').hidden")
    field.send_keys("correct-horse-battery\n")
    browser.wait(f"{tile('Drives')} === 'off'")
    browser.ask("sessionStorage.clear()")
    browser.driver.get("about:blank")
    browser.driver.get(f"{url(gate)}/#token=correct-horse-battery")
    browser.wait(f"{tile('Drives')} === 'off'")
    assert "horse" not in browser.driver.current_url
