"""Who asks for metrics waits for the gateway's next turn."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from mav_robot_status.interface import Metrics
from mav_robot_status.publishers.metrics import CONTENT_TYPE
from mav_robot_status.publishers.web import scrape
from mav_robot_status.publishers.web.scrape import Scrapes

ASKED = cast("Any", None)
"""A request; nothing of it is looked at."""


def test_all_who_wait_get_what_was_taken_after_they_asked() -> None:
    async def story() -> None:
        scrapes = Scrapes()
        assert not scrapes.wanted
        waiting = [asyncio.ensure_future(scrapes.answer(ASKED)) for _ in range(3)]
        await asyncio.sleep(0)
        assert scrapes.wanted
        scrapes.give(Metrics(record_dropped=7))
        for answer in await asyncio.gather(*waiting):
            assert answer.status == 200
            assert answer.headers["Content-Type"] == CONTENT_TYPE
            assert b"record_dropped_frames_total 7\n" in cast("bytes", answer.body)

    asyncio.run(story())


def test_a_gateway_that_stands_still_gives_no_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scrape, "PATIENCE", 0.02)

    async def story() -> None:
        scrapes = Scrapes()
        assert (await scrapes.answer(ASKED)).status == 503
        scrapes.give(Metrics())  # nobody waits any more

    asyncio.run(story())
