"""The page in a real browser."""

from __future__ import annotations

import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from mav_robot_status.clock import now
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web.serve import serve
from mav_robot_status.publishers.web.settings import WebSettings
from mav_robot_status.testing import FakeAutopilot, ardurover

from ..deadline import in_time
from .browser import MISSING, Browser
from .gateway_process import Gateway
from .test_web import PAGE, url
from .wire import Wire

pytestmark = pytest.mark.skipif(MISSING is not None, reason=MISSING or "")

HANDLE = "industrial_robot_status_handle"
NARROW = 360
IN_VIEW = "document.querySelector('#connection').innerText === 'live'"


def cell(head: str) -> str:
    return f"document.querySelector('#rows td[data-head=\"{head}\"]')?.innerText"


@pytest.fixture(scope="module")
def window() -> Iterator[Browser]:
    with closing(Browser()) as browser:
        yield browser


@pytest.fixture
def browser(window: Browser) -> Iterator[Browser]:
    """The window with the light theme. At the end its console has no errors."""
    window.size(1280, 800)
    window.theme("light")
    window.log()
    yield window
    bad = [line for line in window.log() if "ERR_" not in line and "401" not in line]
    window.driver.get("about:blank")
    assert bad == []


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as one:
        return int(one.getsockname()[1])


def test_the_page_shows_arming_within_a_second(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    browser.driver.get(url(gate) + "/")
    browser.wait("!document.querySelector('#empty').hidden")
    rover = wire(gate.address).beating()
    browser.wait(f"{cell('Drives')} === 'off'")
    rover.beat(armed=True)
    armed = time.time()
    assert in_time(browser.wait(f"{cell('Drives')} === 'POWERED'") - armed, 1.0)
    assert browser.ask(f"return {cell('E-stop')}") == "UNKNOWN"


def test_the_page_is_stale_until_a_restarted_gateway_answers(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    page = ("--http", f"127.0.0.1:{free_port()}")
    gate = gateway("udpin:127.0.0.1:0", *page)
    rover = wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{cell('Drives')} === 'off'")
    assert browser.ask("return document.body.className") == ""
    gate.stop()
    browser.wait("document.body.classList.contains('stale')")
    assert "NOT CONNECTED" in browser.text("header")
    banner = browser.text("#banner")
    assert banner.startswith("No connection to the gateway since ")
    assert "ago. The data shown is from then" in banner
    assert browser.ask("return getComputedStyle(document.querySelector('#fleet')).filter") == "grayscale(1)"
    again = gateway("udpin:127.0.0.1:0", *page)
    rover.to = again.address
    rover.beat(armed=True)
    browser.wait(f"{IN_VIEW} && !document.body.classList.contains('stale') && {cell('Drives')} === 'POWERED'")
    assert browser.ask("return document.querySelector('#banner').hidden")


def test_the_page_reports_a_silent_gateway(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway(*PAGE)
    wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{cell('Drives')} === 'off'")
    gate.process.send_signal(signal.SIGSTOP)
    try:
        browser.wait("document.body.classList.contains('stale')")
    finally:
        gate.process.send_signal(signal.SIGCONT)
    browser.wait(f"{IN_VIEW} && !document.body.classList.contains('stale')")


def test_the_page_reports_a_gateway_that_answers_while_its_loop_hangs(browser: Browser) -> None:
    server = serve(Board(), WebSettings(port=0))
    try:
        server.turned = now().mono
        browser.driver.get(server.url)
        browser.wait(IN_VIEW)
        server.turned = now().mono - 60
        browser.wait("document.querySelector('#banner').innerText.startsWith('The gateway has been stalled for 6')")
        assert browser.text("#connection") == "STALLED"
        assert browser.ask("return document.body.className") == "stale"
    finally:
        server.close()


def test_a_lost_link_is_shown(browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]) -> None:
    gate = gateway(*PAGE)
    rover = wire(gate.address).beating()
    browser.driver.get(f"{url(gate)}/#/{HANDLE}")
    browser.wait("document.querySelector('#verdict strong')?.innerText === 'MOTION NOT POSSIBLE'")
    rover.beating(False)
    browser.wait("document.querySelector('#verdict strong').innerText === 'NO LINK'")
    assert "LINK_STALE" in browser.text("#causes")
    assert "It may move." in browser.text("#verdict")
    assert browser.text("#tiles").count("UNKNOWN") == 6
    browser.driver.get(f"{url(gate)}/#/")
    browser.wait(f"{cell('Link')}?.startsWith('LOST')")


def test_a_vehicle_has_its_explanation_bands_and_changes(
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
    assert browser.ask("return document.querySelectorAll('#bands svg').length") == 7
    labels = browser.ask(
        "return [...document.querySelectorAll('#bands svg')].map((svg) => svg.getAttribute('aria-label'))"
    )
    drives = next(label for label in labels if label.startswith("Drives powered"))
    assert "off from " in drives
    assert "POWERED from " in drives
    assert "DISARMED" in browser.text("#changes")
    browser.ask("location.hash = '#/'")
    browser.wait("document.querySelector('#vehicle').hidden && document.querySelectorAll('#rows tr').length === 1")


def test_texts_of_a_vehicle_are_not_interpreted_as_html(
    browser: Browser, gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway(*PAGE)
    fake = autopilot(ardurover.READY, gate.address)
    gate.wait_for(lambda s: s["in_error"] is False)
    fake.arm()
    gate.wait_for(lambda s: s["drives_powered"] is True)
    text = "<script>document.title='x'</script><img src=x>"
    fake.say(0, text)
    gate.wait_for(lambda s: s["errors"] and s["errors"][0]["text"] == text)
    browser.driver.get(f"{url(gate)}/#/{HANDLE}")
    browser.wait("document.querySelector('#causes').innerText.includes('<script>')")
    assert text in browser.text("#causes")
    assert text in browser.text("#changes")
    assert browser.ask("return document.querySelectorAll('main script, main img').length") == 0
    assert browser.ask("return document.title") != "x"


def test_everything_fits_on_a_phone(
    browser: Browser, gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway(*PAGE)
    autopilot(ardurover.READY, gate.address)
    browser.size(NARROW, 740)
    for place, there in (
        ("#/", "document.querySelectorAll('#rows tr').length"),
        (f"#/{HANDLE}", "document.querySelectorAll('#why tr').length"),
    ):
        browser.driver.get("about:blank")
        browser.driver.get(f"{url(gate)}/{place}")
        browser.wait(there)
        outside = browser.ask(
            "return [...document.querySelectorAll('header *, main *, footer *')].filter((one) => one.checkVisibility()"
            " && !one.closest('thead') && one.getBoundingClientRect().right > innerWidth + 1)"
            ".map((one) => one.outerHTML)"
        )
        assert outside == []
    assert browser.ask("return parseFloat(getComputedStyle(document.querySelector('#verdict strong')).fontSize)") >= 28
    assert browser.ask("return document.querySelector('#verdict').getBoundingClientRect().bottom < innerHeight")


def test_the_page_can_be_used_with_the_keyboard_alone(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    gate = gateway(*PAGE)
    rover = wire(gate.address).beating()
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{cell('Drives')} === 'off'")
    ActionChains(browser.driver).send_keys(Keys.TAB, Keys.TAB).perform()
    focused = "document.activeElement.closest('#rows') !== null"
    assert browser.ask(f"return {focused}")
    rover.beat(armed=True)
    browser.wait(f"{cell('Drives')} === 'POWERED'")
    assert browser.ask(f"return {focused}")  # a change keeps the focus
    ActionChains(browser.driver).send_keys(Keys.ENTER).perform()
    browser.wait("document.activeElement.id === 'vehicle-title' && !document.querySelector('#vehicle').hidden")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_has_enough_contrast(
    browser: Browser, gateway: Callable[..., Gateway], wire: Callable[..., Wire], theme: str
) -> None:
    gate = gateway(*PAGE)
    wire(gate.address).beating()
    browser.theme(theme)
    browser.driver.get(url(gate) + "/")
    browser.wait(f"{cell('Drives')} === 'off'")
    contrasts = browser.ask(
        """
        const style = getComputedStyle(document.documentElement);
        const light = (name) => {
            const hex = style.getPropertyValue(name).trim();
            const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
            const linear = parts.map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
            return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        };
        const ground = light("--surface");
        return ["--ink", "--soft", "--good", "--caution", "--danger", "--active", "--unknown"].map((name) => {
            const [high, low] = [light(name), ground].sort((a, b) => b - a);
            return (high + 0.05) / (low + 0.05);
        });
        """
    )
    assert min(contrasts) > 4.5  # WCAG 2 AA


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
    browser.wait(f"{cell('Drives')} === 'off'")
    browser.ask("sessionStorage.clear()")
    browser.driver.get("about:blank")
    browser.driver.get(f"{url(gate)}/#token=correct-horse-battery")
    browser.wait(f"{cell('Drives')} === 'off'")
    assert "horse" not in browser.driver.current_url
