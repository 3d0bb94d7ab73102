"""Debian's chromium, driven by selenium: for the tests of the page, and for the pictures in the documentation."""

from __future__ import annotations

import base64
import shutil
from pathlib import Path
from typing import Any

from ..deadline import SOON, Deadline, allow

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-dev-shm-usage",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
)  # fmt: skip
MISSING = next(
    (
        f"{name} is not installed: apt-get install chromium chromium-driver"
        for name in ("chromium", "chromedriver")
        if not shutil.which(name)
    ),
    None,
)
"""The reason to skip the tests that need a browser."""

SCRIPT = 5.0  # s that one script in the page waits


class Browser:
    """One window."""

    def __init__(self) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = str(shutil.which("chromium"))
        for flag in FLAGS:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver: Any = webdriver.Chrome(options=options, service=Service(str(shutil.which("chromedriver"))))
        self.driver.set_script_timeout(allow(20))

    def size(self, width: int, height: int) -> None:
        """As wide as a phone, or a screen."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def theme(self, name: str) -> None:
        """`light` or `dark`."""
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    def ask(self, script: str, *arguments: Any) -> Any:
        """What a script returns."""
        return self.driver.execute_script(script, *arguments)

    def wait(self, condition: str, seconds: float = SOON) -> Any:
        """Wait until a JavaScript expression is true; the Unix time of that, in seconds."""
        script = """
            const [condition, ms, done] = arguments;
            const test = new Function("return (" + condition + ")");
            const start = performance.now();
            (function look() {
                if (test()) done(performance.timeOrigin / 1000 + performance.now() / 1000);
                else if (performance.now() - start > ms) done(null);
                else setTimeout(look, 10);
            })();
        """
        deadline = Deadline(seconds)
        while (at := self.driver.execute_async_script(script, condition, SCRIPT * 1000)) is None:
            assert deadline.left, f"not true: {condition}; the page says:\n{self.text()}"
        return at

    def text(self, selector: str = "body") -> str:
        """The visible text of an element."""
        return str(self.ask("return document.querySelector(arguments[0])?.innerText ?? ''", selector))

    def log(self) -> list[str]:
        """What the console said."""
        return [str(entry["message"]) for entry in self.driver.get_log("browser")]

    def picture(self, path: Path, whole: bool = False) -> None:
        """Write a PNG of what is seen, or of the whole page."""
        asked = {"format": "png", "captureBeyondViewport": whole}
        if whole:
            width, height = self.ask("return [innerWidth, document.documentElement.scrollHeight]")
            asked["clip"] = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", asked)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self) -> None:
        """End it."""
        self.driver.quit()
